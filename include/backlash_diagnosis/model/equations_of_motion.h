// SPDX-License-Identifier: BSD-3-Clause
// The equations of motion of gear_train.h as code: dampers, couplings, the mesh torque on either side of the
// teeth, and which parts move as one. For one rig (Real = double) and for several rigs that differ in their
// numbers (Real = Lanes, see simulation/lanes.h). What else acts (contact force, terms, dry friction) is the
// caller's.
//
// All at the load side of the reduction: angles in rad, speeds in rad/s, torques in N m.
#pragma once

#include <type_traits>

namespace backlash::model {

/// The rotating parts in the order of the drive.
struct TrainParts {
  enum Part { kMotor, kPinion, kGear, kLink, kPartCount };
};

/// Which degree of freedom each part moves with. A coupling or mesh either gives way or joins its neighbours.
/// A gear that is joined to a locked link is fixed, whatever the mesh.
struct TrainLayout : TrainParts {
  static constexpr int kFixed = -1;

  constexpr TrainLayout(bool input_gives_way, bool mesh_gives_way, bool output_gives_way, bool link_moves)
      : input_gives(input_gives_way), output_gives(output_gives_way), link_free(link_moves) {
    node[kPinion] = input_gives ? dof++ : node[kMotor];
    if (output_gives || link_free) node[kGear] = mesh_gives_way ? dof++ : node[kPinion];
    if (link_free) node[kLink] = output_gives ? dof++ : node[kGear];
  }

  /// Layouts with a mesh that gives way, by number.
  static constexpr int kLayouts = 8;
  constexpr int number() const { return input_gives + 2 * output_gives + 4 * link_free; }
  static constexpr TrainLayout numbered(int n) { return {(n & 1) != 0, true, (n & 2) != 0, (n & 4) != 0}; }
  /// A load with rigid couplings behind a mesh that gives way: node 0 is the motor, node 1 the load.
  static constexpr TrainLayout following_load() { return {false, true, false, true}; }

  bool input_gives, output_gives, link_free;
  int dof = 1;                                         // degrees of freedom, 1 to 4
  int node[kPartCount] = {0, kFixed, kFixed, kFixed};  // degree of freedom of each part
};

/// Calls `work` with the number of a layout as a constant, so that the compiler knows the layout. It saves a
/// tenth of the time of a simulation. The mesh of the layout gives way.
template <typename Work>
auto with_constant_number(const TrainLayout& layout, const Work& work) {
  static_assert(TrainLayout::kLayouts == 8);
  switch (layout.number()) {
    case 0:
      return work(std::integral_constant<int, 0>());
    case 1:
      return work(std::integral_constant<int, 1>());
    case 2:
      return work(std::integral_constant<int, 2>());
    case 3:
      return work(std::integral_constant<int, 3>());
    case 4:
      return work(std::integral_constant<int, 4>());
    case 5:
      return work(std::integral_constant<int, 5>());
    case 6:
      return work(std::integral_constant<int, 6>());
    default:
      return work(std::integral_constant<int, 7>());
  }
}

template <typename Real>
struct EquationsOfMotion : TrainParts {
  Real damping[kPartCount], asymmetry[kPartCount];                        // N m s/rad, see Body
  Real input_stiffness, input_damping, output_stiffness, output_damping;  // N m/rad, N m s/rad
  Real lever, start;                                                      // m (angular mesh: 1), -; see Mesh
  Real inverse_inertia[kPartCount];                                       // 1/(kg m^2), per degree of freedom

  struct PartMotion {
    Real q[kPartCount], w[kPartCount];  // rad, rad/s; 0 of a fixed part
  };

  /// `state` has 2 dof numbers: angles, then speeds.
  __attribute__((always_inline)) PartMotion part_motion(const TrainLayout& layout, const Real* state) const {
    PartMotion m;
    const auto take = [&](int part) __attribute__((always_inline)) {
      const int node = layout.node[part];
      m.q[part] = node == TrainLayout::kFixed ? Real{} : state[node];
      m.w[part] = node == TrainLayout::kFixed ? Real{} : state[layout.dof + node];
    };
    take(kMotor), take(kPinion), take(kGear), take(kLink);
    return m;
  }

