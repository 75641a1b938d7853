// SPDX-License-Identifier: BSD-3-Clause
// What sampling does to fitted values: between two samples the motor moves as nobody has recorded, which at a
// touch or a jump of the torque is no smooth line.
#pragma once

#include "joint_fit.h"

namespace backlash::identification {

/// What a machine with a load of its own gives when it moves nearly as recorded: simulated by its equations
/// under the recorded torque, which is held or not as the record's is, and a weak control (natural frequency
/// feedback / 8 pi) of the motor's position. No noise, no rounding. Throws IntegrationError.
ServoData sampled_machine(const model::Rig& rig, const ServoData& data, const Calibration& calibration,
                          double feedback);

struct SamplingEffect {
  Eigen::VectorXd bias;      // fitted values minus true ones that sampling alone makes
  Eigen::MatrixXd rounding;  // covariance that the resolution of the encoders alone makes
};

///   b = -(J' J)^-1 J' r
/// r what the fitted machine leaves of the records that it gives itself, J the Jacobian of the fit. The same
/// records with positions rounded as the encoders round them differ from b by what rounding does: where a
/// machine stands, or comes by the same places again, its errors are the same each time, and no noise. Over
/// phases of the grid that is a covariance; an encoder whose white noise exceeds its rounding has none. 0
/// where the load has no motion of its own, other axes move the machine, or it cannot be simulated.
SamplingEffect sampling_effect(const MachineFit& fit, const RecordSet& records);

}  // namespace backlash::identification
