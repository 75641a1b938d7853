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

bool ChangeSearch::explained(const std::vector<FoundChange>& all) const {
  if (all.empty()) return !like_fault_;
  // So many at once are rather one change of another shape.
  if (all.size() >= static_cast<std::size_t>(settings_.most_changes)) return false;
  std::size_t from = blocks_;
  for (const FoundChange& f : all) from = std::min(from, f.from);
  const Background before = background({}), after = background(all);
  double rows = 0, rows_before = 0;
  const double left = left_after(after, from, blocks_, rows);
  const double squares = left_after(before, from, blocks_, rows);
  const double noise =
      std::max(left_after(after, 0, from, rows_before) / std::max(rows_before, 1.0), before.variance);
  return left - 2 * noise * rows < settings_.unknown_left * squares;
}

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
  Eigen::VectorXd expected = expected_squares(model_, motion_);
  // What was found before is known only as well as its shape.
  const Eigen::VectorXd beside = b.columns.middleCols(beside_column_, beside_columns_) *
                                 b.estimate.segment(beside_column_, beside_columns_);
  expected += (settings_.model_error * beside).cwiseAbs2();
  const Eigen::VectorXd squares = left.array().square() / expected.array();
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

std::optional<LoudStretch> ChangeSearch::louder(const std::vector<FoundChange>& all) const {
  Eigen::MatrixXd motion(motion_.size(), 5);
  for (Eigen::Index r = 0; r < motion_.size(); ++r) {
    const Moment& m = motion_.moment(r);
    motion.row(r) << m.position, m.position * m.position, std::fabs(m.speed), std::fabs(m.acceleration),
        std::sqrt(m.roughness);
  }
  return louder_stretch(times(), squares_over_healthy(all), motion, settings_);
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
