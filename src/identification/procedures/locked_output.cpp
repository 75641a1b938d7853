// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/locked_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/signal/block_regression.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "locked_signals.h"

namespace backlash::identification {
namespace {

constexpr int kGrid = 12;               // choice (time): places that either edge is tried at first
constexpr double kLeastOnFlank = 0.03;  // choice: of the rows, beyond either edge
constexpr double kHold = 0.5;       // theory: samples, between a torque that is held and one of the moment
constexpr double kReach = 0.5;      // theory: standard deviations of what is known within a bound, 95 %
constexpr int kStates = 8;          // choice: places of position and of speed, each way
constexpr int kParts = 16;          // choice: of a record, predicted by the others
constexpr int kDraws = 100;         // choice (time)
constexpr double kClear = 4;        // choice: standard deviations of white noise
constexpr int kRounds = 5;          // choice: of what the terms make of the fitted mesh
constexpr long kSpareBlocks = 4;    // choice: beyond the unknowns, for a covariance from blocks
constexpr double kVagueOffset = 1;  // choice: of the torque's spread; only a preloaded mesh feels it
constexpr double kClearStiffness =
    2;                               // choice: standard errors of the stiffness, from which there are flanks
constexpr double kMostLeft = 0.5;    // choice: relative error, beyond which the model says too little
constexpr double kFewestPasses = 3;  // theory: in a single one to and fro a drift looks like play

enum : Eigen::Index { kInertia, kViscous, kCoulomb, kOffset, kDrift, kStiffness, kPlus, kMinus, kUnknowns };

double rms(const Eigen::VectorXd& values) {
  return values.norm() / std::sqrt(double(values.size()));
}

double spread(const Eigen::VectorXd& values) {
  return rms(values.array() - values.mean());
}

/// Differences over more than a step of the encoder, which hides smaller changes.
fit::NonlinearOptions wide_steps() {
  fit::NonlinearOptions options;
  options.step = 0.1;
  options.central = true;
  return options;
}

LockedMesh mesh_of(const Eigen::VectorXd& p) {
  return {p[kStiffness], p[kPlus], p[kMinus], p[kDrift]};
}

/// One record, its torque, and the rig as it is known.
class Fit {
 public:
  Fit(const LockedSignals& signals, const model::Rig& rig, double passes)
      : signals_(signals),
        rig_(rig),
        passes_(passes),
        columns_(signals.picked(signals.columns())),
        travel_(signal::extent(signals.data().motor)) {}

  void start();
  void refine();
  /// The torque anew, with the terms acting on the fitted mesh.
  void take_torque(const LockedMesh& mesh) {
    whole_torque_ = signals_.torque(rig_, mesh);
    torque_ = signals_.picked(whole_torque_);
  }
  void judge(double floor);

  Eigen::VectorXd predicted() const {
    return signals_.columns() * p_.head(4) + signals_.mesh_torque(rig_, mesh_of(p_));
  }
  const Eigen::VectorXd& values() const { return p_; }
  const Eigen::MatrixXd& covariance() const { return fit_.covariance; }
  const Eigen::VectorXd& whole_torque() const { return whole_torque_; }
  Eigen::VectorXd residuals() const { return sigma_ * fit_.residuals.head(torque_.size()); }
  Eigen::VectorXd torque() const { return torque_; }
  double share_beyond(bool plus) const;
  /// Before the effects that the model may lack are counted.
  const signal::Measured& known_stiffness() const { return known_stiffness_; }
  const std::vector<std::string>& lacking() const { return lacking_; }
  /// Then dry friction changes its sign within a sample, and its mean is too small.
  bool chatters() const { return signals_.chatters(model::GearTrain(rig_).motor_inertia()); }

