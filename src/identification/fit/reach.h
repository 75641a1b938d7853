// SPDX-License-Identifier: BSD-3-Clause
// How far a positive value may go before the records contradict it.
//
// The error of a logarithm says nothing of a value near zero, or of one that nothing excites (a play of which
// one flank only is seen: another play and other zeros of the encoders are the same record). There no slope
// counts, only what a large step changes: the smallest p' > p with
//
//   min over all other values of |r(p')|^2 - |r(p)|^2 >= (2 g)^2
//
// r: the rows of the records, each of variance 1, the other values moved along their columns; g: by how much
// neighbouring rows that are not independent widen the errors of the other values. (p' - p) / 2 counts as an
// error.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "joint_fit.h"

namespace backlash::identification {

using RowsOf = std::function<Eigen::VectorXd(const Eigen::VectorXd& values)>;

/// Of each value of the fit, in its own unit (not of its logarithm): 0 where its error is one of a slope,
/// infinite where the records contradict no value that a fit may reach. `rows`: of records and priors, of
/// which the first `count` are of records; `growth`: g.
Eigen::VectorXd reach_of_values(const MachineFit& fit, const Machine& start, const RowsOf& rows,
                                Eigen::Index count, double growth);

}  // namespace backlash::identification
