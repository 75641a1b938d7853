// SPDX-License-Identifier: BSD-3-Clause
// The part of the search for changes that deals with what no effect explains.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "change_search.h"

namespace backlash::changes {

namespace {

constexpr int kMostTurns = 10;  // choice: two or three are usual

}  // namespace

std::vector<double> ChangeSearch::times() const {
  std::vector<double> times;
  for (Eigen::Index r = 0; r < motion_.size(); ++r) times.push_back(motion_.time(r));
  return times;
}

std::vector<double> ChangeSearch::squares_over_healthy(const std::vector<FoundChange>& all,
                                                       const std::optional<LoudStretch>& apart) const {
  Background b = background(all);
  if (apart) {
    Background weighted = b;
    for (Eigen::Index r = 0; r < motion_.size(); ++r) {
      if (motion_.time(r) < apart->from || (!apart->to_end && motion_.time(r) >= apart->to)) continue;
      weighted.residual[r] /= std::sqrt(apart->times);
      weighted.columns.row(r) /= std::sqrt(apart->times);
    }
    weighted.solve();
    b.estimate = weighted.estimate;
  }
  const Eigen::VectorXd left = b.left();
  const Eigen::VectorXd squares = left.array().square() / b.variance;
  return {squares.begin(), squares.end()};
}

std::optional<LoudStretch> ChangeSearch::loud(const std::vector<FoundChange>& all) const {
  std::optional<LoudStretch> loud = loud_stretch(times(), squares_over_healthy(all), settings_);
  // Friction that may wander follows what is loud, and leaves the time before as loud as that: both are
  // searched for in turn until neither moves.
  for (int i = 0; loud && i < kMostTurns; ++i) {
    const std::optional<LoudStretch> next = loud_stretch(times(), squares_over_healthy(all, loud), settings_);
    if (!next || (next->from == loud->from && next->to == loud->to)) break;
    loud = next;
  }
  return loud;
}

std::optional<LoudStretch> ChangeSearch::louder() const {
  Eigen::MatrixXd motion(motion_.size(), 5);
  for (Eigen::Index r = 0; r < motion_.size(); ++r) {
    const Moment& m = motion_.moment(r);
    motion.row(r) << m.position, m.position * m.position, std::fabs(m.speed), std::fabs(m.acceleration),
        std::fabs(m.jerk);
  }
  return louder_stretch(times(), squares_over_healthy({}), motion, settings_);
}

Change ChangeSearch::unknown(const LoudStretch& stretch) const {
  Change change;
  change.effect = "unknown";
  change.gain = stretch.gain;
  change.since = motion_.start + stretch.from;
  change.since_from = change.since - settings_.window;
  change.since_to = change.since + settings_.window;
  if (!stretch.to_end) change.until = motion_.start + stretch.to;
  change.error_before = change.error_after = model_.noise * std::sqrt(stretch.times);
  return change;
}

}  // namespace backlash::changes