 private:
  Eigen::VectorXd column(Lack lack, const Eigen::VectorXd& p) const {
    return signals_.picked(signals_.lack(lack, rig_, {p_[kStiffness], p[kPlus], p[kMinus], p[kDrift]}));
  }
  Eigen::VectorXd mesh(const LockedMesh& m) const { return signals_.picked(signals_.mesh_torque(rig_, m)); }
  struct Start {
    double left = INFINITY;  // N m, root mean square
    Eigen::VectorXd p;
  };
  double declared_stiffness() const { return rig_.mesh.contact_spec().values.at("stiffness"); }
  void consider(const Eigen::VectorXd& teeth, double plus, double minus, Eigen::Index linear, Start& best);
  Eigen::VectorXd rows(const Eigen::VectorXd& p) const;
  void widen(const Eigen::VectorXd& variance);
  void add_timing(const Eigen::MatrixXd& white);
  void add_noise_of_motion(const Eigen::MatrixXd& white);
  void add_lacks();
  double systematic(double floor) const;
  void allow_for_left(const Eigen::MatrixXd& white, double floor);

  const LockedSignals& signals_;
  const model::Rig& rig_;
  double passes_;
  Eigen::MatrixXd columns_;
  signal::Extent travel_;
  Eigen::VectorXd whole_torque_, torque_, p_, scale_;
  double sigma_ = 1;
  signal::LeastSquaresFit fit_;
  signal::Measured known_stiffness_;
  std::vector<std::string> lacking_;
  std::vector<Eigen::VectorXd> starts_;
};

/// Rows in standard deviations, then what is known beside them: offset and drift are vague, not unknown.
Eigen::VectorXd Fit::rows(const Eigen::VectorXd& p) const {
  if (!(p[kStiffness] > 0)) throw CannotIdentify("stiffness <= 0");
  Eigen::VectorXd out(torque_.size() + 2);
  out.head(torque_.size()) = (torque_ - columns_ * p.head(4) - mesh(mesh_of(p))) / sigma_;
  out[torque_.size()] = -p[kOffset] / (kVagueOffset * spread(torque_));
  out[torque_.size() + 1] = -p[kDrift] / scale_[kDrift];
  return out;
}

/// With these edges everything else is linear: keeps the best. `linear` columns count: without the
/// last there is no offset.
void Fit::consider(const Eigen::VectorXd& teeth, double plus, double minus, Eigen::Index linear,
                   Start& best) {
  Eigen::MatrixXd a(torque_.size(), linear + 1);
  a << columns_.leftCols(linear), teeth;
  try {
    const signal::LeastSquaresFit fit = signal::fit_linear(a, torque_);
    const double left = rms(fit.residuals);
    if (!(left < best.left) || !(fit.values[linear] > 0)) return;
    best = {left, Eigen::VectorXd::Zero(kUnknowns)};
    best.p.head(linear) = fit.values.head(linear);
    best.p[kStiffness] = declared_stiffness() * fit.values[linear];
    best.p[kPlus] = plus;
    best.p[kMinus] = minus;
  } catch (const CannotIdentify&) {  // an edge beyond what slides
  }
}

/// The best of a grid of edges, and of small gaps without an offset, whose place a preloaded mesh hardly
/// shows.
void Fit::start() {
  const double stiffness = declared_stiffness(), step = travel_.size() / kGrid;
  take_torque({stiffness, travel_.high, travel_.low, 0});
  std::vector<Eigen::VectorXd> plus, minus;
  for (int i = 0; i < kGrid; ++i) {
    const double edge = travel_.low + i * step;
    plus.push_back(mesh({stiffness, edge, travel_.low - travel_.size(), 0}));
    minus.push_back(mesh({stiffness, travel_.high + travel_.size(), edge + step, 0}));
  }
  Start any, small;
  for (int i = 0; i < kGrid; ++i)
    for (int j = 0; j <= i; ++j)
      consider(plus[std::size_t(i)] + minus[std::size_t(j)], travel_.low + i * step,
               travel_.low + (j + 1) * step, 4, any);
  for (int i = 1; i < 2 * kGrid; ++i)
    for (const double gap : {0.1 * step, step}) {
      const double high = travel_.low + 0.5 * (i * step + gap), low = high - gap;
      consider(mesh({stiffness, high, low, 0}), high, low, 3, small);
    }
  for (const Start& s : {any, small})
    if (std::isfinite(s.left)) starts_.push_back(s.p);
  if (starts_.empty()) throw CannotIdentify("no flank: torque does not rise with position");
  sigma_ = std::min(any.left, small.left);
  scale_ = Eigen::VectorXd::Zero(kUnknowns);
  for (Eigen::Index i = 0; i < 4; ++i) scale_[i] = spread(torque_) / rms(columns_.col(i));
  scale_[kDrift] = travel_.size() / (2 * signals_.middle());
  if (passes_ < kFewestPasses) scale_[kDrift] *= 1e-6;
  scale_[kStiffness] = starts_.front()[kStiffness];
  scale_[kPlus] = scale_[kMinus] = step;
}

void Fit::refine() {
  const fit::NonlinearOptions options = wide_steps();
  const auto f = [this](const Eigen::VectorXd& p) { return rows(p); };
  double least = INFINITY;
  for (const Eigen::VectorXd& p : starts_) {
    const signal::LeastSquaresFit fit = fit::fit_nonlinear(f, p, scale_, options);
    if (fit.residuals.norm() >= least) continue;
    least = fit.residuals.norm();
    fit_ = fit;
  }
  sigma_ *= rms(fit_.residuals.head(torque_.size()));  // rows of variance 1
  fit_ = fit::fit_nonlinear(f, fit_.values, scale_, options);
  p_ = fit_.values;
  starts_ = {p_};
}

double Fit::share_beyond(bool plus) const {
  double beyond = 0;
  for (const Eigen::Index k : signals_.rows()) {
    const double t = double(k) * signals_.data().interval - signals_.middle();
    const double x = signals_.data().motor[std::size_t(k)] - p_[kDrift] * t;
    beyond += plus ? x > p_[kPlus] : x < p_[kMinus];
  }
  return beyond / double(torque_.size());
}

/// Correlations stay.
void Fit::widen(const Eigen::VectorXd& variance) {
  const Eigen::VectorXd growth = variance.cwiseQuotient(fit_.covariance.diagonal()).cwiseMax(1).cwiseSqrt();
  fit_.covariance = growth.asDiagonal() * fit_.covariance * growth.asDiagonal();
}

void Fit::judge(double floor) {
  const Eigen::Index n = torque_.size();
  const auto pass = Eigen::Index(double(n) / passes_);
  const Eigen::Index longest = n / (kUnknowns + kSpareBlocks), shortest = n / (4 * kUnknowns);
  const Eigen::MatrixXd white = fit_.covariance;
  Eigen::VectorXd variance = white.diagonal();
  for (const Eigen::Index length : {std::min(pass, longest), std::min(pass, shortest)}) {
    const Eigen::Index block = std::max<Eigen::Index>(1, length);
    const double free = double(n) / double(block) - double(kUnknowns);
    const double student = signal::student_t_quantile(0.975, free) / signal::kNormalQuantile975;
    variance = variance.cwiseMax(student * student * signal::block_covariance(fit_, block, 2).diagonal());
  }
  widen(variance);
  known_stiffness_ = fit_.parameter(kStiffness);
  add_timing(white);
  add_noise_of_motion(white);
  allow_for_left(white, floor);
  add_lacks();
  if (chatters()) {
    const double coulomb = std::fabs(p_[kCoulomb]), speed = rms(columns_.col(kViscous));
    fit_.covariance(kCoulomb, kCoulomb) += std::pow(kReach * coulomb, 2);
    fit_.covariance(kViscous, kViscous) += std::pow(coulomb / speed, 2);
  }
}

/// Torque and position may be apart by a part of a sample, which acts like a damping.
void Fit::add_timing(const Eigen::MatrixXd& white) {
  const Eigen::VectorXd later = signals_.picked(signals_.delayed_by_sample()) / sigma_;
  const Eigen::VectorXd gradient = fit_.jacobian.topRows(torque_.size()).transpose() * later;
  const Eigen::VectorXd shift = kHold * (white * gradient);
  fit_.covariance += shift * shift.transpose();
}

/// Noise of speed and acceleration makes their share of the torque smaller, and where the torque answers to
/// the measured position, as in a closed loop, goes with what is left of it.
void Fit::add_noise_of_motion(const Eigen::MatrixXd& white) {
  const auto [acceleration, speed] = signals_.noise_of_motion();
  const double left = signals_.answer() * rms(residuals()), rows = double(torque_.size());
  for (const auto& [i, noise] : {std::pair(kInertia, acceleration), std::pair(kViscous, speed)}) {
    const Eigen::VectorXd shift =
        white.col(i) * (rows * noise * (left + std::fabs(p_[i]) * noise) / (sigma_ * sigma_));
    fit_.covariance += kReach * kReach * shift * shift.transpose();
  }
}

/// By how much the values move where an effect that the rig does not declare is fitted as well and is clear.
void Fit::add_lacks() {
  const fit::NonlinearOptions options = wide_steps();
  Eigen::VectorXd start = Eigen::VectorXd::Zero(kUnknowns + 1), scale = start;
  start.head(kUnknowns) = p_;
  scale.head(kUnknowns) = scale_;
  for (const Lack lack : kLacks) {
    const auto f = [&](const Eigen::VectorXd& p) {
      Eigen::VectorXd out = rows(p.head(kUnknowns));
      out.head(torque_.size()) -= p[kUnknowns] / sigma_ * column(lack, p);
      return out;
    };
    scale[kUnknowns] = spread(torque_) / rms(column(lack, p_));
    signal::LeastSquaresFit wider;
    try {
      wider = fit::fit_nonlinear(f, start, scale, options);
    } catch (const CannotIdentify&) {
      continue;  // the record does not distinguish the two
    }
    const signal::Measured strength = wider.parameter(kUnknowns);
    if (!(std::fabs(strength.value) > kClear * strength.standard_error)) continue;
    lacking_.push_back(lack_name(lack));
    const Eigen::VectorXd moved = wider.values.head(kUnknowns) - p_;
    fit_.covariance += moved * moved.transpose();
  }
}

/// N m, root mean square of what is left that is no noise: beyond the floor where that is clear, else what
/// follows position or speed from one part of the record to the others.
double Fit::systematic(double floor) const {
  const Eigen::VectorXd left = residuals();
  const double size = rms(left);
  if (size > kShowsMissingEffect * floor) return std::sqrt(size * size - floor * floor);
  const Eigen::MatrixXd features = signals_.states(kStates);
  std::vector<int> block;
  for (Eigen::Index i = 0; i < left.size(); ++i) block.push_back(int(i * kParts / left.size()));
  signal::BlockRegressionSettings settings;
  settings.draws = kDraws;
  const signal::PredictedShare share = signal::predicted_share(features, left, block, settings);
  const bool clear = share.lower > 0 && share.value > share.chance;
  return clear ? std::sqrt(share.value) * size : 0;
}

/// A signal of that size that the model lacks moves a value by no more than |signal| |row of the
/// pseudo-inverse| (Cauchy and Schwarz).
void Fit::allow_for_left(const Eigen::MatrixXd& white, double floor) {
  const double beyond = kReach * std::sqrt(double(torque_.size())) * systematic(floor) / sigma_;
  if (beyond > 0) widen(beyond * beyond * white.diagonal());
}

signal::Measured with_error(double value, double variance) {
  return {value, std::sqrt(variance)};
}

/// The mesh that the terms act on; flanks that overlap count as no gap.
model::Rig as_fitted(model::Rig rig, const Eigen::VectorXd& p) {
  const LockedMesh mesh = mesh_of(p);
  model::ContactSpec spec = rig.mesh.contact_spec();
  spec.values["stiffness"] = mesh.stiffness;
  rig.mesh.contact = model::make_contact_law(spec.law, spec.values);
  rig.mesh.backlash = std::max(0.0, mesh.plus - mesh.minus) * rig.mesh.lever();
  rig.motor.coulomb_friction = std::max(0.0, p[kCoulomb]);
  rig.motor.viscous_damping = std::max(0.0, p[kViscous] - rig.pinion.viscous_damping);
  return rig;
}

void fill(const Fit& fit, const LockedSignals& signals, const model::Rig& rig, double floor,
          LockedOutput& out) {
  const Eigen::VectorXd& p = fit.values();
  const Eigen::MatrixXd& v = fit.covariance();
  const auto value = [&](Eigen::Index i) { return with_error(p[i], v(i, i)); };
  out.inertia = value(kInertia);
  out.viscous = value(kViscous);
  out.viscous.value -= rig.pinion.viscous_damping;
  out.coulomb = value(kCoulomb);
  out.offset = value(kOffset);
  out.stiffness = value(kStiffness);
  out.backlash_angle =
      with_error(p[kPlus] - p[kMinus], v(kPlus, kPlus) + v(kMinus, kMinus) - 2 * v(kPlus, kMinus));
  out.centre = mesh_of(p).centre();
  out.drift = value(kDrift);
  out.cutoff = signals.cutoff();
  out.interval = signals.data().interval;
  const double size = spread(fit.torque());
  out.relative_error = rms(fit.residuals()) / size;
  out.floor = floor / size;
  const Eigen::VectorXd predicted = fit.predicted(), &measured = fit.whole_torque();
  out.measured.assign(measured.begin(), measured.end());
  out.predicted.assign(predicted.begin(), predicted.end());
  out.counts = signals.counts();
}

}  // namespace

LockedOutput identify_locked_output(const record::Record& record, const model::Rig& declared) {
  const LockedSignals signals(record, declared);
  const double passes = 2 * signals.middle() / time_between_reversals(signals.data());
  model::Rig rig = declared;
  Fit fit(signals, rig, passes);
  fit.start();
  for (int round = 0; round < (rig.terms.empty() ? 1 : kRounds); ++round) {
    fit.refine();
    rig = as_fitted(rig, fit.values());
    fit.take_torque(mesh_of(fit.values()));
  }
  for (const bool plus : {true, false})
    if (fit.share_beyond(plus) < kLeastOnFlank)
      throw CannotIdentify(
          fmt::format("{}: the flank that holds {} torque is touched in {:.2g} % of the samples in which the "
                      "motor slides",
                      record.name, plus ? "positive" : "negative", 100 * fit.share_beyond(plus)));
  const double floor =
      noise_floors(rig, signals.data(), record_noise(signals.data()), {}, signals.cutoff(), 0).torque;
  fit.judge(floor);
  LockedOutput out;
  fill(fit, signals, rig, floor, out);
  if (!fit.lacking().empty())
    out.warnings.push_back(record.name + ": what is left looks like " + joined(fit.lacking()) +
                           ", which the rig file lacks; the errors hold that");
  if (fit.chatters())
    out.warnings.push_back(record.name +
                           ": the torque jumps from sample to sample and the motor with it: dry friction is "
                           "shaken off, and friction can hardly be estimated");
  const signal::Measured& stiffness = fit.known_stiffness();
  if (!(stiffness.value > kClearStiffness * stiffness.standard_error) || out.relative_error > kMostLeft)
    throw CannotIdentify(
        fmt::format("{}: torque hardly follows the position: stiffness {:.3g} +- {:.2g}, {:.3g} % of the "
                    "torque unexplained",
                    record.name, stiffness.value, stiffness.standard_error, 100 * out.relative_error));
  return out;
}

}  // namespace backlash::identification
