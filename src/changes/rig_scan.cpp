// SPDX-License-Identifier: BSD-3-Clause
#include "rig_scan.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "onset_threshold.h"

namespace backlash::changes {
namespace {

constexpr int kShapes = 2;                  // step and ramp share the false alarms with the values
constexpr int kRampOnsets = 48;             // Choice: the onset of a growth is no sharper
constexpr double kLeastInformation = 1e-9;  // - of its information that a change must have for itself. Choice
constexpr std::size_t kFewestAfter = 2, kFewestBefore = 2;  // stretches. Choice: one may be odd

}  // namespace

/// Nuisances: the record's values, then the changes that were found.
struct RigScan::Beside {
  std::vector<RigChange> changes;
  Eigen::MatrixXd inverse;
  Eigen::VectorXd estimate;
};

/// Of a change of all values of one shape, the nuisances eliminated.
struct RigScan::Sums {
  Eigen::VectorXd score;
  Eigen::MatrixXd information;
};

RigScan::RigScan(const HealthyRig& rig, std::vector<FittedStretch> stretches, double probability,
                 const ChangeSettings& settings)
    : rig_(rig), stretches_(std::move(stretches)), settings_(settings), probability_(probability) {
  const double each = std::clamp(probability / (kShapes * double(rig.effects.size())), 1e-14, 0.1);
  threshold_ = gain_by_chance(each, 1, 1, std::max(2.0, double(stretches_.size())));
}

RigScan::Beside RigScan::system(const std::vector<RigChange>& beside) const {
  const auto values = rig_.day.size(), count = values + static_cast<Eigen::Index>(beside.size());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd score = Eigen::VectorXd::Zero(count);
  all.topLeftCorner(values, values) = rig_.day.cwiseInverse().asDiagonal();
  Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(values, count);  // what a nuisance moves, of each stretch
  shape.leftCols(values).setIdentity();
  for (const FittedStretch& s : stretches_) {
    for (std::size_t i = 0; i < beside.size(); ++i)
      shape.col(values + static_cast<Eigen::Index>(i)) =
          beside[i].shape.weight(s.at, end()) * rig_.effects[beside[i].effect].direction;
    const Eigen::MatrixXd moved = signal::product(s.information, shape);
    all += signal::transposed_product(shape, moved);
    score += shape.transpose() * (s.score - s.information * rig_.mean);
  }
  Beside out;
  out.changes = beside;
  out.inverse = signal::symmetric_inverse(all);
  out.estimate = out.inverse * score;
  return out;
}

RigScan::Sums RigScan::sums(const RigShape& shape, const Beside& beside) const {
  const auto values = rig_.day.size(), count = beside.estimate.size();
  Sums out{Eigen::VectorXd::Zero(values), Eigen::MatrixXd::Zero(values, values)};
  Eigen::MatrixXd mixed = Eigen::MatrixXd::Zero(count, values);
  for (const FittedStretch& s : stretches_) {
    const double h = shape.weight(s.at, end());
    if (h == 0) continue;
    out.score += h * (s.score - s.information * rig_.mean);
    out.information += h * h * s.information;
    mixed.topRows(values) += h * s.information;
    for (std::size_t i = 0; i < beside.changes.size(); ++i)
      mixed.row(values + static_cast<Eigen::Index>(i)) +=
          h * beside.changes[i].shape.weight(s.at, end()) *
          (s.information * rig_.effects[beside.changes[i].effect].direction).transpose();
  }
  out.score -= mixed.transpose() * beside.estimate;
  out.information -= signal::transposed_product(mixed, signal::product(beside.inverse, mixed));
  return out;
}

RigChange RigScan::of(std::size_t effect, const RigShape& shape, const Sums& sums) const {
  const RigEffect& e = rig_.effects[effect];
  RigChange change;
  change.effect = effect, change.shape = shape;
  const double information = e.direction.dot(sums.information * e.direction);
  // Of what the record does not show there is nothing to score.
  if (!(information * e.least * e.least > kLeastInformation)) return change;
  change.size = e.direction.dot(sums.score) / information;
  change.variance = e.inflation / information;
  change.gain = change.size * change.size / change.variance;
  return change;
}

RigChange RigScan::scored(std::size_t effect, const RigShape& shape,
                          const std::vector<RigChange>& beside) const {
  return of(effect, shape, sums(shape, system(beside)));
}

double RigScan::all_gain(const RigShape& shape, const std::vector<RigChange>& beside) const {
  const Sums s = sums(shape, system(beside));
  return gain_of_all(s.score, s.information);
}

std::vector<RigShape> RigScan::shapes() const {
  std::vector<RigShape> all;
  for (std::size_t i = kFewestBefore; i + kFewestAfter <= stretches_.size(); ++i) {
    RigShape step;
    step.since = (stretches_[i - 1].at.middle() + stretches_[i].at.middle()) / 2;
    all.push_back(step);
  }
  const double first = stretches_[kFewestBefore - 1].at.middle();
  const double last = stretches_[stretches_.size() - kFewestAfter - 1].at.middle();
  for (int i = 0; i < kRampOnsets; ++i) {
    RigShape ramp;
    ramp.ramp = true, ramp.since = first + (last - first) * i / kRampOnsets;
    all.push_back(ramp);
  }
  return all;
}

bool RigScan::believed(const RigChange& change) const {
  return change.gain > threshold_ && std::fabs(change.size) > rig_.effects[change.effect].least;
}

std::optional<RigChange> RigScan::best(const std::vector<RigChange>& beside) const {
  std::optional<RigChange> found;
  const Beside nuisances = system(beside);
  for (const RigShape& shape : shapes()) {
    const Sums s = sums(shape, nuisances);
    for (std::size_t v = 0; v < rig_.effects.size(); ++v) {
      const RigChange change = of(v, shape, s);
      if (believed(change) && (!found || change.gain > found->gain)) found = change;
    }
  }
  return found;
}

/// A step may be undone.
void RigScan::find_end(RigChange& change, const std::vector<RigChange>& beside) const {
  if (change.shape.ramp) return;
  const Beside nuisances = system(beside);
  RigChange best = change;
  const auto look = [&](const RigShape& shape) {
    const RigChange next = of(change.effect, shape, sums(shape, nuisances));
    if (next.gain > best.gain && believed(next)) best = next;
  };
  const double enough = change.gain + threshold_;
  for (int pass = 0; pass < 2; ++pass)  // the end, then the onset with it, then the end again
    for (const bool move_end : {true, false}) {
      const RigShape now = best.shape;
      for (const RigShape& s : shapes()) {
        if (s.ramp) continue;
        RigShape shape = now;
        (move_end ? shape.until : shape.since) = s.since;
        if (shape.since < shape.until) look(shape);
      }
    }
  if (best.gain < enough) best = change;
  change = best;
}

std::vector<RigChange> RigScan::Found::all() const {
  std::vector<RigChange> out = different;
  out.insert(out.end(), changes.begin(), changes.end());
  return out;
}

std::vector<RigChange> RigScan::Found::beside(std::size_t but) const {
  std::vector<RigChange> out = all();
  out.erase(out.begin() + static_cast<std::ptrdiff_t>(different.size() + but));
  return out;
}

/// Whether an onset, or an end, is of the same event as another.
bool RigScan::near(double onset, const std::vector<RigChange>& changes) const {
  return std::any_of(changes.begin(), changes.end(), [&](const RigChange& c) {
    for (const double t : {c.shape.since, c.shape.until})
      if (onset >= before(t).at.from - settings_.same_event && onset <= after(t).at.to + settings_.same_event)
        return true;
    return false;
  });
}

/// A step that a later one takes back is one change with an end.
void RigScan::unite(Found& found) const {
  std::vector<RigChange>& all = found.changes;
  const auto open = [](const RigChange& c) { return !c.shape.ramp && std::isinf(c.shape.until); };
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (i == k || all[i].effect != all[k].effect || !open(all[i]) || !open(all[k])) continue;
      if (all[k].shape.since < all[i].shape.since ||
          std::fabs(all[i].size + all[k].size) > settings_.undone * std::fabs(all[i].size))
        continue;
      all[i].shape.until = all[k].shape.since;
      const RigShape shape = all[i].shape;
      const std::size_t effect = all[i].effect, place = k > i ? i : i - 1;
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(k));
      all[place] = scored(effect, shape, found.beside(place));
      return;
    }
}

