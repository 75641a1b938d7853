// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/changes/changes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "change_scan.h"

namespace backlash::identification {
namespace {

struct FoundChange {
  ChangeEffect effect;
  std::size_t from = 0, to = 0;  // blocks
  EffectSums::Score score;
  double inflation = 1, gain = 0;
  std::vector<std::string> alike;
};

struct ScannedEffect {
  ChangeEffect effect;
  double inflation = 1;
};

/// One channel of a record against a healthy machine.
class ChangeSearch {
 public:
  /// `beside`: changes that another channel shows, of which this one may show any share.
  ChangeSearch(const HealthyModel& model, const SampledMotion& motion, std::vector<ScannedEffect> candidates,
               const std::vector<FoundChange>& beside, const ChangeSettings& settings,
               const Progress& progress)
      : model_(model),
        motion_(motion),
        candidates_(std::move(candidates)),
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
  }

  std::vector<FoundChange> run();
  double threshold(Eigen::Index values) const;
  std::size_t windows() const;
  Change told(const FoundChange& found, const std::vector<FoundChange>& all, bool linear) const;
  bool explained(const std::vector<FoundChange>& all) const;
  std::optional<Change> louder() const;
  const std::vector<std::string>& different() const { return different_; }
  /// Values of the columns that stand beside, `found` being so.
  std::vector<signal::Measured> beside(const std::vector<FoundChange>& found) const;

 private:
  Background background(const std::vector<FoundChange>& others) const;
  Eigen::MatrixXd found_columns(const FoundChange& f) const;
  std::optional<FoundChange> best(const Background& b) const;
  FoundChange scanned(const ScannedEffect& c, const Background& b, std::size_t step) const;
  bool believed(const FoundChange& f, const Background& b) const;
  bool begins_before(const FoundChange& f, const Background& b) const;
  void differ(FoundChange f);
  bool further(const FoundChange& next, const std::vector<FoundChange>& found) const;
  void refine(FoundChange& f, const Background& b) const;
  void refine_order(FoundChange& f, const Background& b) const;
  void find_end(FoundChange& f, const Background& b) const;
  void unite(std::vector<FoundChange>& found) const;
  void onset_interval(const FoundChange& f, const Background& b, Change& change) const;
  double left_after(const Background& b, std::size_t from, std::size_t to, double& rows) const;

