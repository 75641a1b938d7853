// SPDX-License-Identifier: BSD-3-Clause
#include "change_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "onset_threshold.h"

namespace backlash::changes {
namespace {

constexpr double kNone = 1e-9;  // of a spread

}  // namespace

ChangeSearch::ChangeSearch(const HealthyModel& model, const SampledMotion& motion,
                           std::vector<ChangeEffect> candidates, const HealthyScores& scores,
                           const std::vector<FoundChange>& beside, const ChangeSettings& settings,
                           const Progress& progress)
    : model_(model),
      motion_(motion),
      candidates_(std::move(candidates)),
      scores_(scores),
      screen_(motion),
      settings_(settings),
      progress_(progress),
      beside_(beside),
      first_(residual_of(model, motion, settings)),
      margin_(static_cast<std::size_t>(settings.margin / settings.block)),
      blocks_(static_cast<std::size_t>(motion.moments.back().time / settings.block) + 1) {
  beside_column_ = first_.nuisances.cols();
  const Background with = background(beside_);
  first_.nuisances = with.columns;
  first_.spread = with.spread;
  prepare_columns(motion_, candidates_);
}

Eigen::MatrixXd ChangeSearch::found_columns(const FoundChange& f) const {
  Eigen::MatrixXd z = *effect_columns(motion_, f.effect);
  const double from = settings_.block * double(f.from), to = settings_.block * double(f.to);
  if (f.effect.ramp) z = Eigen::MatrixXd(z.col(1) - from * z.col(0));
  for (Eigen::Index r = 0; r < z.rows(); ++r)
    if (motion_.time(r) < from || motion_.time(r) >= to) z.row(r).setZero();
  return z;
}

Background ChangeSearch::background(const std::vector<FoundChange>& others) const {
  Background b;
  b.residual = first_.residual;
  b.columns = first_.nuisances;
  b.spread = first_.spread;
  for (const FoundChange& f : others) b.add_unknown(found_columns(f));
  b.variance = noise_variance(model_, motion_);
  b.solve();
  return b;
}

std::vector<signal::Measured> ChangeSearch::beside(const std::vector<FoundChange>& found) const {
  const Background b = background(found);
  const double noisier = std::max(1.0, b.left().squaredNorm() / double(motion_.size()) / b.variance);
  std::vector<signal::Measured> all;
  for (Eigen::Index i = beside_column_; i < b.estimate.size(); ++i)
    all.push_back({b.estimate[i], std::sqrt(noisier * b.inverse(i, i))});
  return all;
}

std::size_t ChangeSearch::windows() const {
  std::size_t count = 0;
  double last = -settings_.window;
  for (Eigen::Index r = 0; r < motion_.size(); ++r)
    if (const double t = motion_.time(r); t - last >= settings_.window) {
      ++count;
      last = t;
    }
  return count;
}

double ChangeSearch::threshold(Eigen::Index values) const {
  const double hours = motion_.moments.back().time / 3600;
  const double effects = double(candidates_.size() + screen_.count());
  const double probability = std::clamp(settings_.false_alarms_per_hour * hours / effects, 1e-14, 0.1);
  const double fewest = double(margin_), most = double(windows()) * settings_.window / settings_.block;
  return gain_by_chance(probability, double(values), fewest, std::max(fewest, most));
}

double ChangeSearch::left_after(const Background& b, std::size_t from, std::size_t to, double& rows) const {
  const Eigen::VectorXd left = b.left();
  double squares = 0;
  rows = 0;
  for (Eigen::Index r = 0; r < motion_.size(); ++r) {
    const double t = motion_.time(r);
    if (t < settings_.block * double(from) || t >= settings_.block * double(to)) continue;
    squares += left[r] * left[r];
    ++rows;
  }
  return squares;
}

FoundChange ChangeSearch::scanned(const ChangeEffect& e, const Background& b, std::size_t step) const {
  FoundChange best{e, 0, blocks_, {}, 1, 0, {}};
  const EffectSums sums = sums_of(best, b);
  for (std::size_t k = margin_; k + margin_ < blocks_; k += step) {
    EffectSums::Score s = sums.score(k, blocks_, b);
    if (s.gain <= best.score.gain) continue;
    best.from = k;
    best.score = std::move(s);
  }
  refine_size(best, b);
  return best;
}

/// Whether `most` explains a good part of what `f` leaves.
bool ChangeSearch::leaves_more(const FoundChange& f, const FoundChange& most, const Background& b) const {
  const double more = most.score.gain - f.score.gain;
  if (more < settings_.distinguished * scores_.inflation(most.effect)) return false;
  double rows = 0;
  left_after(b, most.from, most.to, rows);
  const double left = (b.misfit() - f.score.gain) * rows / double(motion_.size());
  return more > settings_.least_explained * left;
}

std::optional<FoundChange> ChangeSearch::best(const Background& b) const {
  std::vector<FoundChange> all;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (progress_ && !progress_(double(i) / double(candidates_.size()), candidates_[i].name()))
      throw Cancelled();
    all.push_back(scanned(candidates_[i], b, 5));
  }
  const std::optional<FoundChange> fault = best_fault(b);
  if (fault) all.push_back(*fault);
  // Compared by what they explain: the inflation of one may be chance.
  const auto most = std::max_element(all.begin(), all.end(), [](const FoundChange& x, const FoundChange& y) {
    return x.score.gain < y.score.gain;
  });
  if (most == all.end() || most->score.values.size() == 0) return std::nullopt;
  // Of those that explain it alike the one with fewer values, unless more values explain what it leaves.
  const double alike = settings_.alike * most->score.gain;
  const FoundChange* simplest = &*most;
  for (const FoundChange& f : all)
    if (f.score.gain >= alike && f.score.values.size() > 0 &&
        f.effect.freedom() < simplest->effect.freedom() && !leaves_more(f, *most, b))
      simplest = &f;
  FoundChange found = *simplest;
  found.inflation = scores_.inflation(found.effect);
  found.gain = found.score.gain / found.inflation;
  // A weak change is distinguished from others by noise alone.
  const double as_likely =
      std::min(alike, most->score.gain - settings_.distinguished * scores_.inflation(most->effect));
  for (const FoundChange& f : all)
    if (f.score.gain >= as_likely && f.effect.id != found.effect.id) {
      const bool listed = std::find(found.alike.begin(), found.alike.end(), f.effect.id) != found.alike.end();
      if (!listed) found.alike.push_back(f.effect.id);
    }
  return found;
}