RigScan::Found RigScan::run() const {
  Found found;
  for (int i = 0; i < settings_.most_changes; ++i) {
    std::optional<RigChange> next = best(found.all());
    if (!next) break;
    RigShape whole;
    whole.since = -std::numeric_limits<double>::infinity();
    const RigChange always = scored(next->effect, whole, found.all());
    if (always.gain > next->gain - settings_.onset_drop) {
      found.different.push_back(always);
      continue;
    }
    find_end(*next, found.all());
    // What is left about the onset of another one is of the same event: whether that one explains it is asked
    // elsewhere.
    if (near(next->shape.since, found.changes)) break;
    found.changes.push_back(*next);
    for (std::size_t k = 0; found.changes.size() > 1 && k < found.changes.size(); ++k)
      found.changes[k] = scored(found.changes[k].effect, found.changes[k].shape, found.beside(k));
    unite(found);
  }
  return found;
}

std::optional<RigShape> RigScan::unexplained(const Found& found) const {
  const auto values = static_cast<double>(rig_.values.size());
  const double most = rig_.inflation_of_all * gain_by_chance(std::clamp(probability_, 1e-14, 0.1), values, 1,
                                                             std::max(2.0, double(stretches_.size())));
  std::optional<RigShape> worst;
  double largest = most;
  for (const RigShape& shape : shapes()) {
    if (shape.ramp || near(shape.since, found.changes)) continue;
    const double gain = all_gain(shape, found.all());
    if (gain > largest) largest = gain, worst = shape;
  }
  return worst;
}

Stretch RigScan::onset_interval(const RigChange& change, const std::vector<RigChange>& beside) const {
  const Beside nuisances = system(beside);
  const double drop = settings_.onset_drop;
  Stretch out{before(change.shape.since).at.from, after(change.shape.since).at.to};
  if (change.shape.ramp) {
    const double grid = (after(change.shape.since).at.middle() - before(change.shape.since).at.middle());
    out = {change.shape.since - grid / 2, change.shape.since + grid / 2};
  }
  for (RigShape shape : shapes()) {
    if (shape.ramp != change.shape.ramp || shape.since >= change.shape.until) continue;
    shape.until = change.shape.until;
    if (of(change.effect, shape, sums(shape, nuisances)).gain < change.gain - drop) continue;
    out.from = std::min(out.from, shape.ramp ? shape.since : before(shape.since).at.from);
    out.to = std::max(out.to, shape.ramp ? shape.since : after(shape.since).at.to);
  }
  return out;
}

const FittedStretch& RigScan::before(double time) const {
  const FittedStretch* last = &stretches_.front();
  for (const FittedStretch& s : stretches_)
    if (s.at.middle() < time) last = &s;
  return *last;
}

const FittedStretch& RigScan::after(double time) const {
  for (const FittedStretch& s : stretches_)
    if (s.at.middle() >= time) return s;
  return stretches_.back();
}

}  // namespace backlash::changes
