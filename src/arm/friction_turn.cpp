// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/friction_turn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"
#include "joint_effects.h"

namespace backlash::arm {
namespace {

constexpr double kOctaves[] = {1, 1 / 8.0, 1 / 4.0, 1 / 2.0, 2};  // of the rig's v_0; choice
// Of teeth and bearings, 0.02 mm at a radius of 0.02 to 0.4 m; what takes a longer path is an effect that is
// missing. Choice.
constexpr double kPaths[] = {5e-5, 1e-4, 2e-4, 4e-4, 8e-4};  // rad
constexpr double kClearly = 3;  // standard errors, of what blocks of time leave less; choice

JointEffect presliding(const FrictionTurn& turn) {
  return {"presliding", turn.distance, "", {turn.torque, 0}};
}

bool has_path(const JointDrive& drive) {
  return std::any_of(drive.effects.begin(), drive.effects.end(),
                     [](const JointEffect& e) { return e.id == "presliding"; });
}

/// One joint in all motions: what is free of its drive, and what is left beside it.
struct DriveColumns {
  Eigen::MatrixXd columns;
  Eigen::VectorXd residual;
  std::vector<Eigen::Index> blocks;  // of the rows, in order
};

class Turns {
 public:
  Turns(const ArmFit& fit, std::vector<ArmMotion>& motions, const FitSettings& settings)
      : fit_(fit), motions_(motions), settings_(settings), state_(state_of(fit, {})) {}
  ~Turns() {
    for (ArmMotion& m : motions_) set_friction_speeds(m, fit_.rig);
  }

  /// Squares that each joint leaves in each block; with a path the turns get its torque.
  std::vector<Eigen::VectorXd> left(std::vector<FrictionTurn>& turns);

 private:
  DriveColumns columns_of(std::size_t joint, const FitModel& model,
                          const std::vector<std::vector<Linearised>>& all, const FrictionTurn& turn) const;

