// SPDX-License-Identifier: BSD-3-Clause
// Which effect of one joint takes most of what a fit leaves, beside all that the fit could have changed.
#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"
#include "joint_effects.h"

namespace backlash::arm {
namespace {

constexpr double kLeastOwn = 1e-4;  // - of a column's squares that must not follow from the fit's own; choice
constexpr double kNone = 1e-9;      // - of a column, of what follows from others; rounding
constexpr double kNearly = 0.9;     // - of the best's share: not distinguished from it; choice
constexpr double kMostOrder = 80;   // 1/rad; choice
constexpr double kOrdersPerTurn =
    4;  // steps of 2 pi over the travel, by which orders are distinguished; choice
constexpr double kLeastStep = 0.1;         // 1/rad; choice (time)
constexpr double kFastest = 2;             // times torque_cutoff, of a wave at the rms speed; choice
constexpr double kScaleStep = 0.7;         // of a speed or distance, between those tried; choice
constexpr std::size_t kSamplesPerRow = 8;  // of a column before its low-pass, at least; choice
constexpr int kRefinements = 4;            // of a shape, each a third of the step before; choice

/// Thinned where there are far more samples than the low-pass leaves: a search takes hundreds of columns.
ArmMotion thinned(const ArmMotion& m) {
  const std::size_t apart = m.rows.size() > 1 ? m.rows[1] - m.rows[0] : 1;
  std::size_t by = std::max<std::size_t>(1, apart / kSamplesPerRow);
  while (apart % by != 0) --by;
  const std::size_t first = m.rows.empty() ? 0 : m.rows.front() % by;
  std::vector<Eigen::Index> kept;
  ArmMotion out;
  out.interval = m.interval * double(by);
  for (std::size_t k = first; k < m.time.size(); k += by) {
    kept.push_back(Eigen::Index(k));
    out.time.push_back(m.time[k]);
  }
  for (const auto member :
       {&ArmMotion::q, &ArmMotion::v, &ArmMotion::a, &ArmMotion::motor_v, &ArmMotion::sign}) {
    (out.*member).resize(Eigen::Index(kept.size()), m.q.cols());
    for (std::size_t k = 0; k < kept.size(); ++k)
      (out.*member).row(Eigen::Index(k)) = (m.*member).row(kept[k]);
  }
  for (const std::size_t row : m.rows) out.rows.push_back((row - first) / by);
  return out;
}

/// What the fit leaves of one joint, without what it could have changed. Links and drives are known from the
/// training, where an effect is of the test record alone.
struct Remainder {
  std::vector<std::vector<Eigen::Index>> rows;  // that count, per motion
  Eigen::MatrixXd basis;                        // orthonormal, of the fit's own columns
  Eigen::VectorXd residual;                     // beside them
};

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd scale = columns.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const Eigen::MatrixXd scaled = columns * scale.asDiagonal();
  const signal::SymmetricEigen parts = signal::symmetric_eigen(signal::gram(scaled));
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < scaled.cols(); ++i)
    if (parts.values[i] > kNone) kept.push_back(i);
  Eigen::MatrixXd basis(columns.rows(), Eigen::Index(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i)
    basis.col(Eigen::Index(i)) = scaled * parts.vectors.col(kept[i]) / std::sqrt(parts.values[kept[i]]);
  return basis;
}

class Search {
 public:
  Search(const ArmFit& fit, const FitFreedom& freedom, const std::vector<FittedMotion>& motions,
         bool everywhere);
  std::vector<EffectGuess> run() const;
  std::vector<double> gain_shares() const;

 private:
  Remainder left_of(std::size_t j) const;
  bool could_change(Eigen::Index unknown) const;
  std::vector<JointEffect> effects_of(std::size_t j) const;
  Eigen::MatrixXd columns(const Remainder& left, const JointEffect& effect, std::size_t j) const;
  /// Share of the residual's squares that it takes; its values.
  double share(const Remainder& left, JointEffect& effect, std::size_t j) const;
  double order_step(std::size_t j) const;
  void refine(const Remainder& left, EffectGuess& guess, std::size_t j) const;
  std::vector<EffectGuess> best_of(std::size_t j) const;

