// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_windows.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace backlash::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What is known of the values: choices, two of them are the 95 % of servos declared within 40 % and more.
constexpr double kKnownGap = 3, kKnownStiffness = 0.35, kKnownDamping = 0.7, kKnownInertia = 0.3,
                 kKnownFriction = 0.5, kKnownPower = 0.2;
constexpr double kNoFriction = 0.1;              // of the level, where none is declared
constexpr double kHeld = 0.5, kKnownHeld = 0.3;  // samples, of a torque that is held: theory, choice
constexpr double kKnownLag = 1e-3;               // s, of a current loop: choice
constexpr double kPower = 1.22;  // theory: in the middle between lines (1) and points (1.5, Hertz) that touch
constexpr double kDampingPower = 0.75,
                 kKnownDampingPower = 0.5;  // theory: from a damper (0) to Hunt and Crossley's (1.5)
constexpr double kUsualHardening = 0.15, kKnownHardening = 1;  // choice: 0.05 to 0.4
// Theory: Hertz's flanks fitted by lines move the gap by 0.30 of the deflection, and leave 0.0327 rms.
constexpr double kLawOfLeft = 0.30 / 0.0327;
constexpr double kEccentricity = 2e-4;          // rad, of an encoder's disk: 5 um of a radius of 25 mm
constexpr double kSkew = 1e-3;                  // s, of the load's encoder: choice
constexpr double kStartSpread[] = {0.5, 5e-2};  // of the deflection, of the rms speed's scale: choice
constexpr double kSlowTorque = 0.05;            // of the level, a torque that nothing shows: choice
constexpr double kSlowTime = 0.4;               // windows, within which it changes: choice
constexpr double kLeastNoise = 0.1;             // of the torque's variance, white whatever else is: choice
constexpr double kFastPart = 8;                 // the position counts as so many times noisier: simulation
constexpr double kUnexplained = 0.1;            // of the level: a torque on the motor that nothing else shows
constexpr double kUnexplainedLoad = 0.5;        // the same on the load: gravity

fit::Priors shared_priors(const TraverseData& data, const GapTraverseSettings& s) {
  const auto friction = [&](const char* name, double declared, double scale) {
    return declared > 0 ? fit::Prior{name, declared, kKnownFriction, true}
                        : fit::Prior{name, 0, kNoFriction * data.level / scale, false};
  };
  const double speed = data.slow * 100;  // rms
  fit::Priors p(kTraverseValues);
  p[kTraverseGap] = {"gap", std::max(s.gap, data.level / s.flank.stiffness), kKnownGap, true};
  p[kTraverseStiffness] = {"stiffness of the mesh", s.flank.stiffness, kKnownStiffness, true};
  p[kTraverseDamping] = {"damping of the mesh", s.flank.damping, kKnownDamping, true};
  p[kTraverseLoadInertia] = {"inertia of the load", s.load_inertia, kKnownInertia, true};
  p[kTraverseMotorInertia] = {"inertia of the motor", s.motor_inertia, kKnownInertia, true};
  p[kTraverseMotorDamping] = friction("damping of the motor", s.motor_damping, speed);
  p[kTraverseMotorFriction] = friction("dry friction of the motor", s.motor_friction, 1);
  p[kTraverseLoadFriction] = friction("dry friction of the load", s.load_friction, 1);
  p[kTraverseLoadDamping] = friction("damping of the load", s.load_damping, speed);
  p[kTraverseLoadTerms] = {"declared torque on the load", 1, s.load_torque ? kKnownInertia : 0, true};
  const double unknown = unknown_law(data, s), known = 1 - unknown;  // between the declared law and any
  p[kTraversePower] = {"power of the torque of the teeth over the deflection",
                       std::pow(s.flank.power, known) * std::pow(kPower, unknown), unknown * kKnownPower,
                       true};
  p[kTraverseHardening] = {"hardening of the teeth", unknown * kUsualHardening, unknown * kKnownHardening,
                           true};
  p[kTraverseDampingPower] = {"power of the damping over the deflection",
                              known * s.flank.damping_power + unknown * kDampingPower,
                              unknown * kKnownDampingPower, false};
  p[kTraverseLate] = {"delay of the torque", kHeld, std::max(kKnownHeld, kKnownLag / data.interval), false};
  for (int n = 0; n < kTorqueWaves; ++n)
    p[std::size_t(kTraverseWave) + std::size_t(n)] = {
        "wave of the motor's torque", 0, data.waves[n].empty() ? 0 : kUnexplained * data.level, false};
  p[kTraverseSkew] = {"skew of the load's encoder", 0, kSkew, false};
  p[kTraverseZero] = {"zero of the load's encoder", 0, data.width, false};
  p[kTraverseSine] = {"sine of the load encoder's angle", 0, kEccentricity, false};
  p[kTraverseCosine] = {"cosine of the load encoder's angle", 0, kEccentricity, false};
  // Of the motion of the load only ratios to its inertia are seen, and of the motor nothing.
  const bool by_load = !data.load.empty();
  for (const int ratio : {kTraverseStiffness, kTraverseDamping, kTraverseLoadFriction, kTraverseLoadDamping,
                          kTraverseLoadTerms})
    if (fit::Prior& prior = p[std::size_t(ratio)]; by_load && prior.factor && prior.spread > 0)
      prior.spread = std::hypot(prior.spread, kKnownInertia);
  for (const int unseen : {kTraverseLoadInertia, kTraverseMotorInertia, kTraverseMotorDamping,
                           kTraverseMotorFriction, kTraverseLate})
    if (by_load) p[std::size_t(unseen)].spread = 0;
  for (const int unseen : {kTraverseSkew, kTraverseZero, kTraverseSine, kTraverseCosine})
    if (!by_load) p[std::size_t(unseen)].spread = 0;
  return p;
}

