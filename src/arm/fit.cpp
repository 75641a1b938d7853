// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"
#include "fit_priors.h"
#include "regrouping.h"

namespace backlash::arm {
namespace {

constexpr double kForgotten =
    0.05;  // choice: correlation from which on the memory of a residual counts as over
constexpr double kLongestMemory = 3;  // s; choice
constexpr double kSettled = 1e-3;     // standard errors; choice
constexpr double kLag = 0.1;  // of Coulomb friction, bristles and Stribeck; choice, tried on drawn arms

constexpr double kLeastShape = 0.2;  // of what it was, after a step; choice

using Mask = Eigen::Matrix<char, Eigen::Dynamic, Eigen::Dynamic>;

/// How many successive rows count as one: 1 + 2 sum of the residual's autocorrelation.
double memory(const std::vector<Eigen::VectorXd>& residuals, double step) {
  double square = 0;
  for (const Eigen::VectorXd& r : residuals) square += r.squaredNorm();
  double sum = 1;
  for (Eigen::Index lag = 1; double(lag) * step < kLongestMemory; ++lag) {
    double product = 0;
    for (const Eigen::VectorXd& r : residuals)
      if (r.size() > lag) product += r.head(r.size() - lag).dot(r.tail(r.size() - lag));
    if (!(product > kForgotten * square)) break;
    sum += 2 * product / square;
  }
  return sum;
}

/// Sum of weighted squares about a state, as 1/2 x^T H x - g^T x, in blocks of time.
struct Normal {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
};

class Fit {
 public:
  Fit(const ArmRig& rig, const std::vector<FittedMotion>& motions, const FitFreedom& freedom,
      const FitSettings& settings)
      : rig_(rig),
        motions_(motions),
        freedom_(freedom),
        settings_(settings),
        model_(rig, freedom),
        layout_(layout_of(rig, freedom)),
        state_(model_.start()),
        weight_(rig.joints.size(), 0),
        deviation_(rig.joints.size(), kNaN) {}

  ArmFit run(const Progress& progress);

 private:
  void choose_joints();
  void set_weights(const std::vector<std::vector<Linearised>>& all);
  std::vector<std::vector<Linearised>> linearised() const;
  std::vector<Normal> blocks(const std::vector<std::vector<Linearised>>& all) const;
  void add_rows(const Linearised& joint, const ArmMotion& m, std::size_t j, Eigen::Index from,
                Eigen::Index to, Normal& to_block) const;
  std::vector<char> free_unknowns(bool first) const;
  void apply(const Eigen::VectorXd& step);
  Eigen::MatrixXd lags(const std::vector<std::vector<Linearised>>& all) const;
  Eigen::MatrixXd covariance(const std::vector<Normal>& blocks,
                             const std::vector<std::vector<Linearised>>& all) const;
  ArmFit result(const Eigen::MatrixXd& covariance, const std::vector<std::vector<Linearised>>& all) const;
  void set_drives(ArmFit& fit, const Eigen::MatrixXd& covariance) const;
  FittedState marked_state(Eigen::Index s, const Eigen::MatrixXd& covariance) const;
  void set_errors(ArmFit& fit, const std::vector<std::vector<Linearised>>& all) const;

  const ArmRig& rig_;
  const std::vector<FittedMotion>& motions_;
  const FitFreedom& freedom_;
  const FitSettings& settings_;
  FitModel model_;
  Layout layout_;
  State state_;
  Priors priors_;
  std::vector<double> weight_;     // 1 / (sigma_j^2 c_j); 0: the joint does not count
  std::vector<double> deviation_;  // sigma_j
  std::vector<char> moves_;
};

void Fit::choose_joints() {
  moves_.assign(rig_.joints.size(), 0);
  bool any = false;
  double most = 0;
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    double seconds = 0;
    for (const FittedMotion& m : motions_) seconds += moving_seconds(*m.motion, j);
    moves_[j] = seconds >= settings_.least_seconds;
    any = any || moves_[j];
    most = std::max(most, seconds);
  }
  if (!any)
    throw CannotIdentify(fmt::format("no joint moves faster than {} rad/s for {} s: {:.3g} s at most",
                                     rig_.identification.slowest, settings_.least_seconds, most));
}

std::vector<std::vector<Linearised>> Fit::linearised() const {
  std::vector<std::vector<Linearised>> all;
  for (const FittedMotion& m : motions_) all.push_back(model_.linearised(state_, m));
  return all;
}

void Fit::set_weights(const std::vector<std::vector<Linearised>>& all) {
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    if (!moves_[j]) continue;
    std::vector<Eigen::VectorXd> residuals;
    double square = 0, count = 0, step = 0;
    for (std::size_t m = 0; m < all.size(); ++m) {
      const Eigen::VectorXd counts = motions_[m].motion->counts.col(Eigen::Index(j)).cast<double>();
      residuals.emplace_back((all[m][j].measured - all[m][j].predicted).cwiseProduct(counts));
      square += residuals.back().squaredNorm();
      count += counts.sum();
      const ArmMotion& motion = *motions_[m].motion;
      if (motion.rows.size() > 1) step = motion.time[motion.rows[1]] - motion.time[motion.rows[0]];
    }
    deviation_[j] = std::sqrt(square / count);
    weight_[j] = 1 / (square / count * memory(residuals, step));
  }
}