  const ArmFit& fit_;
  const FitFreedom& freedom_;
  const std::vector<FittedMotion>& motions_;
  const bool everywhere_;
  FitModel model_;
  State state_;
  std::vector<std::vector<Linearised>> linear_;       // per motion
  std::vector<ArmMotion> thin_;                       // per motion
  std::vector<Eigen::MatrixXd> chain_;                // of those, see FitModel::chain_torque()
  std::vector<std::vector<Eigen::VectorXd>> drives_;  // per motion and joint, at the rows
  std::vector<double> speed_, travel_;                // per joint: rms, rad/s; rad
};

Search::Search(const ArmFit& fit, const FitFreedom& freedom, const std::vector<FittedMotion>& motions,
               bool everywhere)
    : fit_(fit),
      freedom_(freedom),
      motions_(motions),
      everywhere_(everywhere),
      model_(fit.rig, freedom),
      state_(state_of(fit, freedom)) {
  for (const FittedMotion& m : motions) {
    linear_.push_back(model_.linearised(state_, m));
    thin_.push_back(thinned(*m.motion));
    chain_.push_back(model_.chain_torque(state_, {&thin_.back(), m.state}));
    drives_.emplace_back();
    for (std::size_t j = 0; j < fit.rig.joints.size(); ++j)
      drives_.back().emplace_back(fit.rig.joints[j].constant * linear_.back()[j].predicted);
  }
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j) {
    double squares = 0, count = 0, lowest = INFINITY, highest = -INFINITY;
    for (const FittedMotion& m : motions) {
      const auto c = Eigen::Index(j);
      squares += m.motion->motor_v.col(c).squaredNorm(), count += double(m.motion->motor_v.rows());
      lowest = std::min(lowest, m.motion->q.col(c).minCoeff());
      highest = std::max(highest, m.motion->q.col(c).maxCoeff());
    }
    speed_.push_back(std::sqrt(squares / count));
    travel_.push_back(highest - lowest);
  }
}

bool Search::could_change(Eigen::Index unknown) const {
  const Layout at = layout_of(fit_.rig, freedom_);
  for (const std::size_t joint : freedom_.steady)
    if (unknown == at.friction(Eigen::Index(joint))) return false;
  if (everywhere_) return true;
  const bool drive = unknown >= at.drive(0) && unknown < at.effect(0);
  return unknown >= at.payload() && !drive;
}

Remainder Search::left_of(std::size_t j) const {
  Remainder left;
  Eigen::Index rows = 0, columns = 0;
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    left.rows.emplace_back();
    for (Eigen::Index k = 0; k < motions_[m].motion->counts.rows(); ++k)
      if (motions_[m].motion->counts(k, Eigen::Index(j))) left.rows.back().push_back(k);
    rows += Eigen::Index(left.rows.back().size());
    for (const Eigen::Index u : linear_[m][j].unknowns) columns = std::max(columns, u + 1);
  }
  // One column per unknown, of all motions.
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd residual(rows);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    const Linearised& joint = linear_[m][j];
    for (const Eigen::Index k : left.rows[m]) {
      residual[row] = joint.measured[k] - joint.predicted[k];
      for (std::size_t i = 0; i < joint.unknowns.size(); ++i)
        if (could_change(joint.unknowns[i]))
          own(row, joint.unknowns[i]) = joint.sensitivity(k, Eigen::Index(i));
      ++row;
    }
  }
  left.basis = orthonormal(own);
  left.residual = residual - left.basis * (left.basis.transpose() * residual);
  return left;
}

std::vector<JointEffect> Search::effects_of(std::size_t j) const {
  std::vector<JointEffect> all;
  const double most =
      std::min(kMostOrder, 2 * M_PI * kFastest * fit_.rig.identification.torque_cutoff / speed_[j]);
  for (const JointEffectSpec& spec : joint_effect_specs()) {
    // The fit knows a drive from all records.
    if (everywhere_ && (stands_for_term(spec, fit_.rig) || spec.id == gain_of_drive().id)) continue;
    if (spec.type) continue;
    if (!is_coupling({spec.id}))
      all.push_back({spec.id});
    else
      for (std::size_t i = 0; i < fit_.rig.joints.size(); ++i)
        if (i != j) all.push_back({spec.id, 0, fit_.rig.joints[i].name});
  }
  model::MotionRange range;
  range.torque = range.duration = 1, range.speed = speed_[j];
  for (const model::SearchedTerm& term : model::searched_terms(model::ShownIn::torque, range)) {
    const JointEffectSpec* spec = known_spec(term.type->id);
    if (!spec || (everywhere_ && stands_for_term(*spec, fit_.rig))) continue;
    std::vector<double> shapes = term.shapes;
    if (spec->shape == EffectShape::order)
      for (double n = spec->least_order; n <= most; n += order_step(j)) shapes.push_back(n);
    if (shapes.empty()) shapes.push_back(0);
    for (const double shape : shapes)
      all.push_back({spec->id, shape, "", Eigen::Vector2d::Zero(), term.given});
  }
  return all;
}

