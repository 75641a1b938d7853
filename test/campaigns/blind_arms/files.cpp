// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "record.h"

namespace blind_arms {
namespace {

std::string urdf(const Arm& arm) {
  std::string text = "<robot name='blind'><link name='base'/>\n";
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const Joint& j = arm.joints[i];
    const DeclaredJoint& d = arm.declared[i];
    Vector inertia = j.inertia;
    for (std::size_t a = 0; a < 3; ++a)
      inertia[a] = d.mass * j.inertia[a] + j.flange * (j.axis[a] != 0 ? 1 : kDisc);
    text += fmt::format(
        "<link name='link{}'><inertial><origin xyz='{:.10g} {:.10g} {:.10g}'/><mass "
        "value='{:.10g}'/><inertia "
        "ixx='{:.10g}' ixy='0' ixz='0' iyy='{:.10g}' iyz='0' izz='{:.10g}'/></inertial></link>\n",
        i, j.centre[0] * d.centre, j.centre[1], j.centre[2], j.mass * d.mass, inertia[0], inertia[1],
        inertia[2]);
    text += fmt::format(
        "<joint name='{}' type='revolute'><parent link='{}'/><child link='link{}'/><origin xyz='{:.10g} "
        "{:.10g} "
        "{:.10g}'/><axis xyz='{} {} {}'/><limit lower='-3.1' upper='3.1' effort='10000' "
        "velocity='4'/></joint>\n",
        joint_name(i), i == 0 ? "base" : fmt::format("link{}", i - 1), i, j.place[0], j.place[1], j.place[2],
        j.axis[0], j.axis[1], j.axis[2]);
  }
  return text + "</robot>\n";
}

std::string rig(const Arm& arm) {
  std::string text = fmt::format(
      "# SPDX-License-Identifier: BSD-3-Clause\nschema_version: 1\nname: blind\nurdf: arm.urdf\ngravity: [0, "
      "0, "
      "-9.80665]\ndrives: {{channel: motor_torque, terms: [rotor_inertia, coulomb, "
      "viscous]}}\nidentification: "
      "{{kinematics_cutoff: 20, torque_cutoff: 10, slowest: 0.02, friction_speed: 0.02}}\nsimulation:\n"
      "  gravity_compensation: true\n  sensors: {{sampling_rate: {}, seed: 1, motor_torque: {{noise: 0.1}}, "
      "motor_position: {{noise: 1.0e-5}}, load_position: {{noise: 1.0e-5}}}}\n  solver: {{method: "
      "dormand_prince, "
      "relative_tolerance: 1.0e-6, position_tolerance: 1.0e-9, velocity_tolerance: 1.0e-6}}\njoints:\n",
      arm.rate);
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const Joint& j = arm.joints[i];
    const DeclaredJoint& d = arm.declared[i];
    text += fmt::format(
        "  - name: {}\n    rotor_inertia: {:.8g}\n    coulomb: {:.8g}\n    viscous: {:.8g}\n    "
        "link_coulomb: {:.8g}\n"
        "    link_viscous: {:.8g}\n    gear: {{backlash_angle: 0.001, contact: {{law: linear, stiffness: "
        "{:.8g}, "
        "damping: {:.8g}}}}}\n    excitation: {{type: moves, positions: [0.1, -0.1], speed: 1, acceleration: "
        "4, dwell: "
        "0.5, position_gain: 8, controller: {{rate: 1000, proportional: 10, integral: 10, torque_limit: "
        "10000}}}}\n",
        joint_name(i), j.rotor * d.rotor, j.coulomb * d.friction, j.viscous * d.friction,
        j.link_coulomb * d.link_friction, j.link_viscous * d.link_friction, j.stiffness * d.stiffness,
        j.damping);
  }
  return text;
}

std::string truth(const Arm& arm) {
  nlohmann::ordered_json json = {{"seed", arm.seed},
                                 {"rate", arm.rate},
                                 {"late", arm.late},
                                 {"payload", arm.payload},
                                 {"payload_centre", arm.payload_centre},
                                 {"tilt", arm.tilt},
                                 {"changed_joint", arm.changed},
                                 {"more_friction", arm.more_friction},
                                 {"pushes", arm.pushes.size()}};
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const Joint& j = arm.joints[i];
    json["joints"].push_back({{"name", joint_name(i)},
                              {"play", j.play},
                              {"teeth", int(j.teeth)},
                              {"stiffness", j.stiffness},
                              {"coulomb", j.coulomb},
                              {"link_coulomb", j.link_coulomb},
                              {"rotor", j.rotor},
                              {"bend_stiffness", j.bend_stiffness},
                              {"eccentricity", j.eccentricity},
                              {"transmission", j.transmission},
                              {"carried_weight", carried_weight(arm, i)}});
  }
  return json.dump(1) + "\n";
}

}  // namespace

void write_files(const Arm& arm, const Arm& before, const std::string& folder) {
  std::ofstream(folder + "/arm.urdf") << urdf(before);
  std::ofstream(folder + "/rig.yaml") << rig(before);
  std::ofstream(folder + "/truth.json") << truth(arm);
}

}  // namespace blind_arms
