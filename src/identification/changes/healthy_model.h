// SPDX-License-Identifier: BSD-3-Clause
// Commissioning: the equation of motion of the healthy machine, with the spread of its values.
#pragma once

#include <string>
#include <vector>

#include "change_effects.h"
#include "sampled_motion.h"

namespace backlash::identification {

struct HealthyModel {
  MotionSampling sampling;
  double warm_up = 0;                 // s, time constant
  std::vector<ChangeEffect> further;  // that the healthy machine shows, columns after kBaseColumns
  Eigen::VectorXd values;
  Eigen::VectorXd spread;  // standard deviation from record to record
  double noise = 0;        // N m, rms of the residual
  double drift = 0;        // N m, spread of a linear drift of dry friction over a record
};

/// Throws CannotIdentify.
HealthyModel commission_healthy(const std::vector<record::Record>& records, const MotionSampling& sampling,
                                const ChangeSettings& settings);

/// With `load` of each moment by the model.
SampledMotion motion_by(const HealthyModel& model, const record::Record& record,
                        const ChangeSettings& settings);

/// Residual of the model and its nuisances: columns of its values and a drift of friction.
struct Whitened {
  Eigen::VectorXd residual;  // N m
  Eigen::MatrixXd nuisances;
  Eigen::VectorXd spread;  // standard deviation of each
};
Whitened residual_of(const HealthyModel& model, const SampledMotion& motion, const ChangeSettings& settings);

}  // namespace backlash::identification