  const HealthyModel& model_;
  const SampledMotion& motion_;
  const std::vector<ScannedEffect> candidates_;
  const ChangeSettings& settings_;
  const Progress& progress_;
  const std::vector<FoundChange> beside_;
  Whitened first_;
  Eigen::Index beside_column_ = 0;      // the first of what stands beside
  std::vector<std::string> different_;  // effects that the record has from its beginning
  const std::size_t margin_, blocks_;
};

Eigen::MatrixXd ChangeSearch::found_columns(const FoundChange& f) const {
  Eigen::MatrixXd z = effect_columns(motion_, f.effect);
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
  for (const FoundChange& f : others) {
    const Eigen::MatrixXd z = found_columns(f);
    const Eigen::Index p = b.columns.cols();
    b.columns.conservativeResize(Eigen::NoChange, p + z.cols());
    b.columns.rightCols(z.cols()) = z;
    b.spread.conservativeResize(p + z.cols());
    b.spread.tail(z.cols()).setConstant(std::numeric_limits<double>::infinity());
  }
  b.variance = model_.noise * model_.noise;
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
  const double p = settings_.false_alarms_per_hour * hours /
                   (double(candidates_.size()) * double(std::max<std::size_t>(windows(), 1)));
  return signal::chi_square_quantile(1 - std::clamp(p, 1e-14, 0.5), double(values));
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

FoundChange ChangeSearch::scanned(const ScannedEffect& c, const Background& b, std::size_t step) const {
  FoundChange best{c.effect, 0, blocks_, {}, c.inflation, 0, {}};
  const EffectSums sums(motion_, effect_columns(motion_, c.effect), b, settings_.block, c.effect.ramp);
  for (std::size_t k = margin_; k + margin_ < blocks_; k += step) {
    EffectSums::Score s = sums.score(k, blocks_, b);
    if (s.gain / c.inflation <= best.gain) continue;
    best.from = k;
    best.gain = s.gain / c.inflation;
    best.score = std::move(s);
  }
  return best;
}

std::optional<FoundChange> ChangeSearch::best(const Background& b) const {
  std::vector<FoundChange> all;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (progress_ && !progress_(double(i) / double(candidates_.size()), candidates_[i].effect.name()))
      throw Cancelled();
    all.push_back(scanned(candidates_[i], b, 5));
  }
  // By what they explain: the inflation of one may be chance.
  const auto most = std::max_element(all.begin(), all.end(), [](const FoundChange& x, const FoundChange& y) {
    return x.score.gain < y.score.gain;
  });
  if (most == all.end() || most->score.values.size() == 0) return std::nullopt;
  // Of those that explain it alike one with fewer values.
  const double alike = settings_.alike * most->score.gain;
  const FoundChange* simplest = &*most;
  for (const FoundChange& f : all)
    if (f.score.gain >= alike && f.score.values.size() > 0 &&
        f.score.values.size() < simplest->score.values.size())
      simplest = &f;
  FoundChange found = *simplest;
  for (const FoundChange& f : all)
    if (f.score.gain >= alike && f.effect.id != found.effect.id) {
      const bool told = std::find(found.alike.begin(), found.alike.end(), f.effect.id) != found.alike.end();
      if (!told) found.alike.push_back(f.effect.id);
    }
  return found;
}

bool ChangeSearch::believed(const FoundChange& f, const Background& b) const {
  double rows = 0;
  const double squares = left_after(b, f.from, f.to, rows), explained = f.score.gain * b.variance;
  if (explained < settings_.least_explained * squares) return false;
  if (explained < rows * model_.least_change * model_.least_change) return false;
  // More noise than in the healthy records counts against it.
  const double all = b.left().squaredNorm(), left = std::max(all - explained, 0.0);
  const double noisier = std::max(1.0, left / double(motion_.size()) / b.variance);
  return f.gain / noisier > threshold(f.score.values.size());
}

void ChangeSearch::refine_order(FoundChange& f, const Background& b) const {
  if (!f.effect.has_order()) return;
  const double least = f.effect.least_order();
  for (const double step : {0.1, 0.02}) {
    const double middle = f.effect.shape;
    for (int i = -5; i <= 5; ++i) {
      ChangeEffect e = f.effect;
      e.shape = middle + step * i;
      if (e.shape < least) continue;
      const EffectSums sums(motion_, effect_columns(motion_, e), b, settings_.block, false);
      EffectSums::Score s = sums.score(f.from, f.to, b);
      if (s.gain <= f.score.gain) continue;
      f.effect = e;
      f.score = std::move(s);
    }
  }
}

void ChangeSearch::refine(FoundChange& f, const Background& b) const {
  refine_order(f, b);
  const EffectSums sums(motion_, effect_columns(motion_, f.effect), b, settings_.block, f.effect.ramp);
  f.score = sums.score(f.from, f.to, b);
  for (std::size_t k = margin_; k + margin_ / 2 < f.to; ++k) {
    EffectSums::Score s = sums.score(k, f.to, b);
    if (s.gain <= f.score.gain) continue;
    f.from = k;
    f.score = std::move(s);
  }
  f.gain = f.score.gain / f.inflation;
}

/// An end, where the record with it is told clearly better.
void ChangeSearch::find_end(FoundChange& f, const Background& b) const {
  const EffectSums sums(motion_, effect_columns(motion_, f.effect), b, settings_.block, f.effect.ramp);
  FoundChange ended = f;
  for (int round = 0; round < 3; ++round) {
    for (std::size_t k = ended.from + margin_ / 2; k + margin_ / 2 < blocks_; ++k) {
      EffectSums::Score s = sums.score(ended.from, k, b);
      if (s.gain <= ended.score.gain) continue;
      ended.to = k;
      ended.score = std::move(s);
    }
    if (ended.to == f.to) return;
    refine(ended, b);
  }
  const double more = (ended.score.gain - f.score.gain) / f.inflation;
  if (more > threshold(1) && ended.score.gain > (1 + 5 * settings_.least_further) * f.score.gain) f = ended;
}

/// Whether it may have begun before the record did.
bool ChangeSearch::begins_before(const FoundChange& f, const Background& b) const {
  Change change;
  onset_interval(f, b, change);
  return change.since_from <= motion_.start;
}

/// The record as a whole has another value of the effect: a nuisance from then on.
void ChangeSearch::differ(FoundChange f) {
  different_.push_back(f.effect.name());
  f.from = 0;
  f.to = blocks_ + 1;
  const Background with = background({f});
  first_.nuisances = with.columns;
  first_.spread = with.spread;
}

/// A change of its own, not what the shape of an earlier one leaves.
bool ChangeSearch::further(const FoundChange& next, const std::vector<FoundChange>& found) const {
  for (const FoundChange& f : found) {
    const double apart = std::fabs(double(next.from) - double(f.from)) * settings_.block;
    const double least = apart < settings_.same_event ? settings_.least_beside : settings_.least_further;
    if (next.gain < least * f.gain) return false;
  }
  return std::none_of(beside_.begin(), beside_.end(), [&](const FoundChange& f) {
    const double apart = std::fabs(double(next.from) - double(f.from)) * settings_.block;
    return apart < settings_.same_event && next.gain < settings_.least_with_other * f.gain;
  });
}

/// A change that another takes back later, the same effect with the opposite value, is one with an end.
void ChangeSearch::unite(std::vector<FoundChange>& found) const {
  for (FoundChange& f : found)
    for (auto later = found.begin(); later != found.end(); ++later) {
      const bool same = f.effect.name() == later->effect.name() && !f.effect.ramp;
      if (!same || f.from >= later->from || f.to <= later->from) continue;
      if ((f.score.values + later->score.values).norm() > settings_.undone * f.score.values.norm()) continue;
      f.to = later->from;
      found.erase(later);
      return;
    }
}

std::vector<FoundChange> ChangeSearch::run() {
  std::vector<FoundChange> found;
  for (int k = 0; k < settings_.most_changes; ++k) {
    const Background b = background(found);
    std::optional<FoundChange> next = best(b);
    if (!next) break;
    refine(*next, b);
    if (!believed(*next, b)) break;
    if (begins_before(*next, b)) {
      differ(*next);
      continue;
    }
    if (!further(*next, found)) break;
    find_end(*next, b);
    found.push_back(*next);
    // Each anew beside the others.
    for (std::size_t i = 0; found.size() > 1 && i < found.size(); ++i) {
      std::vector<FoundChange> others = found;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      refine(found[i], background(others));
    }
    unite(found);
  }
  return found;
}

bool ChangeSearch::explained(const std::vector<FoundChange>& all) const {
  if (all.empty()) return true;
  // So many at once are rather one of another shape.
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

/// A residual that grows and follows no effect.
std::optional<Change> ChangeSearch::louder() const {
  const Eigen::VectorXd left = background({}).left();
  std::vector<double> begin, squares, rows;  // of windows
  for (Eigen::Index r = 0; r < left.size(); ++r) {
    if (begin.empty() || motion_.time(r) - begin.back() >= settings_.window) {
      begin.push_back(motion_.time(r));
      squares.push_back(0);
      rows.push_back(0);
    }
    squares.back() += left[r] * left[r];
    ++rows.back();
  }
  const double total = left.squaredNorm(), count = double(left.size());
  double before = 0, rows_before = 0, most = 0;
  std::optional<Change> change;
  for (std::size_t k = 1; k + 1 < begin.size(); ++k) {
    before += squares[k - 1];
    rows_before += rows[k - 1];
    const double a = before / rows_before, b = (total - before) / (count - rows_before);
    // Twice the log likelihood ratio of another variance from here on.
    const double gain =
        count * std::log(total / count) - rows_before * std::log(a) - (count - rows_before) * std::log(b);
    if (begin[k] < settings_.margin || gain <= most) continue;
    most = gain;
    change.reset();
    if (b < settings_.unknown_louder * std::max(a, model_.noise * model_.noise)) continue;
    change.emplace();
    change->effect = "unknown";
    change->gain = gain;
    change->since = motion_.start + begin[k];
    change->since_from = change->since - settings_.window;
    change->since_to = change->since + settings_.window;
    change->error_before = change->error_after = std::sqrt(b);
  }
  return change;
}

void ChangeSearch::onset_interval(const FoundChange& f, const Background& b, Change& change) const {
  const EffectSums sums(motion_, effect_columns(motion_, f.effect), b, settings_.block, f.effect.ramp);
  double rows = 0;
  // What the shape of the effect leaves widens it like noise.
  const double squares = left_after(b, f.from, f.to, rows) - f.score.gain * b.variance;
  const double noisier = std::max(1.0, squares / std::max(rows, 1.0) / b.variance);
  const double drop = settings_.onset_drop * f.inflation * noisier;
  std::size_t low = f.from, high = f.from;
  for (std::size_t k = 0; k < f.to; ++k) {
    if (sums.score(k, f.to, b).gain < f.score.gain - drop) continue;
    low = std::min(low, k);
    high = std::max(high, k);
  }
  if (low <= margin_) low = 0;
  const double since = settings_.block * double(f.from);
  change.since = motion_.start + since;
  change.since_from =
      motion_.start + std::max(0.0, settings_.block * double(low) - settings_.block - settings_.onset_least);
  change.since_to = motion_.start + settings_.block * double(high) + settings_.block + settings_.onset_least;
}

Change ChangeSearch::told(const FoundChange& f, const std::vector<FoundChange>& all, bool linear) const {
  std::vector<FoundChange> others;
  for (const FoundChange& o : all)
    if (o.from != f.from || o.effect.name() != f.effect.name()) others.push_back(o);
  const Background b = background(others), with = background(all);
  Change change;
  change.effect = f.effect.id;
  change.alike = f.alike;
  change.gain = f.gain;
  onset_interval(f, b, change);
  // Changes of one event hold each other's onset.
  for (const FoundChange& o : others)
    if (std::fabs(double(o.from) - double(f.from)) * settings_.block < settings_.same_event) {
      change.since_from -= settings_.same_event / 2;
      change.since_to += settings_.same_event / 2;
      break;
    }
  if (f.to < blocks_) change.until = motion_.start + settings_.block * double(f.to);
  double rows = 0;
  change.error_before = std::sqrt(left_after(b, f.from, f.to, rows) / std::max(rows, 1.0));
  const double after = left_after(with, f.from, f.to, rows) / std::max(rows, 1.0);
  change.error_after = std::sqrt(after);
  Eigen::VectorXd values = f.score.values;
  Eigen::MatrixXd covariance = f.score.covariance * f.inflation * std::max(1.0, after / b.variance);
  covariance.diagonal().array() += std::pow(settings_.model_error * values.norm(), 2);
  const double span = settings_.block * double(f.to - f.from);
  if (f.effect.ramp) {
    values *= span;
    covariance *= span * span;
  }
  change.size = change_size(f.effect, values, covariance, linear);
  if (f.effect.ramp) change.size.push_back({"span", "s", {span, settings_.block}});
  return change;
}

/// What one channel shows.
struct ChannelChanges {
  std::vector<FoundChange> found;
  std::vector<signal::Measured> beside;  // columns of what stood beside
  Changes told;
};

std::vector<ScannedEffect> candidates_of(const HealthyModel& model,
                                         const std::vector<record::Record>& healthy,
                                         const ChangeSettings& settings) {
  std::vector<ScannedEffect> all;
  for (const ChangeEffect& e : change_effects(model.sampling)) all.push_back({e, 1});
  for (const record::Record& r : healthy) {
    const SampledMotion motion = motion_by(model, r, settings);
    const Eigen::VectorXd residual = residual_of(model, motion, settings).residual;
    for (ScannedEffect& c : all)
      c.inflation = std::max(c.inflation, score_inflation(motion, residual, effect_columns(motion, c.effect),
                                                          model.noise * model.noise, settings.window));
  }
  return all;
}

/// What the load of the teeth may be other by: what the motor's torque shows, on whichever side of the gap.
std::function<double(const Moment&)> other_load(const std::vector<FoundChange>& changes, double block) {
  if (changes.empty()) return {};
  return [changes, block](const Moment& m) {
    double sum = 0;
    for (const FoundChange& f : changes) {
      if (m.time < block * double(f.from) || m.time >= block * double(f.to)) continue;
      if (f.effect.ramp)
        sum += f.score.values[0] * f.effect.columns[0](m, f.effect.shape) * (m.time - block * double(f.from));
      for (std::size_t i = 0; !f.effect.ramp && i < f.effect.columns.size(); ++i)
        sum += f.score.values[static_cast<Eigen::Index>(i)] * f.effect.columns[i](m, f.effect.shape);
    }
    return sum;
  };
}

ChannelChanges changes_in(const HealthyModel& model, const std::vector<record::Record>& healthy,
                          const record::Record& record, const std::vector<FoundChange>& beside, bool linear,
                          const ChangeSettings& settings, const Progress& progress) {
  HealthyModel of_record = model;
  of_record.sampling.other_load = other_load(beside, settings.block);
  const SampledMotion motion = motion_by(of_record, record, settings);
  ChangeSearch search(model, motion, candidates_of(model, healthy, settings), beside, settings, progress);
  ChannelChanges result;
  const std::vector<FoundChange>& found = result.found = search.run();
  result.beside = search.beside(found);
  Changes& out = result.told;
  out.windows = search.windows();
  out.threshold = search.threshold(1);
  out.noise = model.noise;
  for (const ChangeEffect& e : model.further) out.healthy_terms.push_back(e.name());
  for (const FoundChange& f : found) out.changes.push_back(search.told(f, found, linear));
  if (found.empty())
    if (const auto change = search.louder()) out.changes.push_back(*change);
  if (!search.explained(found)) {
    std::vector<std::string> nearest;
    for (const Change& c : out.changes) nearest.push_back(c.effect);
    out.changes.clear();
    if (std::optional<Change> unknown = search.louder()) {
      unknown->alike = nearest;
      out.changes.push_back(*unknown);
    } else {
      out.warnings.push_back(
          "the record differs from the healthy ones in a way that no effect explains (nearest: " +
          joined(nearest) + "): commission with more motion of this kind");
    }
  }
  out.different = search.different();
  for (const std::string& name : search.different())
    out.warnings.push_back("from its beginning the record differs from the healthy ones by " + name +
                           ": that is no change within it");
  return result;
}

/// The share of its inertia that is behind the gap. Throws CannotIdentify for what is not of two inertias.
double share_behind(const model::Rig& rig) {
  if (!model::has_two_inertias(rig))
    throw CannotIdentify(
        "changes are told of machines of one inertia (mesh: rigid) and of two (rigid couplings, a free "
        "link)");
  if (rig.motor_side && rig.reduction_ratio != 1)
    throw CannotIdentify("changes of two inertias are told from records at the load's side of the reduction");
  const double behind = rig.gear.inertia + rig.output_coupling.inertia + rig.link.inertia;
  return behind / (rig.motor.inertia + rig.input_coupling.inertia + rig.pinion.inertia + behind);
}

/// On which side of the gap friction is that the motor's torque shows as another: behind it, it loads the
/// teeth and deflects them by `compliance`. 1: behind, 0: before; NaN: not told.
double side_of(const signal::Measured& torque, const signal::Measured& deflection, double compliance,
               const ChangeSettings& settings) {
  const double all = compliance * torque.value, share = deflection.value / all;
  const double error = settings.errors_of_side * std::fabs(deflection.standard_error / all);
  const double side = share > 0.5 ? 1 : 0;
  return std::fabs(share - side) + error < settings.worst_side ? side : kNaN;
}

/// Names friction by its side of the gap; where that is not told, both are named.
void tell_sides(const ChannelChanges& torque, const ChannelChanges* deflection, double compliance,
                const ChangeSettings& settings, Changes& told) {
  constexpr std::pair<const char*, const char*> kSides[] = {{"motor_coulomb", "load_coulomb"},
                                                            {"motor_viscous", "load_viscous"}};
  std::size_t column = 0;
  for (const FoundChange& f : torque.found) {
    const std::size_t at = column;
    column += f.effect.ramp ? 1 : f.effect.columns.size();
    for (const auto& [before, behind] : kSides)
      for (Change& c : told.changes) {
        if (f.effect.id != before || c.effect != before || c.size.empty() || c.gain != f.gain) continue;
        const double side =
            deflection ? side_of(c.size[0].measured, deflection->beside[at], compliance, settings) : kNaN;
        if (std::isnan(side)) c.alike.emplace_back(behind);
        if (side == 1) c.effect = c.size[0].name = behind;
      }
  }
}

/// What follows no effect in either channel is told once.
void add_deflection(const Changes& more, const ChangeSettings& settings, Changes& all) {
  const std::vector<Change> torque = all.changes;
  for (const Change& c : more.changes) {
    const bool told = std::any_of(torque.begin(), torque.end(), [&](const Change& t) {
      return c.effect == "unknown" && t.effect == c.effect &&
             std::fabs(t.since - c.since) < 2 * settings.window;
    });
    if (!told) all.changes.push_back(c);
  }
  all.healthy_terms.insert(all.healthy_terms.end(), more.healthy_terms.begin(), more.healthy_terms.end());
  all.different.insert(all.different.end(), more.different.begin(), more.different.end());
  all.warnings.insert(all.warnings.end(), more.warnings.begin(), more.warnings.end());
  all.deflection_noise = more.noise;
}

/// Two inertias: the torque first, whose changes may load the teeth otherwise; then the deflection.
Changes changes_of_two(const model::Rig& rig, double behind, const std::vector<record::Record>& healthy,
                       const record::Record& record, MotionSampling sampling, ChangeSettings settings,
                       const Progress& progress) {
  bool load = record.has(record::Channel::load_position);
  for (const record::Record& r : healthy) load = load && r.has(record::Channel::load_position);
  if (load) {
    sampling.behind = behind;
    settings.false_alarms_per_hour /= 2;  // two channels may be wrong
  }
  const HealthyModel whole = commission_healthy(healthy, sampling, settings);
  sampling.mesh = mesh_load(whole, rig.link, behind, healthy, settings);
  const auto search = [&](const HealthyModel& model, const std::vector<FoundChange>& beside) {
    return changes_in(model, healthy, record, beside, rig.linear, settings, progress);
  };
  const ChannelChanges torque = search(commission_healthy(healthy, sampling, settings), {});
  Changes all = torque.told;
  if (!load) {
    tell_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.emplace_back("without load_position changes of the backlash cannot be told");
    return all;
  }
  sampling.channel = ChangeChannel::deflection;
  try {
    const HealthyModel model = commission_healthy(healthy, sampling, settings);
    const ChannelChanges deflection = search(model, torque.found);
    tell_sides(torque, &deflection, compliance_of(model), settings, all);
    add_deflection(deflection.told, settings, all);
  } catch (const CannotIdentify& error) {
    tell_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.push_back("changes of the backlash cannot be told: " + std::string(error.what()));
  }
  return all;
}

}  // namespace

Changes detect_changes(const model::Rig& rig, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings,
                       const Progress& progress) {
  const double behind = rig.mesh.rigid ? 0 : share_behind(rig);
  std::vector<const record::Record*> all = {&record};
  for (const record::Record& r : healthy) all.push_back(&r);
  const MotionSampling sampling = sampling_of(all, settings);
  Changes out;
  if (rig.mesh.rigid)
    out = changes_in(commission_healthy(healthy, sampling, settings), healthy, record, {}, rig.linear,
                     settings, progress)
              .told;
  else
    out = changes_of_two(rig, behind, healthy, record, sampling, settings, progress);
  std::sort(out.changes.begin(), out.changes.end(),
            [](const Change& a, const Change& b) { return a.since < b.since; });
  return out;
}

}  // namespace backlash::identification