/// What `b` leaves, less the change as it was fitted.
Eigen::VectorXd ChangeSearch::left_with(const FoundChange& f, const Background& b) const {
  const Eigen::MatrixXd z = found_columns(f);
  const Eigen::VectorXd without = b.residual - z * f.score.values;
  return without - b.columns * (b.inverse * (b.columns.transpose() * without / b.variance));
}

/// Its values where friction may not wander beside it; none where the record does not determine them so.
Eigen::VectorXd ChangeSearch::values_without_wander(const FoundChange& f, const Background& b) const {
  Background steady = b;
  steady.spread.segment(first_.wander, first_.wanders).setConstant(kNone);
  steady.solve();
  return sums_of(f, steady).score(f.from, f.to, steady).values;
}

/// Whether friction that wanders has a part in it: then most of it is gone where friction may not.
bool ChangeSearch::needs_wander(const FoundChange& f, const Background& b) const {
  const Eigen::VectorXd &x = f.score.values, without = values_without_wander(f, b);
  return without.size() != x.size() || without.dot(x) < settings_.least_steadily * x.squaredNorm();
}

bool ChangeSearch::believed(const FoundChange& f, const Background& b) const {
  const double explained = f.score.gain * b.variance;
  if (motion_.sampling.channel == ChangeChannel::torque) {
    // Growth of friction that a healthy machine has.
    if (f.effect.ramp && f.score.gain < settings_.over_healthy * scores_.most_growth(f.effect)) return false;
    if (needs_wander(f, b)) return false;
  }
  double rows = 0;
  const double squares = f.effect.at_place() ? left_at(f, b.left(), rows) : left_after(b, f.from, f.to, rows);
  if (explained < settings_.least_explained * squares) return false;
  if (explained < rows * model_.least_change * model_.least_change) return false;
  // More noise than in the healthy records that follows the effect for a whole window lowers the gain.
  const double noise = score_inflation(motion_, left_with(f, b), *effect_columns(motion_, f.effect),
                                       b.variance, settings_.window);
  const bool one = model_.sampling.chain && model_.records->size() == 1;
  return f.score.gain / std::max(f.inflation, noise) >
         (one ? settings_.learned_from_one : 1) * threshold(f.score.values.size());
}

