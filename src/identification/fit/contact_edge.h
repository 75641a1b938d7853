// SPDX-License-Identifier: BSD-3-Clause
// The influence of a contact law that jumps on fitted values.
#pragma once

#include "joint_fit.h"

namespace backlash::identification {

/// A damper between the teeth that acts in full from the first touch makes their torque jump. No teeth do so
/// (Hunt and Crossley 1975), but how the damping sets in is not declared. Assume that it grows with the
/// penetration p up to p0, a fraction of the gap,
///   b p' min(1, p / p0)
/// and c be the change of the residuals r by it. Result: the change of the fitted values by the amount a of
/// this that the records support,
///   s = -(J' J)^-1 J' c a,   a = -(c* . r) / (c* . c*)     c* the part of c that no value explains
/// 0 where a does not differ clearly from chance, the teeth have no such damper or there is no load of its
/// own.
Eigen::VectorXd shift_of_contact_edge(const MachineFit& fit, const RecordSet& records);

}  // namespace backlash::identification