  const ArmFit& fit_;
  std::vector<ArmMotion>& motions_;
  const FitSettings& settings_;
  const State state_;
};

DriveColumns Turns::columns_of(std::size_t joint, const FitModel& model,
                               const std::vector<std::vector<Linearised>>& all,
                               const FrictionTurn& turn) const {
  const std::vector<DriveTerm>& terms = fit_.rig.terms;
  const auto j = Eigen::Index(joint), drive = 10 * Eigen::Index(fit_.rig.joints.size());
  Eigen::Index rows = 0;
  for (const ArmMotion& m : motions_) rows += m.counts.col(j).cast<Eigen::Index>().sum();
  DriveColumns out{Eigen::MatrixXd(rows, Eigen::Index(terms.size()) + 1), Eigen::VectorXd(rows), {}};
  Eigen::Index row = 0, block = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i, ++block) {
    const ArmMotion& m = motions_[i];
    const Linearised& l = all[i][joint];
    Eigen::VectorXd builds_up = Eigen::VectorXd::Zero(l.measured.size());
    if (turn.distance > 0)
      builds_up = model.effect_at_rows(state_, presliding(turn), joint, m,
                                       Eigen::MatrixXd::Zero(m.q.rows(), m.q.cols()), {});
    double begin = m.time[m.rows.front()];
    for (Eigen::Index k = 0; k < m.counts.rows(); ++k) {
      const double t = m.time[m.rows[std::size_t(k)]];
      if (t >= begin + settings_.block) begin = t, ++block;
      if (!m.counts(k, j)) continue;
      for (std::size_t c = 0; c < terms.size(); ++c)
        out.columns(row, Eigen::Index(c)) = l.sensitivity(k, drive + Eigen::Index(terms[c])) +
                                            (terms[c] == DriveTerm::coulomb ? builds_up[k] : 0);
      out.columns(row, out.columns.cols() - 1) = l.sensitivity(k, drive + Eigen::Index(kDriveTerms) + 1);
      const double coulomb = state_.drives(j, Eigen::Index(DriveTerm::coulomb));
      out.residual[row++] = l.measured[k] - l.predicted[k] - coulomb * builds_up[k];
      out.blocks.push_back(block);
    }
  }
  return out;
}

std::vector<Eigen::VectorXd> Turns::left(std::vector<FrictionTurn>& turns) {
  ArmRig rig = fit_.rig;
  for (std::size_t j = 0; j < turns.size(); ++j) rig.joints[j].friction_speed = turns[j].speed;
  const FitModel model(rig, {});
  std::vector<std::vector<Linearised>> all;
  for (ArmMotion& m : motions_) {
    set_friction_speeds(m, rig);
    all.push_back(model.linearised(state_, {&m, false}));
  }
  const auto coulomb = std::find(rig.terms.begin(), rig.terms.end(), DriveTerm::coulomb) - rig.terms.begin();
  std::vector<Eigen::VectorXd> squares;
  for (std::size_t j = 0; j < turns.size(); ++j) {
    FrictionTurn unit = turns[j];
    unit.torque = 1;
    const DriveColumns own = columns_of(j, model, all, unit);
    Eigen::MatrixXd h = signal::gram(own.columns);
    h.diagonal() += (1e-9 * h.diagonal()).array().max(1e-300).matrix();  // terms that follow from others
    const Eigen::VectorXd step =
        signal::solve_symmetric(h, Eigen::VectorXd(own.columns.transpose() * own.residual));
    const Eigen::VectorXd left = own.residual - own.columns * step;
    squares.push_back(Eigen::VectorXd::Zero(own.blocks.empty() ? 0 : own.blocks.back() + 1));
    for (Eigen::Index k = 0; k < left.size(); ++k)
      squares.back()[own.blocks[std::size_t(k)]] += left[k] * left[k];
    if (turns[j].distance > 0)
      turns[j].torque = state_.drives(Eigen::Index(j), Eigen::Index(DriveTerm::coulomb)) + step[coulomb];
  }
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
  const std::size_t joints = fit.rig.joints.size();
  Turns tried(fit, motions, settings);
  std::vector<FrictionTurn> declared(joints);
  for (std::size_t j = 0; j < joints; ++j) declared[j].speed = fit.rig.friction_speed(j);
  std::vector<FrictionTurn> best = declared;
  const std::vector<Eigen::VectorXd> before = tried.left(declared);
  std::vector<Eigen::VectorXd> least = before;
  const auto look = [&](std::vector<FrictionTurn> turns) {
    const std::vector<Eigen::VectorXd> left = tried.left(turns);
    for (std::size_t j = 0; j < joints; ++j) {
      const bool possible = turns[j].distance == 0 || (turns[j].torque > 0 && !has_path(fit.rig.joints[j]));
      if (possible && left[j].sum() < least[j].sum() && clearly_less(left[j], before[j]))
        least[j] = left[j], best[j] = turns[j];
    }
  };
  for (const double octave : kOctaves) {
    std::vector<FrictionTurn> turns = declared;
    for (FrictionTurn& turn : turns) turn.speed *= octave;
    look(turns);
  }
  if (std::find(fit.rig.terms.begin(), fit.rig.terms.end(), DriveTerm::coulomb) == fit.rig.terms.end())
    return best;
  for (const double path : kPaths) {
    std::vector<FrictionTurn> turns = declared;
    for (FrictionTurn& turn : turns) turn.distance = path;
    look(turns);
  }
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
    JointDrive& joint = rig.joints[j];
    if (turns[j].distance > 0) {
      words.push_back(
          fmt::format("friction of {} builds up over {:.2g} rad after each reversal: presliding, "
                      "which the rig file lacks",
                      joint.name, turns[j].distance));
      joint.effects.push_back(presliding(turns[j]));
    } else if (turns[j].speed != rig.friction_speed(j)) {
      words.push_back(fmt::format("friction of {} turns its sign within {:.3g} rad/s, not {:.3g} as declared",
                                  joint.name, turns[j].speed, rig.friction_speed(j)));
      joint.friction_speed = turns[j].speed;
    }
  }
  if (words.empty()) return fit;
  for (ArmMotion& m : motions) set_friction_speeds(m, rig);
  fit = fit_arm(rig, fitted, {}, settings, progress);
  fit.warnings.insert(fit.warnings.end(), words.begin(), words.end());
  return fit;
}

}  // namespace backlash::arm