double Search::order_step(std::size_t j) const {
  return std::max(kLeastStep, 2 * M_PI / travel_[j] / kOrdersPerTurn);
}

Eigen::MatrixXd Search::columns(const Remainder& left, const JointEffect& effect, std::size_t j) const {
  Eigen::MatrixXd out(left.residual.size(), effect.spec().columns);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    const Eigen::MatrixXd z = model_.effect_at_rows(state_, effect, j, thin_[m], chain_[m], drives_[m]);
    for (const Eigen::Index k : left.rows[m]) out.row(row++) = z.row(k);
  }
  return out;
}

double Search::share(const Remainder& left, JointEffect& effect, std::size_t j) const {
  const Eigen::MatrixXd z = columns(left, effect, j);
  const Eigen::MatrixXd own = z - left.basis * (left.basis.transpose() * z);
  const Eigen::MatrixXd gram = own.transpose() * own;
  for (Eigen::Index i = 0; i < z.cols(); ++i)
    if (!(gram(i, i) > kLeastOwn * z.col(i).squaredNorm())) return 0;
  const Eigen::VectorXd moment = own.transpose() * left.residual;
  const Eigen::VectorXd values = signal::solve_symmetric(gram, moment);
  effect.values.head(z.cols()) = values;
  if (effect.spec().positive && !(values[0] > 0)) return 0;
  const double taken = moment.dot(values) / left.residual.squaredNorm();
  return std::isfinite(taken) ? taken : 0;
}

void Search::refine(const Remainder& left, EffectGuess& guess, std::size_t j) const {
  JointEffect& best = guess.effect.effect;
  const EffectShape shape = best.spec().shape;
  double step = shape == EffectShape::order ? order_step(j) : kScaleStep * best.shape;
  for (int i = 0; i < kRefinements; ++i) {
    step /= 3;
    const double middle = best.shape;
    for (const int k : {-2, -1, 1, 2}) {
      JointEffect e = best;
      e.shape = middle + step * k;
      if (!(e.shape > 0)) continue;
      const double taken = share(left, e, j);
      if (taken > guess.share) guess.share = taken, best = e;
    }
  }
  guess.effect.shape_spread = shape == EffectShape::order ? order_step(j) : best.shape / 2;
}

std::vector<EffectGuess> Search::best_of(std::size_t j) const {
  const Remainder left = left_of(j);
  if (left.residual.size() <= 2 * left.basis.cols()) return {};
  std::map<std::string, EffectGuess> best;  // of each effect by its name
  for (JointEffect& e : effects_of(j)) {
    const double taken = share(left, e, j);
    EffectGuess& known = best[e.id];
    if (taken > known.share) known = {{j, e, 0, false}, taken, {}};
  }
  std::vector<EffectGuess> all;
  for (auto& [id, guess] : best) {
    if (!(guess.share > 0)) continue;
    if (guess.effect.effect.spec().has_shape()) refine(left, guess, j);
    all.push_back(guess);
  }
  for (EffectGuess& guess : all)
    for (const EffectGuess& other : all)
      if (&other != &guess && other.share > kNearly * guess.share)
        guess.alike.push_back(other.effect.effect.id);
  return all;
}

std::vector<EffectGuess> Search::run() const {
  std::vector<EffectGuess> all;
  for (std::size_t j = 0; j < fit_.rig.joints.size(); ++j) {
    if (std::isnan(fit_.deviation[j])) continue;
    for (EffectGuess& guess : best_of(j)) all.push_back(std::move(guess));
  }
  std::sort(all.begin(), all.end(),
            [](const EffectGuess& a, const EffectGuess& b) { return a.share > b.share; });
  return all;
}

std::vector<double> Search::gain_shares() const {
  std::vector<double> shares(fit_.rig.joints.size(), 0);
  for (std::size_t j = 0; j < shares.size(); ++j) {
    if (std::isnan(fit_.deviation[j])) continue;
    JointEffect gain = gain_of_drive();
    shares[j] = share(left_of(j), gain, j);
  }
  return shares;
}

}  // namespace

std::vector<double> gain_shares(const ArmFit& fit, const FitFreedom& freedom,
                                const std::vector<FittedMotion>& motions) {
  return Search(fit, freedom, motions, false).gain_shares();
}

std::vector<EffectGuess> guess_effects(const ArmFit& fit, const FitFreedom& freedom,
                                       const std::vector<FittedMotion>& motions, bool everywhere) {
  return Search(fit, freedom, motions, everywhere).run();
}

}  // namespace backlash::arm
