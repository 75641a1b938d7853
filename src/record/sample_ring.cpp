// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/sample_ring.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

constexpr double kForgetShare = 0.05;  // - of the window, which is forgotten at a time: moving all at each
                                       // sample would cost as much as the window is long

}  // namespace

SampleRing::SampleRing(RingSettings settings) : settings_(std::move(settings)) {
  if (!(settings_.window > 0)) throw InvalidParameter("window", settings_.window, "must be > 0 s");
}

bool SampleRing::add(double time, const ChannelValues& values) {
  if (!std::isfinite(time)) throw InvalidParameter("time", time, "must be finite");
  const auto missing = [&](Channel c) { return !std::isfinite(values[static_cast<std::size_t>(c)]); };
  if (std::any_of(settings_.channels.begin(), settings_.channels.end(), missing)) {
    ++counters_.not_a_number;
    return false;
  }
  if (!empty()) {
    const double step = time - end();
    if (step == 0 || (step < 0 && step >= -settings_.late)) {
      ++(step == 0 ? counters_.repeated : counters_.late);
      return false;
    }
    if (step < 0 || step > settings_.longest_gap) {
      ++counters_.restarts;
      counters_.last_jump = "the clock jumped by " + to_text(std::round(1e3 * step) / 1e3) + " s";
      clear();
    }
  }
  record_.time.push_back(time);
  for (const Channel c : settings_.channels) record_.column(c).push_back(values[static_cast<std::size_t>(c)]);
  ++counters_.taken;
  forget();
  return true;
}

void SampleRing::forget() {
  if (length() <= (1 + kForgetShare) * settings_.window) return;
  const auto first =
      std::lower_bound(record_.time.begin(), record_.time.end(), record_.time.back() - settings_.window);
  record_.forget(static_cast<std::size_t>(first - record_.time.begin()));
}

void SampleRing::clear() {
  record_.forget(record_.size());
}

}  // namespace backlash::record