EffectSums::Score ChangeSearch::score_of(const Eigen::MatrixXd& columns, const FoundChange& f,
                                         const Background& b) const {
  return EffectSums(motion_, columns, b, settings_.block, false).score(f.from, f.to, b);
}

/// Another effect, or one of another shape, instead where that explains so many times as much.
bool ChangeSearch::take_better(FoundChange& f, const ChangeEffect& e, double times,
                               const Background& b) const {
  EffectSums::Score s = score_of(*effect_columns(motion_, e), f, b);
  if (s.gain <= times * f.score.gain) return false;
  f.effect = e;
  f.score = std::move(s);
  return true;
}

void ChangeSearch::refine_order(FoundChange& f, const Background& b) const {
  if (!f.effect.has_order()) return;
  const double least = f.effect.least_order();
  for (const double step : {0.1, 0.02}) {
    const double middle = f.effect.shape;
    for (int i = -5; i <= 5; ++i) {
      ChangeEffect e = f.effect;
      e.shape = middle + step * i;
      if (e.shape >= least) take_better(f, e, 1, b);
    }
  }
}

EffectSums ChangeSearch::sums_of(const FoundChange& f, const Background& b) const {
  return EffectSums(motion_, *effect_columns(motion_, f.effect), b, settings_.block, f.effect.ramp);
}

void ChangeSearch::refine(FoundChange& f, const Background& b) const {
  if (f.effect.at_place()) refine_fault(f, b);
  if (f.effect.has_scale()) refine_scale(f, b);
  refine_size(f, b);
  refine_order(f, b);
  refine_onset(f, sums_of(f, b), b);
  f.gain = f.score.gain / f.inflation;
}

/// A payload has inertia as well: where the record shows it, gravity alone would get a wrong size.
void ChangeSearch::add_inertia(FoundChange& f, const Background& b) const {
  const std::optional<ChangeEffect> e = with_inertia(f.effect);
  if (!e) return;
  EffectSums::Score s = score_of(*effect_columns(motion_, *e), f, b);
  if (s.values.size() == 0 || s.gain < f.score.gain + settings_.onset_drop * f.inflation) return;
  f.effect = *e;
  f.score = std::move(s);
  f.gain = f.score.gain / f.inflation;
}

/// The record as a whole has another value of the effect: a nuisance from then on, and a difference where no
/// healthy record has it, too.
void ChangeSearch::differ(FoundChange f) {
  if (!scores_.is_healthy(f.effect, f.score, f.inflation, threshold(f.score.values.size()), lasting_))
    different_.push_back(f.effect.name());
  lasting_.push_back(f.effect);
  f.from = 0;
  f.to = blocks_ + 1;
  const Background with = background({f});
  first_.nuisances = with.columns;
  first_.spread = with.spread;
}

/// A change of its own, not what the shape of an earlier one leaves, of this joint or of its chain.
bool ChangeSearch::further(const FoundChange& next, const std::vector<FoundChange>& found) const {
  const auto leaves_it = [&](const FoundChange& f) {
    const double apart = std::fabs(double(next.from) - double(f.from)) * settings_.block;
    return apart < settings_.same_event && next.gain < settings_.least_beside * f.gain;
  };
  return std::none_of(found.begin(), found.end(), leaves_it) &&
         std::none_of(beside_.begin(), beside_.end(), leaves_it);
}

