// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/shared_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace backlash::record {
namespace {

constexpr std::size_t kPlaces = 64, kBlock = 32;  // choices: where is asked, and samples there
constexpr std::size_t kMoves = 16;  // choice: of the samples of a block, other than the one before

class Samples {
 public:
  explicit Samples(const Record& record)
      : torque_(record.column(Channel::motor_torque)), position_(record.column(Channel::motor_position)) {}

  std::size_t size() const { return std::min(torque_.size(), position_.size()); }

  bool moves(std::size_t from) const {
    std::size_t changes = 0;
    for (std::size_t i = from + 1; i < from + kBlock; ++i)
      changes += torque_[i] != torque_[i - 1] || position_[i] != position_[i - 1];
    return changes >= kMoves;
  }

  /// Whether the block of `other` from there stands anywhere here.
  bool hold(const Samples& other, std::size_t from) const {
    for (std::size_t i = 0; i + kBlock <= size(); ++i)
      if (same(torque_, i, other.torque_, from) && same(position_, i, other.position_, from)) return true;
    return false;
  }

 private:
  static bool same(const std::vector<double>& a, std::size_t i, const std::vector<double>& b, std::size_t k) {
    return a[i] == b[k] && std::equal(a.begin() + long(i), a.begin() + long(i + kBlock), b.begin() + long(k));
  }

  const std::vector<double>&torque_, &position_;
};

}  // namespace

double shared_samples(const Record& asked, const Record& known) {
  const Samples samples(asked), others(known);
  std::size_t places = 0, shared = 0;
  for (std::size_t k = 0; k < kPlaces && samples.size() >= kBlock; ++k) {
    const std::size_t from = k * (samples.size() - kBlock) / (kPlaces - 1);
    if (!samples.moves(from)) continue;
    ++places;
    shared += others.hold(samples, from);
  }
  return places > 0 ? double(shared) / double(places) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace backlash::record
