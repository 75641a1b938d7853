// SPDX-License-Identifier: BSD-3-Clause
// How large a positive value may become before the records contradict it.
//
// The standard error of a logarithm has no meaning for a value near zero, or for one that the motion does not
// excite (of a play with one flank pressed: another play with other zeros of the encoders gives the same
// record). For such values a large step is taken instead of the slope: the smallest p' > p with
//
//   min over all other values of |r(p')|^2 - |r(p)|^2 >= (2 g)^2
//
// r: the rows of the records, each of variance 1, the other values moved along their columns; g: factor by
// which the correlation of neighbouring rows enlarges the errors of the other values. (p' - p) / 2 is taken
// as the standard error.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "joint_fit.h"

namespace backlash::identification {

using RowsOf = std::function<Eigen::VectorXd(const Eigen::VectorXd& values)>;

/// For each value of the fit, in its own unit (not of its logarithm): 0 if the slope's standard error is
/// valid, infinite if the records contradict no value within the bounds of the fit. `rows`: of records and
/// priors, of which the first `count` are of records; `growth`: g.
Eigen::VectorXd reach_of_values(const MachineFit& fit, const Machine& start, const RowsOf& rows,
                                Eigen::Index count, double growth);

}  // namespace backlash::identification