fit::Priors own_priors(const TraverseData& data, const GapTraverseSettings& s) {
  const double deflection = 1 / s.flank.stiffness, speed = data.slow * 100;
  fit::Priors p(kTraverseOwn);
  const bool by_load = !data.load.empty();
  // Without the load's encoder what a window knows of its start comes from the torque there, with its noise.
  p[kOwnPosition] = {"position", 0,
                     by_load ? 0 : std::hypot(kStartSpread[0] * data.level, data.noise) * deflection, false};
  p[kOwnRate] = {
      "rate", 0,
      std::hypot(kStartSpread[1] * speed, by_load ? data.load_rate_noise : data.slope_noise * deflection),
      false};
  p[kOwnMotorTorque] = {"torque on the motor", 0, by_load ? 0 : kUnexplained * data.level, false};
  p[kOwnLoadTorque] = {"torque on the load", 0,
                       by_load ? data.load_torque_spread : kUnexplainedLoad * data.level, false};
  p[kOwnShown] = {"error of the load's encoder", 0, by_load ? data.shown_spread : 0, false};
  return p;
}

}  // namespace

double unknown_law(const TraverseData& data, const GapTraverseSettings& s) {
  if (std::isnan(s.unexplained)) return 1;
  return std::min(1.0, kLawOfLeft * s.unexplained / (kUnknownLaw * data.level / s.flank.stiffness));
}

TraverseWindows::TraverseWindows(const TraverseData& data, const GapTraverseSettings& settings,
                                 std::vector<TraverseWindow> windows, double part)
    : data_(data),
      windows_(std::move(windows)),
      shared_(shared_priors(data, settings)),
      own_(own_priors(data, settings)) {
  for (const TraverseWindow& window : windows_) weights_.push_back(weights_of(window, part));
}

/// What is left of a torque has three parts: its noise, of which two samples are averaged; that of the
/// position, which two differences make large and fast; and a slow torque that nothing shows. The noise of
/// the position comes in as a factor of the motor's inertia, which would be fitted too small where it counted
/// as much as it is: its fast part is all but left out.
TraverseWindows::Weights TraverseWindows::weights_of(const TraverseWindow& window, double part) const {
  Weights w;
  const auto samples = Index(std::lround(part * double(data_.samples)));
  if (by_load()) {
    for (Index k = 0; k < samples; ++k)
      if (data_.load_counts[window.first + std::size_t(k)]) w.counted.push_back(k);
    w.of_noise = double(w.counted.size());
    return w;
  }
  const double differences =
      shared_[kTraverseMotorInertia].centre * data_.position_noise / (data_.interval * data_.interval);
  const double white = data_.torque_noise * data_.torque_noise, blue = differences * differences,
               slow = kSlowTorque * data_.level * kSlowTorque * data_.level;
  const double kBlue[] = {6, -4, 1}, kHeldNoise[] = {0.5, 0.25, 0};
  for (Index k = 1; k + 1 < samples; ++k)
    if (data_.counts[window.first + std::size_t(k)]) w.counted.push_back(k);
  const auto count = Index(w.counted.size());
  MatrixXd own_noise(count, count), all(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index k = 0; k < count; ++k) {
      const auto apart = std::size_t(std::abs(w.counted[std::size_t(i)] - w.counted[std::size_t(k)]));
      const double held = apart < 3 ? kHeldNoise[apart] * white : 0,
                   fast = apart < 3 ? kBlue[apart] * blue : 0;
      own_noise(i, k) = held + fast;
      all(i, k) = held + kFastPart * kFastPart * fast +
                  slow * std::exp(-double(apart) / (kSlowTime * double(data_.samples)));
    }
  all.diagonal().array() += kLeastNoise * white + 1e-9 * all(0, 0);
  w.deviation = all.llt().matrixL();
  const MatrixXd half = w.deviation.triangularView<Eigen::Lower>().solve(own_noise);
  w.of_noise = w.deviation.triangularView<Eigen::Lower>().solve(half.transpose()).trace();
  return w;
}

