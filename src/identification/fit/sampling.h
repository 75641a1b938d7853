// SPDX-License-Identifier: BSD-3-Clause
// Bias of fitted values by sampling: the motion of the motor between two samples is not recorded, and at a
// touch or a jump of the torque it is not smooth.
#pragma once

#include "joint_fit.h"

namespace backlash::identification {

/// The record of a machine with a free load that moves nearly as recorded: simulated under the recorded
/// torque, held or not as in the record, and a weak position control of the motor (natural frequency feedback
/// / 8 pi). Without noise and rounding. Throws IntegrationError.
ServoData sampled_machine(const model::Rig& rig, const ServoData& data, const Calibration& calibration,
                          double feedback);

struct SamplingEffect {
  Eigen::VectorXd bias;      // fitted minus true values, by sampling alone
  Eigen::MatrixXd rounding;  // covariance by the resolution of the encoders alone
};

///   b = -(J' J)^-1 J' r
/// r what the fitted machine leaves of the records that it gives itself, J the Jacobian of the fit. The same
/// records with positions rounded as the encoders round them differ from b by what rounding does: where a
/// machine stands, or comes by the same places again, its errors are the same each time, and no noise. Over
/// phases of the grid that is a covariance; an encoder whose white noise exceeds its rounding has none. 0
/// where the load has no motion of its own or turns behind a shaft (the fit's gear has no mass), other axes
/// move the machine, or it cannot be simulated.
SamplingEffect sampling_effect(const MachineFit& fit, const RecordSet& records);

}  // namespace backlash::identification