void Fit::add_rows(const Linearised& joint, const ArmMotion& m, std::size_t j, Eigen::Index from,
                   Eigen::Index to, Normal& block) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = from; k < to; ++k)
    if (m.counts(k, Eigen::Index(j))) rows.push_back(k);
  if (rows.empty()) return;
  const auto columns = Eigen::Index(joint.unknowns.size());
  Eigen::MatrixXd a(Eigen::Index(rows.size()), columns);
  Eigen::VectorXd r(a.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    a.row(i) = joint.sensitivity.row(rows[std::size_t(i)]);
    r[i] = joint.measured[rows[std::size_t(i)]] - joint.predicted[rows[std::size_t(i)]];
  }
  const Eigen::MatrixXd h = weight_[j] * signal::gram(a);
  const Eigen::VectorXd g = weight_[j] * (a.transpose() * r);
  for (Eigen::Index i = 0; i < columns; ++i) {
    block.g[joint.unknowns[std::size_t(i)]] += g[i];
    for (Eigen::Index k = 0; k < columns; ++k)
      block.h(joint.unknowns[std::size_t(i)], joint.unknowns[std::size_t(k)]) += h(i, k);
  }
}

std::vector<Normal> Fit::blocks(const std::vector<std::vector<Linearised>>& all) const {
  std::vector<Normal> blocks;
  const Eigen::Index size = layout_.size();
  for (std::size_t m = 0; m < all.size(); ++m) {
    const ArmMotion& motion = *motions_[m].motion;
    std::size_t from = 0;
    while (from < motion.rows.size()) {
      std::size_t to = from;
      while (to < motion.rows.size() &&
             motion.time[motion.rows[to]] < motion.time[motion.rows[from]] + settings_.block)
        ++to;
      blocks.push_back({Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)});
      for (std::size_t j = 0; j < rig_.joints.size(); ++j)
        if (moves_[j]) add_rows(all[m][j], motion, j, Eigen::Index(from), Eigen::Index(to), blocks.back());
      from = to;
    }
  }
  return blocks;
}

std::vector<char> Fit::free_unknowns(bool first) const {
  std::vector<char> free(std::size_t(layout_.size()), 0);
  const auto set = [&](Eigen::Index from, Eigen::Index count) {
    for (Eigen::Index i = from; i < from + count; ++i) free[std::size_t(i)] = 1;
  };
  if (freedom_.links) set(0, layout_.payload());
  if (freedom_.payload) set(layout_.payload(), 10 * layout_.states);
  if (freedom_.tilt) set(layout_.tilt(), 2);
  for (Eigen::Index j = 0; j < layout_.joints; ++j) {
    if (!moves_[std::size_t(j)]) continue;
    for (Eigen::Index s = 0; s < layout_.states; ++s) {
      if (freedom_.friction) set(layout_.shift(j, s), 1);
      if (freedom_.rubs_otherwise(std::size_t(j))) set(layout_.friction(j, s), 1);
    }
    if (freedom_.of_drive(std::size_t(j)))
      for (const DriveTerm t : rig_.terms) set(layout_.drive(j) + Eigen::Index(t), 1);
    if (freedom_.load && rig_.joints[std::size_t(j)].load_error > 0)
      set(layout_.drive(j) + Eigen::Index(DriveTerm::load), 1);
    if (freedom_.constants && !first && rig_.joints[std::size_t(j)].constant_error > 0)
      set(layout_.kappa(j), 1);
    if (freedom_.drives && !first) set(layout_.delay(j), 1);
  }
  for (std::size_t i = 0; i < freedom_.effects.size(); ++i) {
    const JointEffectSpec& spec = freedom_.effects[i].effect.spec();
    if (!moves_[freedom_.effects[i].joint]) continue;
    const Eigen::Index place = layout_.effect(Eigen::Index(i));
    set(place, spec.columns);
    if (spec.has_shape() && !first) set(place + kEffectUnknowns - 1, 1);
  }
  return free;
}

