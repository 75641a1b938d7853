// SPDX-License-Identifier: BSD-3-Clause
// How far effects that the equation of one inertia lacks may have shifted its parameters. A drag that grows
// with the square of the speed looks like viscous minus Coulomb friction: it leaves a small residual, but
// shifts both by far more than their standard errors (omitted variables; Greene 2012, Econometric Analysis,
// Section 4.3.2).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/term_columns.h"
#include "joint_fit.h"

namespace backlash::identification {

/// One effect: torques over time [any unit], a linear combination of which is it.
struct EffectShapes {
  std::string id;
  std::vector<std::vector<double>> shapes;
};

/// All that the dictionary has (model/term_columns.h), of waves over the position the slow ones; at least one
/// moment.
std::vector<EffectShapes> likely_effects(const std::vector<model::JointMoment>& moments);

/// For a fit A x = b with these residuals: how far each x may be from the machine's value. Effects are added
/// one at a time, the best first, as long as it explains a tenth of the remaining squares. At each step the
/// shift of x counts by the share that the effect explains; among effects that leave at most twice the best
/// residual the largest shift is taken. Steps add up. Of what no effect explains a tenth is assumed to follow
/// A. `noise`: norm of the residuals of a machine that lacks nothing. Each effect has as many rows as A.
/// `clear` squares, from which an effect counts at all; `named`: those that are added.
Eigen::VectorXd drawn_by_missing(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                 const std::vector<Eigen::MatrixXd>& effects, double noise, double clear = 0,
                                 std::vector<std::size_t>* named = nullptr);

/// The errors of a fit hold how far effects of the dictionary that its machine lacks may have shifted it,
/// where they are clear. Returns what is clear.
std::vector<std::string> allow_for_effects(MachineFit& fit, const Machine& start, const RecordSet& records);

}  // namespace backlash::identification
