// SPDX-License-Identifier: BSD-3-Clause
// Motion and torques of a chain: tau = M(q) a + c(q, v) + g(q), without friction and drives. All in SI units;
// torque > 0 turns its joint forward. Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 and 7.
#pragma once

#include <Eigen/Core>

#include "backlash_diagnosis/arm/chain.h"

namespace backlash::arm {

using Joints = Eigen::VectorXd;  // one number per joint

/// tau [N m] that moves the chain so: recursive Newton-Euler.
Joints inverse_dynamics(const Chain& chain, const Joints& q, const Joints& v, const Joints& a);

/// Y of tau = Y theta, theta = the links' standard parameters one after the other: a row per joint, ten
/// columns per link. tau is linear in them; each column is inverse_dynamics of one parameter.
Eigen::MatrixXd regressor(const Chain& chain, const Joints& q, const Joints& v, const Joints& a);

/// Y of the gravity vector [s^2 kg m ...]: tau of the chain at rest = G g, g in the base. A row per joint.
Eigen::MatrixXd gravity_regressor(const Chain& chain, const Joints& q);

/// a [rad/s^2] that the torques give: articulated bodies. `rotor_inertia` [kg m^2, joint side, >= 0] of each
/// drive turns with its joint only; may be empty. `given` [rad/s^2]: a joint that moves so whatever
/// its torque (Featherstone, chapter 9); NaN: one that follows its torque; may be empty.
Joints forward_dynamics(const Chain& chain, const Joints& q, const Joints& v, const Joints& torque,
                        const Joints& rotor_inertia = {}, const Joints& given = {});

/// Kinetic and potential energy [J]; the potential one is 0 where all centres of mass are at the base's
/// origin.
double energy(const Chain& chain, const Joints& q, const Joints& v);

}  // namespace backlash::arm
