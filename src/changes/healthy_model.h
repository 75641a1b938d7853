// SPDX-License-Identifier: BSD-3-Clause
// Commissioning: the equation of motion of the healthy machine, or its deflection, with the spread of its
// values.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "change_effects.h"
#include "sampled_motion.h"

namespace backlash::changes {

struct HealthyModel {
  MotionSampling sampling;
  double warm_up = 0;                 // s, time constant
  std::vector<ChangeEffect> further;  // that the healthy machine shows, columns after those of the equation
  Eigen::VectorXd values;
  Eigen::VectorXd spread;   // standard deviation from record to record
  double noise = 0;         // N m or rad, rms of `left`; of an arm of all that the values leave
  double drift = 0;         // N m, spread of a linear drift of dry friction over a record
  double least_change = 0;  // N m or rad, rms of what a change has to explain
  std::shared_ptr<const std::vector<SampledMotion>> records;  // that it was commissioned with
  std::vector<Eigen::VectorXd> left;                          // of each, what is noise
};

/// Throws CannotIdentify.
HealthyModel commission_healthy(const std::vector<record::Record>& records, const MotionSampling& sampling,
                                const ChangeSettings& settings);

/// Load of the teeth of two inertias by the model of the torque; the share `behind` of the inertia is the
/// link's.
MeshLoad mesh_load(const HealthyModel& model, const model::Body& link, double behind,
                   const std::vector<record::Record>& healthy, const ChangeSettings& settings);

/// rad/(N m), compliance of the teeth under the inertia behind them, of a model of the deflection.
double compliance_of(const HealthyModel& model);

/// With `load` of each moment by the model.
SampledMotion motion_by(const HealthyModel& model, const record::Record& record,
                        const ChangeSettings& settings);

/// Residual of the model and its nuisances: columns of its values and what drifts.
struct Whitened {
  Eigen::VectorXd residual;  // N m or rad
  Eigen::MatrixXd nuisances;
  Eigen::VectorXd spread;                // standard deviation of each
  Eigen::Index wander = 0, wanders = 0;  // the first of the columns of what wanders, and how many
};
Whitened residual_of(const HealthyModel& model, const SampledMotion& motion, const ChangeSettings& settings);

}  // namespace backlash::changes
