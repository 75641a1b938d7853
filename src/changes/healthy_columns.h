// SPDX-License-Identifier: BSD-3-Clause
// Columns of the healthy machine's equation: of motion, or of the deflection.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "sampled_motion.h"

namespace backlash::changes {

// Columns in this order: of the equation of motion; of the deflection, that under the same load.
enum Base { kInertia, kViscous, kCoulomb, kOffset, kCosine, kSine, kJerk, kCommonColumns };
enum TorqueBase { kWarmViscous = kCommonColumns, kWarmCoulomb };
enum DeflectionBase { kHalfGap = kCommonColumns, kScale };

/// Those that last, in the order of Base.
std::vector<OfMoment> lasting(const MotionSampling& sampling);

/// What warms up: none of the deflection.
std::vector<OfMoment> warming(const MotionSampling& sampling, double warm_up);

/// Both.
Eigen::MatrixXd base_columns(const SampledMotion& motion, double warm_up);

/// Columns of the first, then of the second.
Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace backlash::changes
