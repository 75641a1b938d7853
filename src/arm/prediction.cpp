// SPDX-License-Identifier: BSD-3-Clause
// The part of fit.h that looks at motions with a fit that is done.
#include <cmath>

#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "fit_model.h"
#include "joint_effects.h"

namespace backlash::arm {

State state_of(const ArmFit& fit, const FitFreedom& freedom) {
  State state = FitModel(fit.rig, freedom).start();
  if (freedom.tilt) state.tilt = {fit.tilt[0].value, fit.tilt[1].value};
  for (std::size_t s = 0; s < state.payloads.size() && s < fit.states.size(); ++s) {
    const FittedState& own = fit.states[s];
    state.payloads[s] = freedom.payload_sign * own.payload;
    for (std::size_t j = 0; freedom.friction && j < own.friction_factors.size(); ++j)
      state.friction(Eigen::Index(j), Eigen::Index(s)) = std::log(own.friction_factors[j].value),
                                      state.shift(Eigen::Index(j), Eigen::Index(s)) = own.shifts[j];
  }
  for (std::size_t i = 0; i < state.effects.size(); ++i) state.effects[i] = fit.effects[i].effect;
  return state;
}

Prediction predict(const ArmFit& fit, const FitFreedom& freedom, const FittedMotion& motion) {
  const FitModel model(fit.rig, freedom);
  const std::vector<Linearised> all = model.linearised(state_of(fit, freedom), motion);
  const auto rows = Eigen::Index(motion.motion->rows.size());
  Prediction out{Eigen::MatrixXd(rows, Eigen::Index(all.size())),
                 Eigen::MatrixXd(rows, Eigen::Index(all.size()))};
  for (std::size_t j = 0; j < all.size(); ++j) {
    out.measured.col(Eigen::Index(j)) = all[j].measured;
    out.predicted.col(Eigen::Index(j)) = all[j].predicted;
  }
  return out;
}

std::vector<double> relative_errors(const ArmFit& fit, const FitFreedom& freedom,
                                    const std::vector<FittedMotion>& motions, double least_seconds) {
  const std::size_t joints = fit.rig.joints.size();
  std::vector<double> count(joints, 0), sum(joints, 0), squares(joints, 0), residual(joints, 0),
      seconds(joints, 0);
  for (const FittedMotion& m : motions) {
    const Prediction p = predict(fit, freedom, m);
    for (std::size_t j = 0; j < joints; ++j) {
      seconds[j] += moving_seconds(*m.motion, j);
      const auto c = Eigen::Index(j);
      for (Eigen::Index k = 0; k < p.measured.rows(); ++k) {
        if (!m.motion->counts(k, c)) continue;
        const double s = p.measured(k, c), r = s - p.predicted(k, c);
        count[j] += 1, sum[j] += s, squares[j] += s * s, residual[j] += r * r;
      }
    }
  }
  std::vector<double> errors;
  for (std::size_t j = 0; j < joints; ++j)
    errors.push_back(seconds[j] >= least_seconds
                         ? std::sqrt(residual[j] / (squares[j] - sum[j] * sum[j] / count[j]))
                         : kNaN);
  return errors;
}

namespace {

/// Variance of what couplings bring of other drives, whose torques are as well known as they are predicted;
/// at rest to their dry friction.
double of_couplings(const ArmFit& fit, const FitFreedom& freedom, const FittedMotion& m, std::size_t j,
                    Eigen::Index row) {
  double sum = 0;
  for (std::size_t e = 0; e < freedom.effects.size(); ++e) {
    const FreeEffect& free = freedom.effects[e];
    if (free.joint != j || !is_coupling(free.effect) || (!free.everywhere && !m.marked())) continue;
    const std::size_t i = *index_of(fit.rig, free.effect.other);
    const JointDrive& other = fit.rig.joints[i];
    const double torque = m.motion->counts(row, Eigen::Index(i))
                              ? other.constant * fit.deviation[i]
                              : other.terms[std::size_t(DriveTerm::coulomb)];
    if (std::isfinite(torque))
      sum += std::pow(fit.effects[e].effect.values[0] * torque / fit.rig.joints[j].constant, 2);
  }
  return sum;
}

}  // namespace

std::vector<double> expected_errors(const ArmFit& fit, const FitFreedom& freedom,
                                    const std::vector<FittedMotion>& motions, double least_seconds) {
  const std::size_t joints = fit.rig.joints.size();
  const FitModel model(fit.rig, freedom);
  std::vector<double> count(joints, 0), sum(joints, 0), squares(joints, 0), expected(joints, 0),
      seconds(joints, 0);
  for (const FittedMotion& m : motions) {
    const std::vector<Linearised> all = model.linearised(state_of(fit, freedom), m);
    for (std::size_t j = 0; j < joints; ++j) {
      seconds[j] += moving_seconds(*m.motion, j);
      const std::vector<Eigen::Index>& at = all[j].unknowns;
      const auto n = Eigen::Index(at.size());
      Eigen::MatrixXd covariance(n, n);
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index k = 0; k < n; ++k)
          covariance(i, k) = fit.covariance(at[std::size_t(i)], at[std::size_t(k)]);
      const Eigen::MatrixXd spread = signal::product(all[j].sensitivity, covariance);
      for (Eigen::Index k = 0; k < spread.rows(); ++k) {
        if (!m.motion->counts(k, Eigen::Index(j))) continue;
        const double s = all[j].measured[k];
        count[j] += 1, sum[j] += s, squares[j] += s * s;
        expected[j] += fit.deviation[j] * fit.deviation[j] + spread.row(k).dot(all[j].sensitivity.row(k)) +
                       of_couplings(fit, freedom, m, j, k);
      }
    }
  }
  std::vector<double> errors;
  for (std::size_t j = 0; j < joints; ++j)
    errors.push_back(seconds[j] >= least_seconds
                         ? std::sqrt(expected[j] / (squares[j] - sum[j] * sum[j] / count[j]))
                         : kNaN);
  return errors;
}

}  // namespace backlash::arm
