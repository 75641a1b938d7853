// SPDX-License-Identifier: BSD-3-Clause
// MJCF of MuJoCo, for 2.2 and later. What its soft constraints make of the numbers: simulator_model.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "simulator_formats.h"

namespace backlash::report {
namespace {

constexpr double kImpedance = 1e-4;        // of the flanks: the least that MuJoCo takes (mjMINIMP)
constexpr double kStiffFriction = 0.9999;  // of dry friction: the most (mjMAXIMP)
constexpr double kPhasePerStep = 0.05;     // rad of the vibration on the flank; choice, see export_a_model.md
constexpr double kDecayPerStep = 0.1;      // of the relative speed on the flank in a step
constexpr double kLongestStep = 1e-3;      // s
constexpr double kLeastGap = 1e-12;        // rad: MuJoCo wants limits that differ

/// The largest of 1, 2, 5 times a power of ten that is not above.
double rounded_down(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {5.0, 2.0})
    if (step * power <= value) return step * power;
  return power;
}

/// MuJoCo's RK4 takes all of these forces explicitly.
double time_step(const JointModel& joint) {
  double step = kLongestStep;
  const auto decay = [&](double damping, double inertia) {
    if (damping > 0) step = std::min(step, kDecayPerStep * inertia / damping);
  };
  decay(joint.motor.viscous, joint.motor.inertia);
  if (joint.load) {
    const double inertia = joint.reduced_inertia();
    decay(joint.load->viscous, joint.load->inertia);
    decay(joint.damping, inertia);
    step = std::min(step, kPhasePerStep / std::sqrt(joint.stiffness / inertia));
  }
  return rounded_down(step * (1 + 1e-9));
}

std::string body(const JointModel& joint, const std::string& name, bool last, double step) {
  const JointBody& values = last ? joint.last() : joint.motor;
  const JointInertia inertia = inertia_of(joint, last);
  std::string friction;
  if (values.coulomb > 0)
    friction = fmt::format(R"( frictionloss="{}" solreffriction="{} 1" solimpfriction="{} {} 1 0.5 1")",
                           values.coulomb, 2 * step, kStiffFriction, kStiffFriction);
  return fmt::format(
      "    <body name=\"{0}\">\n"
      "      <inertial pos=\"{1} 0 {2}\" mass=\"{3}\" diaginertia=\"{4} {4} {4}\"/>\n"
      "      <joint name=\"{0}\" type=\"{5}\" axis=\"0 1 0\" damping=\"{6}\"{7}/>\n"
      "    </body>\n",
      xml_text(name), inertia.x, inertia.z, inertia.mass, inertia.inertia, joint.linear ? "slide" : "hinge",
      values.viscous, friction);
}

/// The teeth: q_motor - q_load between two soft limits.
std::string teeth(const JointModel& joint, const std::string& name) {
  const double inertia = joint.reduced_inertia();
  const std::string between =
      fmt::format(R"(limited="true" range="{} {}" solreflimit="{} {}" solimplimit="{} {} 1 0.5 1")",
                  joint.backward, std::max(joint.forward, joint.backward + kLeastGap),
                  -joint.stiffness / inertia, -joint.damping / inertia, kImpedance, kImpedance);
  return fmt::format(
      "  <tendon>\n"
      "    <fixed name=\"{0}_teeth\" {1}>\n"
      "      <joint joint=\"{0}_motor\" coef=\"1\"/>\n"
      "      <joint joint=\"{0}_load\" coef=\"-1\"/>\n"
      "    </fixed>\n"
      "  </tendon>\n",
      xml_text(name), between);
}

}  // namespace

std::string mjcf(const rig_file::RigFile& file, JointModel& joint) {
  const double step = time_step(joint);
  const std::string name = joint.load ? joint.name + "_motor" : joint.name;
  std::string text =
      fmt::format("<mujoco model=\"{}\">\n", xml_text(file.rig.name)) + about(file, joint, "  ");
  if (joint.load)
    text += "  " + xml_comment(fmt::format(
                       "Teeth: stiffness {} and damping {} over the reduced inertia {} are the two "
                       "numbers of solreflimit; change them with the inertias.",
                       joint.stiffness, joint.damping, joint.reduced_inertia()));
  text += fmt::format(
      "  <compiler angle=\"radian\"/>\n"
      "  <option timestep=\"{}\" integrator=\"RK4\" gravity=\"0 0 {}\" tolerance=\"1e-12\"/>\n"
      "  <worldbody>\n",
      step, -kGravity);
  text += body(joint, name, !joint.load, step);
  if (joint.load) text += body(joint, joint.name + "_load", true, step);
  text += "  </worldbody>\n";
  if (joint.load) text += teeth(joint, joint.name);
  text += fmt::format(
      "  <actuator>\n"
      "    {}"
      "    <motor name=\"{}\" joint=\"{}\" gear=\"{}\"/>\n"
      "  </actuator>\n"
      "</mujoco>\n",
      xml_comment("The control is motor_torque of a record."), xml_text(joint.name), xml_text(name),
      joint.torque_gear);
  return text;
}

}  // namespace backlash::report