bool TraverseWindows::moves_load(int value) const {
  if (value >= kTraverseWave && value <= kTraverseLastWave) return false;
  switch (value) {
    case kTraverseMotorInertia:
    case kTraverseMotorDamping:
    case kTraverseMotorFriction:
    case kTraverseLate:
    case kTraverseValues + kOwnMotorTorque:
      return false;
    case kTraverseSkew:
    case kTraverseZero:
    case kTraverseSine:
    case kTraverseCosine:
    case kTraverseValues + kOwnShown:
      return by_load();
    default:
      return true;
  }
}

TraverseRun TraverseWindows::run_of(int w, const MatrixXd& shared, const MatrixXd& own, Index column) const {
  TraverseRun run;
  run.window = &windows_[std::size_t(w)];
  for (int k = 0; k < kTraverseValues; ++k) {
    const fit::Prior& p = shared_[std::size_t(k)];
    const double value = p.value(shared(k, column));
    run.machine[std::size_t(k)] = p.factor || k >= kTraverseLate ? value : std::max(0.0, value);
  }
  for (int k = 0; k < kTraverseOwn; ++k) run.own[k] = own_[std::size_t(k)].value(own(k, column));
  return run;
}

VectorXd TraverseWindows::teeth(int w, const VectorXd& shared, const VectorXd& own) const {
  return traverse_motion(data_, {run_of(w, shared, own, 0)}).teeth.col(0);
}

VectorXd TraverseWindows::torque_left(int w, const VectorXd& shared, const VectorXd& own,
                                      std::vector<std::size_t>* samples) const {
  const TraverseRun run = run_of(w, shared, own, 0);
  const VectorXd left = traverse_residual(data_, run, traverse_motion(data_, {run}).teeth.col(0));
  const std::vector<Index>& counted = weights_[std::size_t(w)].counted;
  for (const Index k : counted) samples->push_back(run.window->first + std::size_t(k));
  return left(counted);
}

MatrixXd TraverseWindows::residuals(int w, const MatrixXd& shared, const MatrixXd& own) const {
  const Weights& weights = weights_[std::size_t(w)];
  std::vector<TraverseRun> runs, moved;
  std::vector<Index> of;  // of each column: which of those that are moved, as many share a motion
  for (Index c = 0; c < shared.cols(); ++c) {
    runs.push_back(run_of(w, shared, own, c));
    bool same = c > 0;
    for (int k = 0; k < kTraverseValues + kTraverseOwn && same; ++k)
      same = !moves_load(k) ||
             (k < kTraverseValues ? shared(k, c) == shared(k, 0)
                                  : own(k - kTraverseValues, c) == own(k - kTraverseValues, 0));
    of.push_back(same ? 0 : Index(moved.size()));
    if (!same) moved.push_back(runs.back());
  }
  const TraverseMotion motion = traverse_motion(data_, moved);
  MatrixXd left(Index(weights.counted.size()), shared.cols());
  for (Index c = 0; c < shared.cols(); ++c) {
    const TraverseRun& run = runs[std::size_t(c)];
    const Index m = of[std::size_t(c)];
    const VectorXd all = by_load() ? load_residual(data_, run, motion.position.col(m), motion.rate.col(m))
                                   : traverse_residual(data_, run, motion.teeth.col(m));
    left.col(c) = all(weights.counted);
  }
  if (by_load())
    left /= data_.load_noise;
  else
    weights.deviation.triangularView<Eigen::Lower>().solveInPlace(left);
  return left / noise;
}

}  // namespace backlash::diagnosis