  /// Position in the gap along the line of action [m], 0 in its middle, > 0 towards the flank that drives
  /// forward, and its rate [m/s].
  __attribute__((always_inline)) Real gap_position(const PartMotion& m, const Real& half_gap) const {
    return lever * (m.q[kPinion] - m.q[kGear]) + start * half_gap;
  }
  __attribute__((always_inline)) Real gap_rate(const PartMotion& m) const {
    return lever * (m.w[kPinion] - m.w[kGear]);
  }

  /// Adds the mesh torque, > 0 drives the gear forward.
  static __attribute__((always_inline)) void add_mesh(const Real& mesh_torque, Real* torque) {
    torque[kPinion] -= mesh_torque;
    torque[kGear] += mesh_torque;
  }

  /// The sum of all torques on each degree of freedom. `add_others(torque)` adds to those on each part what
  /// the equations here do not have: the teeth and terms.
  template <typename AddOthers>
  __attribute__((always_inline)) void net_torques(const TrainLayout& layout, const PartMotion& m,
                                                  const Real& motor_torque, const Real& load_torque,
                                                  const AddOthers& add_others, Real* net) const {
    const auto loss = [&](int part) __attribute__((always_inline)) {
      return damping[part] * m.w[part] + asymmetry[part] * (m.w[part] < 0 ? -m.w[part] : m.w[part]);
    };
    Real torque[kPartCount] = {motor_torque - loss(kMotor), -loss(kPinion), -loss(kGear),
                               load_torque - loss(kLink)};
    if (layout.input_gives) {
      const Real through =
          input_stiffness * (m.q[kMotor] - m.q[kPinion]) + input_damping * (m.w[kMotor] - m.w[kPinion]);
      torque[kMotor] -= through, torque[kPinion] += through;
    }
    if (layout.output_gives) {
      const Real through =
          output_stiffness * (m.q[kGear] - m.q[kLink]) + output_damping * (m.w[kGear] - m.w[kLink]);
      torque[kGear] -= through, torque[kLink] += through;
    }
    add_others(torque);
    net[0] = torque[kMotor];
    const auto join = [&](int part) __attribute__((always_inline)) {
      const int node = layout.node[part];
      if (node == TrainLayout::kFixed) return;
      if (node == layout.node[part - 1])
        net[node] += torque[part];
      else
        net[node] = torque[part];
    };
    join(kPinion), join(kGear), join(kLink);
  }

  /// d state / dt under these torques.
  __attribute__((always_inline)) void accelerate(const TrainLayout& layout, const Real* state,
                                                 const Real* net, Real* rate) const {
#pragma GCC unroll 4
    for (int node = 0; node < layout.dof; ++node) {
      rate[node] = state[layout.dof + node];
      rate[layout.dof + node] = net[node] * inverse_inertia[node];
    }
  }

  /// The whole of it where nothing but the teeth acts besides: `force(x, v)` [N] is theirs at gap_position()
  /// x and gap_rate() v, `half_gap` in m.
  template <typename Force>
  __attribute__((always_inline)) void derivative(const TrainLayout& layout, const Real* state,
                                                 const Real& motor_torque, const Real& load_torque,
                                                 const Real& half_gap, const Force& force, Real* rate) const {
    const PartMotion m = part_motion(layout, state);
    Real net[kPartCount];
    const auto teeth = [&](Real * torque) __attribute__((always_inline)) {
      add_mesh(lever * force(gap_position(m, half_gap), gap_rate(m)), torque);
    };
    net_torques(layout, m, motor_torque, load_torque, teeth, net);
    accelerate(layout, state, net, rate);
  }
};

}  // namespace backlash::model
