// SPDX-License-Identifier: BSD-3-Clause
// URDF (ROS) and SDF 1.7 (Gazebo): frame - joint - motor - joint with limits - load.
#include <fmt/format.h>

#include "backlash_diagnosis/model/axis_unit.h"
#include "simulator_formats.h"

namespace backlash::report {
namespace {

constexpr double kUnlimited = 1e6;  // m, m/s or rad/s: farther and faster than any joint

std::string number(const JointModel& joint, double value, const char* unit) {
  return fmt::format("{:.6g} {}", value, model::axis_unit(unit, joint.linear));
}

/// What a tree of joints has no place for.
void note_unsaid(JointModel& joint, bool has_stiffness) {
  if (!joint.load) return;
  std::string teeth = "the teeth: ";
  if (!has_stiffness) teeth += "stiffness " + number(joint, joint.stiffness, "N m/rad") + " and ";
  joint.unsaid.push_back(teeth + "damping " + number(joint, joint.damping, "N m s/rad") +
                         "; limits are as hard as the simulator makes them");
  if (joint.load->viscous > 0 || joint.load->coulomb > 0)
    joint.unsaid.push_back(
        "friction of the load against the frame: " + number(joint, joint.load->coulomb, "N m") + " and " +
        number(joint, joint.load->viscous, "N m s/rad") +
        "; a joint that the motor carries would rub against the motor");
}

std::string inertial(const JointModel& joint, bool last, bool sdf) {
  const JointInertia i = inertia_of(joint, last);
  return fmt::format(
      sdf ? "      <inertial>\n"
            "        <pose>{0} 0 {1} 0 0 0</pose>\n"
            "        <mass>{2}</mass>\n"
            "        "
            "<inertia><ixx>{3}</ixx><iyy>{3}</iyy><izz>{3}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></"
            "inertia>\n"
            "      </inertial>\n"
          : "    <inertial>\n"
            "      <origin xyz=\"{0} 0 {1}\"/>\n"
            "      <mass value=\"{2}\"/>\n"
            "      <inertia ixx=\"{3}\" iyy=\"{3}\" izz=\"{3}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>\n"
            "    </inertial>\n",
      i.x, i.z, i.mass, i.inertia);
}

std::string urdf_joint(const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, const std::string& inside) {
  return fmt::format(
      "  <joint name=\"{}\" type=\"{}\">\n"
      "    <parent link=\"{}\"/>\n"
      "    <child link=\"{}\"/>\n"
      "    <axis xyz=\"0 1 0\"/>\n"
      "{}"
      "  </joint>\n",
      name, type, parent, child, inside);
}

std::string sdf_joint(const std::string& name, const std::string& type, const std::string& parent,
                      const std::string& child, const std::string& inside) {
  return fmt::format(
      "    <joint name=\"{}\" type=\"{}\">\n"
      "      <parent>{}</parent>\n"
      "      <child>{}</child>\n"
      "      <axis>\n"
      "        <xyz>0 1 0</xyz>\n"
      "{}"
      "      </axis>\n"
      "    </joint>\n",
      name, type, parent, child, inside);
}

}  // namespace

std::string urdf(const rig_file::RigFile& file, JointModel& joint) {
  note_unsaid(joint, false);
  const std::string name = xml_text(joint.name), base = name + "_frame",
                    motor = joint.load ? name + "_motor_link" : name + "_link";
  std::string text = fmt::format("<robot name=\"{}\">\n", xml_text(file.rig.name)) + about(file, joint, "  ");
  text += "  " + xml_comment("A joint without limits has them far away where URDF wants some.");
  text += fmt::format("  <link name=\"{}\"/>\n  <link name=\"{}\">\n", base, motor) +
          inertial(joint, !joint.load, false) + "  </link>\n";
  std::string dynamics = fmt::format("    <dynamics damping=\"{}\" friction=\"{}\"/>\n", joint.motor.viscous,
                                     joint.motor.coulomb);
  if (joint.linear)
    dynamics += fmt::format("    <limit lower=\"{}\" upper=\"{}\" effort=\"{}\" velocity=\"{}\"/>\n",
                            -kUnlimited, kUnlimited, kUnlimited, kUnlimited);
  text += urdf_joint(joint.load ? name + "_motor" : name, joint.linear ? "prismatic" : "continuous", base,
                     motor, dynamics);
  if (joint.load) {
    text +=
        fmt::format("  <link name=\"{}_load_link\">\n", name) + inertial(joint, true, false) + "  </link>\n";
    // The position of the load on the motor is q_load - q_motor.
    text += urdf_joint(name + "_gap", joint.linear ? "prismatic" : "revolute", motor, name + "_load_link",
                       fmt::format("    <limit lower=\"{}\" upper=\"{}\" effort=\"0\" velocity=\"{}\"/>\n",
                                   -joint.forward, -joint.backward, kUnlimited));
  }
  text += fmt::format(
      "  <transmission name=\"{0}\">\n"
      "    <type>transmission_interface/SimpleTransmission</type>\n"
      "    <joint "
      "name=\"{1}\"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>\n"
      "    <actuator name=\"{0}\"><mechanicalReduction>{2}</mechanicalReduction></actuator>\n"
      "  </transmission>\n"
      "</robot>\n",
      name, joint.load ? name + "_motor" : name, joint.ratio);
  return text;
}

std::string sdf(const rig_file::RigFile& file, JointModel& joint) {
  note_unsaid(joint, true);
  const std::string name = xml_text(joint.name), motor = joint.load ? name + "_motor_link" : name + "_link";
  std::string text = fmt::format("<sdf version=\"1.7\">\n  <model name=\"{}\">\n", xml_text(file.rig.name)) +
                     about(file, joint, "    ");
  text +=
      fmt::format("    <link name=\"{}\">\n", motor) + inertial(joint, !joint.load, true) + "    </link>\n";
  const std::string dynamics =
      fmt::format("        <dynamics><damping>{}</damping><friction>{}</friction></dynamics>\n",
                  joint.motor.viscous, joint.motor.coulomb);
  const char* const type = joint.linear ? "prismatic" : "revolute";
  text += sdf_joint(joint.load ? name + "_motor" : name, type, "world", motor, dynamics);
  if (joint.load) {
    text += fmt::format("    <link name=\"{}_load_link\">\n", name) + inertial(joint, true, true) +
            "    </link>\n";
    text += sdf_joint(name + "_gap", type, motor, name + "_load_link",
                      fmt::format("        <limit><lower>{}</lower><upper>{}</upper><effort>0</effort>"
                                  "<stiffness>{}</stiffness></limit>\n",
                                  -joint.forward, -joint.backward, joint.stiffness));
  }
  return text + "  </model>\n</sdf>\n";
}

}  // namespace backlash::report