void Fit::apply(const Eigen::VectorXd& step) {
  for (Eigen::Index i = 0; i < layout_.joints; ++i)
    state_.links[std::size_t(i)] += step.segment<10>(layout_.link(i));
  state_.tilt += step.segment<2>(layout_.tilt());
  for (Eigen::Index s = 0; s < layout_.states; ++s) {
    state_.payloads[std::size_t(s)] += step.segment<10>(layout_.payload(s));
    state_.friction.col(s) += step.segment(layout_.friction(0, s), layout_.joints);
    state_.shift.col(s) += step.segment(layout_.shift(0, s), layout_.joints);
  }
  for (Eigen::Index j = 0; j < layout_.joints; ++j)
    state_.drives.row(j) += step.segment(layout_.drive(j), kDriveUnknowns).transpose();
  for (std::size_t i = 0; i < state_.effects.size(); ++i) {
    const auto own = step.segment<kEffectUnknowns>(layout_.effect(Eigen::Index(i)));
    state_.effects[i].values += own.head<2>();
    double& shape = state_.effects[i].shape;  // > 0, of those that have one
    shape = std::max(shape + own[2], kLeastShape * shape);
  }
}

ArmFit Fit::run(const Progress& progress) {
  choose_joints();
  priors_ = Priors(rig_, freedom_, settings_, moves_);
  priors_.begin(state_);
  std::vector<std::vector<Linearised>> all = linearised();
  for (int i = 0; i < settings_.iterations; ++i) {
    if (progress && !progress(double(i) / settings_.iterations, "fitting the arm")) throw Cancelled();
    set_weights(all);
    Normal sum{Eigen::MatrixXd::Zero(layout_.size(), layout_.size()), Eigen::VectorXd::Zero(layout_.size())};
    for (const Normal& block : blocks(all)) sum.h += block.h, sum.g += block.g;
    const Eigen::VectorXd step = priors_.step(sum.h, sum.g, state_, free_unknowns(i < 2));
    apply(step);
    all = linearised();
    if (i > 3 && step.dot(sum.h * step) < kSettled) break;
  }
  set_weights(all);
  return result(covariance(blocks(all), all), all);
}

/// What friction that lags behind its model's would change: of each joint in the marked motions a torque that
/// follows the acceleration, kLag of its Coulomb friction (rms). Columns: joints.
Eigen::MatrixXd Fit::lags(const std::vector<std::vector<Linearised>>& all) const {
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(layout_.size(), layout_.joints);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    const auto c = Eigen::Index(j);
    if (!moves_[j]) continue;
    Normal sum{Eigen::MatrixXd::Zero(layout_.size(), layout_.size()), Eigen::VectorXd::Zero(layout_.size())};
    double squares = 0, count = 0;
    for (std::size_t m = 0; m < all.size(); ++m) {
      if (!motions_[m].marked()) continue;
      const ArmMotion& motion = *motions_[m].motion;
      add_rows(all[m][j], motion, j, 0, Eigen::Index(motion.rows.size()), sum);
      squares += motion.drive[j].col(int(DriveTerm::rotor_inertia)).squaredNorm();
      count += double(motion.rows.size());
    }
    if (!(squares > 0)) continue;
    const double inertia =
        kLag * state_.drives(c, Eigen::Index(DriveTerm::coulomb)) / std::sqrt(squares / count);
    g.col(c) = inertia * sum.h.col(layout_.drive(c) + Eigen::Index(DriveTerm::rotor_inertia));
  }
  return g;
}

