// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/friction_speed.h"

#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"

namespace backlash::arm {
namespace {

constexpr double kOctaves[] = {1 / 8.0, 1 / 4.0, 1 / 2.0, 1, 2};  // of the rig's v_0; choice
constexpr std::size_t kDeclared = 3;                              // of these
constexpr double kClearly = 0.1;  // less of the squared error; choice: as of an effect of the chain

/// Squared residuals of each joint, per motion, its drive fitted anew.
std::vector<std::vector<double>> squares_left(const ArmFit& fit, const std::vector<ArmMotion>& motions) {
  const FitModel model(fit.rig, {});
  const State state = state_of(fit, {});
  const std::size_t joints = fit.rig.joints.size();
  std::vector<std::vector<Linearised>> all;
  for (const ArmMotion& m : motions) all.push_back(model.linearised(state, {&m, false}));
  std::vector<std::vector<double>> left(joints, std::vector<double>(motions.size(), 0));
  for (std::size_t j = 0; j < joints; ++j) {
    const auto own = Eigen::Index(fit.rig.terms.size());
    const auto columns = [&](const Linearised& l) {
      Eigen::MatrixXd out(l.sensitivity.rows(), own);
      for (Eigen::Index t = 0; t < own; ++t)
        out.col(t) =
            l.sensitivity.col(10 * Eigen::Index(joints) + Eigen::Index(fit.rig.terms[std::size_t(t)]));
      return out;
    };
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(own, own);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(own);
    std::vector<Eigen::VectorXd> residuals;
    for (std::size_t m = 0; m < motions.size(); ++m) {
      const Eigen::VectorXd counts = motions[m].counts.col(Eigen::Index(j)).cast<double>();
      const Eigen::MatrixXd a = counts.asDiagonal() * columns(all[m][j]);
      residuals.emplace_back(counts.cwiseProduct(all[m][j].measured - all[m][j].predicted));
      h += signal::gram(a), g += a.transpose() * residuals.back();
    }
    h.diagonal() += (1e-9 * h.diagonal()).array().max(1e-300).matrix();  // terms that follow from others
    const Eigen::VectorXd step = signal::solve_symmetric(h, g);
    for (std::size_t m = 0; m < motions.size(); ++m) {
      const Eigen::VectorXd counts = motions[m].counts.col(Eigen::Index(j)).cast<double>();
      left[j][m] =
          (residuals[m] - counts.asDiagonal() * Eigen::VectorXd(columns(all[m][j]) * step)).squaredNorm();
    }
  }
  return left;
}

double sum_of(const std::vector<double>& parts) {
  double sum = 0;
  for (const double part : parts) sum += part;
  return sum;
}

/// Smaller by kClearly, and smaller in every motion.
bool clearly_less(const std::vector<double>& left, const std::vector<double>& declared) {
  for (std::size_t m = 0; m < left.size(); ++m)
    if (declared[m] > 0 && !(left[m] < declared[m])) return false;
  return sum_of(left) < (1 - kClearly) * sum_of(declared);
}

}  // namespace

std::vector<double> friction_speeds(const ArmFit& fit, std::vector<ArmMotion>& motions) {
  std::vector<double> speeds;
  std::vector<std::vector<std::vector<double>>> left;  // per octave, joint and motion
  ArmFit tried = fit;
  for (const double octave : kOctaves) {
    for (std::size_t j = 0; j < fit.rig.joints.size(); ++j)
      tried.rig.joints[j].friction_speed = octave * fit.rig.friction_speed(j);
    for (ArmMotion& m : motions) set_friction_speeds(m, tried.rig);
    left.push_back(squares_left(tried, motions));
  }
  for (ArmMotion& m : motions) set_friction_speeds(m, fit.rig);
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j) {
    std::size_t best = kDeclared;
    for (std::size_t i = 0; i < left.size(); ++i)
      if (clearly_less(left[i][j], left[kDeclared][j]) && sum_of(left[i][j]) < sum_of(left[best][j]))
        best = i;
    speeds.push_back(kOctaves[best] * fit.rig.friction_speed(j));
  }
  return speeds;
}

ArmFit fit_arm_and_friction_speeds(ArmRig& rig, std::vector<ArmMotion>& motions, const FitSettings& settings,
                                   const Progress& progress) {
  std::vector<FittedMotion> fitted;
  for (const ArmMotion& m : motions) fitted.push_back({&m, false});
  ArmFit fit = fit_arm(rig, fitted, {}, settings, progress);
  const std::vector<double> speeds = friction_speeds(fit, motions);
  std::vector<std::string> words;
  for (std::size_t j = 0; j < speeds.size(); ++j) {
    if (speeds[j] == rig.friction_speed(j)) continue;
    words.push_back(fmt::format("friction of {} turns its sign within {:.3g} rad/s, not {:.3g} as declared",
                                rig.joints[j].name, speeds[j], rig.friction_speed(j)));
    rig.joints[j].friction_speed = speeds[j];
  }
  if (words.empty()) return fit;
  for (ArmMotion& m : motions) set_friction_speeds(m, rig);
  fit = fit_arm(rig, fitted, {}, settings, progress);
  fit.warnings.insert(fit.warnings.end(), words.begin(), words.end());
  return fit;
}

}  // namespace backlash::arm
