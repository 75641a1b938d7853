// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/friction_turn.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"

namespace backlash::arm {
namespace {

constexpr double kOctaves[] = {1 / 8.0, 1 / 4.0, 1 / 2.0, 2};  // of the rig's v_0; choice
// Of teeth and bearings, 0.02 mm at a radius of 0.02 to 0.4 m; what takes a longer path is an effect that is
// missing. Choice.
constexpr double kPaths[] = {5e-5, 1e-4, 2e-4, 4e-4, 8e-4};  // rad
// Standard errors, of what blocks of time leave less; choice: of 180 joints of drawn arms whose friction
// turns as declared none is given another turn.
constexpr double kClearly = 3;

void take(const FrictionTurn& turn, JointDrive& joint) {
  joint.friction_speed = turn.speed;
  joint.friction_distance = turn.distance;
}

/// Squares that a joint leaves in each block of time, its drive's terms and its delay fitted anew.
Eigen::VectorXd squares_left(std::size_t joint, const std::vector<ArmMotion>& motions,
                             const std::vector<std::vector<Linearised>>& all, const ArmRig& rig,
                             double block) {
  const auto j = Eigen::Index(joint), drive = 10 * Eigen::Index(rig.joints.size());
  const Eigen::Index terms = Eigen::Index(rig.terms.size());
  Eigen::Index rows = 0;
  for (const ArmMotion& m : motions) rows += m.counts.col(j).cast<Eigen::Index>().sum();
  Eigen::MatrixXd columns(rows, terms + 1);
  Eigen::VectorXd residual(rows);
  std::vector<Eigen::Index> blocks;
  Eigen::Index row = 0, number = 0;
  for (std::size_t i = 0; i < motions.size(); ++i, ++number) {
    const ArmMotion& m = motions[i];
    const Linearised& l = all[i][joint];
    double begin = m.rows.empty() ? 0 : m.time[m.rows.front()];
    for (Eigen::Index k = 0; k < m.counts.rows(); ++k) {
      const double t = m.time[m.rows[std::size_t(k)]];
      if (t >= begin + block) begin = t, ++number;
      if (!m.counts(k, j)) continue;
      for (Eigen::Index c = 0; c < terms; ++c)
        columns(row, c) = l.sensitivity(k, drive + Eigen::Index(rig.terms[std::size_t(c)]));
      columns(row, terms) = l.sensitivity(k, drive + Eigen::Index(kDriveTerms) + 1);
      residual[row++] = l.measured[k] - l.predicted[k];
      blocks.push_back(number);
    }
  }
  Eigen::MatrixXd h = signal::gram(columns);
  h.diagonal() += (1e-9 * h.diagonal()).array().max(1e-300).matrix();  // terms that follow from others
  const Eigen::VectorXd step = signal::solve_symmetric(h, Eigen::VectorXd(columns.transpose() * residual));
  const Eigen::VectorXd left = residual - columns * step;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(number);
  for (Eigen::Index k = 0; k < left.size(); ++k) squares[blocks[std::size_t(k)]] += left[k] * left[k];
  return squares;
}

/// Of each joint.
std::vector<Eigen::VectorXd> squares_left(const ArmFit& fit, std::vector<ArmMotion>& motions,
                                          const std::vector<FrictionTurn>& turns, double block) {
  ArmRig rig = fit.rig;
  for (std::size_t j = 0; j < turns.size(); ++j) take(turns[j], rig.joints[j]);
  const FitModel model(rig, {});
  const State state = state_of(fit, {});
  std::vector<std::vector<Linearised>> all;
  for (ArmMotion& m : motions) {
    set_friction_turns(m, rig);
    all.push_back(model.linearised(state, {&m, false}));
  }
  std::vector<Eigen::VectorXd> squares;
  for (std::size_t j = 0; j < turns.size(); ++j) squares.push_back(squares_left(j, motions, all, rig, block));
  return squares;
}

/// By more than what the blocks scatter by.
bool clearly_less(const Eigen::VectorXd& left, const Eigen::VectorXd& declared) {
  const Eigen::ArrayXd gain = declared - left;
  return gain.sum() > kClearly * std::sqrt((gain - gain.mean()).square().sum());
}

}  // namespace

std::vector<FrictionTurn> friction_turns(const ArmFit& fit, std::vector<ArmMotion>& motions,
                                         const FitSettings& settings) {
  std::vector<FrictionTurn> declared;
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j)
    declared.push_back({fit.rig.friction_speed(j), fit.rig.joints[j].friction_distance});
  std::vector<FrictionTurn> best = declared;
  const std::vector<Eigen::VectorXd> before = squares_left(fit, motions, declared, settings.block);
  std::vector<Eigen::VectorXd> least = before;
  const auto look = [&](const std::function<void(FrictionTurn&)>& change) {
    std::vector<FrictionTurn> turns = declared;
    for (FrictionTurn& turn : turns) change(turn);
    const std::vector<Eigen::VectorXd> left = squares_left(fit, motions, turns, settings.block);
    for (std::size_t j = 0; j < turns.size(); ++j)
      if (left[j].sum() < least[j].sum() && clearly_less(left[j], before[j]))
        least[j] = left[j], best[j] = turns[j];
  };
  for (const double octave : kOctaves) look([&](FrictionTurn& turn) { turn.speed *= octave; });
  for (const double path : kPaths) look([&](FrictionTurn& turn) { turn.distance = path; });
  for (ArmMotion& m : motions) set_friction_turns(m, fit.rig);
  return best;
}

ArmFit fit_arm_and_friction_turns(ArmRig& rig, std::vector<ArmMotion>& motions, const FitSettings& settings,
                                  const Progress& progress) {
  std::vector<FittedMotion> fitted;
  for (const ArmMotion& m : motions) fitted.push_back({&m, false});
  ArmFit fit = fit_arm(rig, fitted, {}, settings, progress);
  const std::vector<FrictionTurn> turns = friction_turns(fit, motions, settings);
  std::vector<std::string> words;
  for (std::size_t j = 0; j < turns.size(); ++j) {
    const FrictionTurn declared{rig.friction_speed(j), rig.joints[j].friction_distance};
    if (turns[j].distance != declared.distance)
      words.push_back(fmt::format(
          "friction of {} builds up over {:.2g} rad after each reversal (presliding), not {} as declared",
          rig.joints[j].name, turns[j].distance, to_text(declared.distance)));
    else if (turns[j].speed != declared.speed)
      words.push_back(fmt::format("friction of {} turns its sign within {:.3g} rad/s, not {:.3g} as declared",
                                  rig.joints[j].name, turns[j].speed, declared.speed));
    if (turns[j].distance != declared.distance || turns[j].speed != declared.speed)
      take(turns[j], rig.joints[j]);
  }
  if (words.empty()) return fit;
  for (ArmMotion& m : motions) set_friction_turns(m, rig);
  fit = fit_arm(rig, fitted, {}, settings, progress);
  fit.warnings.insert(fit.warnings.end(), words.begin(), words.end());
  return fit;
}

}  // namespace backlash::arm