/// Blocks left out, one step of Newton each, what the declared values leave open, and friction that lags.
Eigen::MatrixXd Fit::covariance(const std::vector<Normal>& blocks,
                                const std::vector<std::vector<Linearised>>& all) const {
  const std::vector<char> free = free_unknowns(false);
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i]) places.push_back(Eigen::Index(i));
  const auto n = Eigen::Index(places.size());
  const auto part = [&](const Eigen::MatrixXd& h) {
    Eigen::MatrixXd out(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k < n; ++k) out(i, k) = h(places[std::size_t(i)], places[std::size_t(k)]);
    return out;
  };
  const Eigen::MatrixXd prior = part(priors_.curvature(state_));
  Eigen::MatrixXd sum = prior;
  std::vector<Eigen::MatrixXd> h;
  for (const Normal& block : blocks) {
    h.push_back(part(block.h));
    sum += h.back();
  }
  const Eigen::VectorXd scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const auto solve = [&](const Eigen::MatrixXd& m, const Eigen::MatrixXd& b) {
    const Eigen::MatrixXd scaled = scale.asDiagonal() * m * scale.asDiagonal();
    return Eigen::MatrixXd(scale.asDiagonal() * signal::solve_symmetric(scaled, scale.asDiagonal() * b));
  };
  Eigen::MatrixXd changes(n, Eigen::Index(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    Eigen::VectorXd g(n);
    for (Eigen::Index i = 0; i < n; ++i) g[i] = blocks[b].g[places[std::size_t(i)]];
    changes.col(Eigen::Index(b)) = -solve(sum - h[b], g);
  }
  const double count = double(blocks.size());
  const Eigen::MatrixXd centred = changes.colwise() - changes.rowwise().mean();
  const Eigen::MatrixXd open =
      solve(sum, Eigen::MatrixXd(signal::product(prior, solve(sum, Eigen::MatrixXd::Identity(n, n)))));
  Eigen::MatrixXd both = (count - 1) / count * signal::product(centred, centred.transpose()) + open;
  if (freedom_.payload) {
    const Eigen::MatrixXd g = lags(all);
    Eigen::MatrixXd free_g(n, g.cols());
    for (Eigen::Index i = 0; i < n; ++i) free_g.row(i) = g.row(places[std::size_t(i)]);
    const Eigen::MatrixXd changed = solve(sum, free_g);
    both += signal::product(changed, changed.transpose());
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(layout_.size(), layout_.size());
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; k < n; ++k) out(places[std::size_t(i)], places[std::size_t(k)]) = both(i, k);
  return out;
}

void Fit::set_drives(ArmFit& fit, const Eigen::MatrixXd& covariance) const {
  const Eigen::Index count = layout_.joints;
  double shared = 0, pairs = 0, least = std::numeric_limits<double>::infinity();
  for (Eigen::Index j = 0; j < count; ++j) {
    if (const double own = covariance(layout_.kappa(j), layout_.kappa(j)); own > 0)
      least = std::min(least, own);
    for (Eigen::Index i = 0; i < j; ++i)
      if (const double c = covariance(layout_.kappa(i), layout_.kappa(j)); c != 0) shared += c, pairs += 1;
  }
  // The error that all share is at most that of the best known: each has the rest by itself.
  if (freedom_.constants && pairs > 0)
    fit.rig.common_error = std::sqrt(std::max(0.0, std::min(shared / pairs, least)));
  for (Eigen::Index j = 0; j < count; ++j) {
    JointDrive& drive = fit.rig.joints[std::size_t(j)];
    std::vector<signal::Measured> values;
    for (Eigen::Index i = 0; i < kDriveUnknowns; ++i) {
      const Eigen::Index place = layout_.drive(j) + i;
      values.push_back({state_.drives(j, i), std::sqrt(std::max(0.0, covariance(place, place)))});
    }
    for (std::size_t t = 0; t < kDriveTerms; ++t) drive.terms[t] = values[t].value;
    drive.delay = values.back().value;
    if (freedom_.drives) drive.load_error = values[std::size_t(DriveTerm::load)].standard_error;
    signal::Measured& constant = values[kDriveTerms];
    constant.value = drive.constant * std::exp(constant.value);
    const double own =
        freedom_.constants && moves_[std::size_t(j)] ? constant.standard_error : drive.constant_error;
    constant.standard_error = constant.value * own;
    if (freedom_.constants && drive.constant_error > 0)
      drive.constant_error =
          std::max(0.001, std::sqrt(std::max(0.0, own * own - fit.rig.common_error * fit.rig.common_error)));
    drive.constant = constant.value;
    fit.drives.push_back(values);
  }
}

