// SPDX-License-Identifier: BSD-3-Clause
// The equations of motion of gear_train.h for a train that nothing but its teeth makes other than linear: no
// terms, no dry friction, no law that needs touches. Written once for one rig (Real = double) and for several
// that differ in their numbers (Real = Lanes, see lanes.h).
#pragma once

namespace backlash {

/// Which parts move on their own.
struct TrainLayout {
  bool motor_apart = false;  // from the pinion: the input coupling gives way
  bool gear_moves = false;
  bool link_apart = false;  // from the gear: the output coupling gives way
  bool link_moves = false;

  int dof() const { return 1 + motor_apart + gear_moves + (link_apart && link_moves); }
  int mask() const { return motor_apart + 2 * gear_moves + 4 * link_apart + 8 * link_moves; }
};

/// The same, known to the compiler.
template <int Mask>
struct FixedLayout {
  static constexpr bool motor_apart = Mask & 1, gear_moves = Mask & 2, link_apart = Mask & 4,
                        link_moves = Mask & 8;
  static constexpr int dof() { return 1 + motor_apart + gear_moves + (link_apart && link_moves); }
};

/// Coefficients, all referred to the load side; see gear_train.h for the signs.
template <typename Real>
struct SmoothTrain {
  Real damping[4], asymmetry[4];  // N m s/rad: motor, pinion, gear, link
  Real input_stiffness, input_damping, output_stiffness, output_damping;  // 0 where rigid
  Real lever, start;                                                      // m (angular mesh: 1); see Mesh
  Real inverse_inertia[4];                                                // 1/(kg m^2), per degree of freedom

  /// `state` and `rate` have 2 dof numbers: angles [rad], then speeds [rad/s]. Torques in N m, `half_gap` in
  /// m. `force(x, v)` is that of the teeth [N] at x [m], in the middle of the gap 0 and > 0 towards the
  /// forward flank, which moves there at v [m/s].
  template <typename Layout, typename Force>
  inline __attribute__((always_inline)) void derivative(const Layout& layout, const Real* state,
                                                        const Real& motor_torque, const Real& load_torque,
                                                        const Real& half_gap, const Force& force,
                                                        Real* rate) const {
    const int dof = layout.dof();
    const Real* const speeds = state + dof;
    const bool link_free = layout.link_apart && layout.link_moves;
    int part = 0;
    Real q[4] = {}, w[4] = {};  // motor, pinion, gear, link
    q[0] = q[1] = state[part], w[0] = w[1] = speeds[part];
    if (layout.motor_apart) ++part, q[1] = state[part], w[1] = speeds[part];
    if (layout.gear_moves) ++part, q[2] = state[part], w[2] = speeds[part];
    if (!layout.link_apart) q[3] = q[2], w[3] = w[2];
    if (link_free) ++part, q[3] = state[part], w[3] = speeds[part];
    const auto loss = [&](int i) __attribute__((always_inline)) {
      return damping[i] * w[i] + asymmetry[i] * (w[i] < 0 ? -w[i] : w[i]);
    };
    Real motor = motor_torque - loss(0), pinion = -loss(1), gear = -loss(2), link = load_torque - loss(3);
    if (layout.motor_apart) {
      const Real through = input_stiffness * (q[0] - q[1]) + input_damping * (w[0] - w[1]);
      motor -= through, pinion += through;
    }
    if (layout.link_apart) {
      const Real through = output_stiffness * (q[2] - q[3]) + output_damping * (w[2] - w[3]);
      gear -= through, link += through;
    }
    const Real mesh_torque = lever * force(lever * (q[1] - q[2]) + start * half_gap, lever * (w[1] - w[2]));
    pinion -= mesh_torque, gear += mesh_torque;
    part = 0;
    Real* const acceleration = rate + dof;
    acceleration[0] = (layout.motor_apart ? motor : motor + pinion) * inverse_inertia[0];
    if (layout.motor_apart) ++part, acceleration[part] = pinion * inverse_inertia[part];
    if (layout.gear_moves)
      ++part, acceleration[part] = (layout.link_apart ? gear : gear + link) * inverse_inertia[part];
    if (link_free) ++part, acceleration[part] = link * inverse_inertia[part];
    rate[0] = w[0];
    part = 0;
    if (layout.motor_apart) rate[++part] = w[1];
    if (layout.gear_moves) rate[++part] = w[2];
    if (link_free) rate[++part] = w[3];
  }
};

}  // namespace backlash