/// A change that a later one takes back (same effect, opposite value) is one change with an end.
void ChangeSearch::unite(std::vector<FoundChange>& found) const {
  for (FoundChange& f : found)
    for (auto later = found.begin(); later != found.end(); ++later) {
      const bool same = f.effect.name() == later->effect.name() && !f.effect.ramp &&
                        f.score.values.size() == later->score.values.size();
      if (!same || f.from >= later->from || f.to <= later->from) continue;
      if ((f.score.values + later->score.values).norm() > settings_.undone * f.score.values.norm()) continue;
      f.to = later->from;
      found.erase(later);
      return;
    }
}

std::optional<FoundChange> ChangeSearch::next(const std::vector<FoundChange>& found) {
  left_by_shape_.reset();
  for (int k = 0; k < settings_.most_changes; ++k) {
    const Background b = background(found);
    std::optional<FoundChange> next = best(b);
    if (!next) return std::nullopt;
    refine(*next, b);
    if (!believed(*next, b)) return std::nullopt;
    if (begins_before(*next, b)) {
      differ(*next);
      continue;
    }
    if (next->effect.at_place() && !alone(*next, b)) {
      like_fault_ = found.empty();
      return std::nullopt;
    }
    if (!further(*next, found)) {
      left_by_shape_ = std::move(next);
      return std::nullopt;
    }
    add_inertia(*next, b);
    find_end(*next, b);
    return next;
  }
  return std::nullopt;
}

void ChangeSearch::add(FoundChange next, std::vector<FoundChange>& found) const {
  found.push_back(std::move(next));
  // Each is estimated anew beside the others.
  for (std::size_t i = 0; found.size() > 1 && i < found.size(); ++i) {
    std::vector<FoundChange> others = found;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    refine(found[i], background(others));
  }
  unite(found);
}

std::vector<FoundChange> ChangeSearch::run() {
  std::vector<FoundChange> found;
  for (int k = 0; k < settings_.most_changes; ++k) {
    std::optional<FoundChange> one = next(found);
    if (!one) break;
    add(std::move(*one), found);
  }
  return found;
}

Change ChangeSearch::change_of(const FoundChange& f, const std::vector<FoundChange>& all, bool linear) const {
  std::vector<FoundChange> others;
  for (const FoundChange& o : all)
    if (o.from != f.from || o.effect.name() != f.effect.name()) others.push_back(o);
  const Background b = background(others), with = background(all);
  Change change;
  change.effect = f.effect.id;
  change.alike = f.alike;
  if (f.effect.type && !f.effect.ramp)
    for (const std::string& other : model::looks_like(*f.effect.type)) change.alike.push_back(other);
  change.gain = f.gain;
  onset_interval(f, sums_of(f, b), b, change);
  onset_with_left(f, b, change);
  if (f.to < blocks_) change.until = motion_.start + settings_.block * double(f.to);
  double rows = 0;
  change.error_before = std::sqrt(left_after(b, f.from, f.to, rows) / std::max(rows, 1.0));
  const double after = left_after(with, f.from, f.to, rows) / std::max(rows, 1.0);
  change.error_after = std::sqrt(after);
  Eigen::VectorXd values = f.score.values;
  Eigen::MatrixXd covariance = f.score.covariance * f.inflation * std::max(1.0, after / b.variance);
  // The wander of friction is not known either.
  if (const Eigen::VectorXd without = values_without_wander(f, b); without.size() == values.size())
    covariance.diagonal() += (without - values).cwiseAbs2();
  const Eigen::Index wave = std::min<Eigen::Index>(values.size(), 2);
  covariance.diagonal().head(wave).array() += std::pow(settings_.model_error * values.head(wave).norm(), 2);
  for (Eigen::Index i = wave; i < values.size(); ++i)
    covariance(i, i) += std::pow(settings_.model_error * values[i], 2);
  const double span = settings_.block * double(f.to - f.from);
  if (f.effect.ramp) {
    values *= span;
    covariance *= span * span;
  }
  change.size = f.effect.at_place()    ? fault_size(f, b, with.left(), linear)
                : f.effect.has_scale() ? scaled_size(f, b, after / b.variance, linear)
                                       : change_size(f.effect, values, covariance, linear);
  if (f.effect.ramp) change.size.push_back({"span", "s", {span, settings_.block}});
  return change;
}

}  // namespace backlash::changes