FittedState Fit::marked_state(Eigen::Index s, const Eigen::MatrixXd& covariance) const {
  FittedState out;
  for (Eigen::Index j = 0; j < layout_.joints; ++j) {
    const double factor = std::exp(state_.friction(j, s));
    const Eigen::Index place = layout_.friction(j, s);
    out.shifts.push_back(state_.shift(j, s));
    out.friction_factors.push_back({factor, factor * std::sqrt(std::max(0.0, covariance(place, place)))});
  }
  if (!freedom_.payload) return out;
  const Eigen::MatrixXd c = covariance.block(layout_.payload(s), layout_.payload(s), 4, 4);
  const BodyParameters& body = state_.payloads[std::size_t(s)];
  const double mass = body[0];
  out.payload = freedom_.payload_sign * body;
  out.moment_covariance = c.block<3, 3>(1, 1);
  out.mass = {freedom_.payload_sign * mass, std::sqrt(c(0, 0))};
  for (int i = 0; i < 3; ++i) {
    const double centre = body[1 + i] / mass;
    const double variance =
        (c(1 + i, 1 + i) - 2 * centre * c(0, 1 + i) + centre * centre * c(0, 0)) / (mass * mass);
    out.centre[i] = {centre, std::sqrt(std::max(0.0, variance))};
  }
  return out;
}

void Fit::set_errors(ArmFit& fit, const std::vector<std::vector<Linearised>>& all) const {
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    double noise = 0, count = 0, sum = 0, squares = 0, residual = 0;
    for (std::size_t m = 0; m < all.size(); ++m) {
      const ArmMotion& motion = *motions_[m].motion;
      for (Eigen::Index k = 0; k < motion.counts.rows(); ++k) {
        if (!motion.counts(k, Eigen::Index(j))) continue;
        const double s = all[m][j].measured[k], r = s - all[m][j].predicted[k];
        count += 1, sum += s, squares += s * s, residual += r * r;
        noise += motion.noise[Eigen::Index(j)] * motion.noise[Eigen::Index(j)];
      }
    }
    const double spread = squares - sum * sum / count;
    fit.train.push_back(moves_[j] ? std::sqrt(residual / spread) : kNaN);
    if (freedom_.links && moves_[j]) fit.rig.joints[j].training_error = fit.train.back();
    fit.floor.push_back(moves_[j] ? std::sqrt(noise / spread) : kNaN);
    if (!moves_[j])
      fit.warnings.push_back(rig_.joints[j].name + " does not move long enough: its drive is as declared");
  }
}

ArmFit Fit::result(const Eigen::MatrixXd& covariance, const std::vector<std::vector<Linearised>>& all) const {
  ArmFit fit;
  fit.rig = rig_;
  fit.rig.chain.links = state_.links;
  fit.rig.fitted = rig_.fitted || freedom_.links;
  fit.deviation = deviation_;
  fit.covariance = covariance;
  set_drives(fit, covariance);
  for (Eigen::Index i = 0; i < 2; ++i)
    fit.tilt[i] = {state_.tilt[i], std::sqrt(covariance(layout_.tilt() + i, layout_.tilt() + i))};
  fit.states.clear();
  for (Eigen::Index s = 0; s < layout_.states; ++s) fit.states.push_back(marked_state(s, covariance));
  for (std::size_t i = 0; i < state_.effects.size(); ++i) {
    const Eigen::Index place = layout_.effect(Eigen::Index(i));
    fit.effects.push_back({state_.effects[i], covariance.block<3, 3>(place, place)});
    const auto joint = Eigen::Index(freedom_.effects[i].joint);
    double count = 0, sum = 0, squares = 0;
    for (const FittedMotion& m : motions_) {
      if (!m.marked() && !freedom_.effects[i].everywhere) continue;
      for (const std::size_t row : m.motion->rows) {
        const double q = m.motion->q(Eigen::Index(row), joint);
        count += 1, sum += q, squares += q * q;
      }
    }
    fit.effects.back().middle = sum / count;
    fit.effects.back().spread = std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)));
  }
  set_errors(fit, all);
  if (freedom_.links) {
    const Regrouping regrouping(rig_.chain, motions_);
    fit.base = regrouping.base_parameters(rig_.chain, state_.links, covariance);
    fit.rig.shown = regrouping.shown();
    fit.rig.chain.links = regrouping.nearest(rig_.chain.links, state_.links);
  }
  return fit;
}

}  // namespace

ArmFit fit_arm(const ArmRig& rig, const std::vector<FittedMotion>& motions, const FitFreedom& freedom,
               const FitSettings& settings, const Progress& progress) {
  return Fit(rig, motions, freedom, settings).run(progress);
}

}  // namespace backlash::arm
