// SPDX-License-Identifier: BSD-3-Clause
#include "same_throughout.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/robust.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr int kParts = 4;
constexpr std::size_t kFewest = 6;      // choice: passages before a cut, and after
constexpr double kChange = 0.1;         // choice: of the larger play
constexpr double kErrors = 4;           // choice: of the medians
constexpr double kMedianOfMean = 1.25;  // theory: a median scatters so much more than a mean

/// Squared error of a median.
double square_error(const signal::RobustScale& scale, std::size_t count) {
  return std::pow(kMedianOfMean * scale.deviation, 2) / double(count);
}

}  // namespace

void require_same_throughout(const std::vector<double>& plays, double half_width) {
  const std::size_t n = plays.size();
  for (int part = 1; part < kParts; ++part) {
    const std::size_t cut = part * n / kParts;
    if (std::min(cut, n - cut) < kFewest) continue;
    const auto middle = plays.begin() + long(cut);
    const signal::RobustScale before = signal::robust_scale({plays.begin(), middle}, 0),
                              after = signal::robust_scale({middle, plays.end()}, 0);
    const double errors = std::sqrt(square_error(before, cut) + square_error(after, n - cut));
    const double larger = std::max(before.centre, after.centre);
    if (std::abs(after.centre - before.centre) >
        std::max(2 * half_width, kChange * larger) + kErrors * errors)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the play is not the same throughout the record: the first {} of {} passages "
                                "give {:.4g} rad, the others {:.4g} rad",
                                cut, n, before.centre, after.centre)};
  }
}

}  // namespace backlash::diagnosis
