// SPDX-License-Identifier: BSD-3-Clause
#include "world.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

namespace blind_arms {
namespace {

constexpr double kGravity = 9.80665;       // m/s^2
constexpr double kLinkBristle = 2e-4;      // rad, deflection at the link's Coulomb friction
constexpr double kPayloadRadius = 0.0316;  // m, of gyration: a fist

std::string vector_of(const Vector& v) {
  return fmt::format("{:.12g} {:.12g} {:.12g}", v[0], v[1], v[2]);
}

/// MuJoCo wants a mass for each body; this one does nothing.
const char* const kNothing = "<inertial pos='0 0 0' mass='1e-6' diaginertia='1e-10 1e-10 1e-10'/>";

std::string joint_xml(const Joint& j, std::size_t i, bool& bends) {
  const std::string axis = vector_of(j.axis);
  std::string xml = fmt::format(
      "<body pos='{}'><joint name='motor{}' type='hinge' axis='{}' armature='{:.12g}'/>{}<body><joint "
      "name='link{}' "
      "type='hinge' axis='{}'/>",
      vector_of(j.place), i, axis, j.rotor, kNothing, i, axis);
  bends = j.bend_stiffness > 0;
  if (bends) {
    Vector flange;
    for (std::size_t a = 0; a < 3; ++a) flange[a] = j.flange * (j.axis[a] != 0 ? 1 : kDisc);
    xml += fmt::format(
        "<inertial pos='0 0 0' mass='1e-6' diaginertia='{}'/><body><joint name='bend{}' type='hinge' "
        "axis='{}' "
        "stiffness='{:.12g}' damping='{:.12g}'/>",
        vector_of(flange), i, axis, j.bend_stiffness, j.bend_damping);
  }
  return xml + fmt::format("<inertial pos='{}' mass='{:.12g}' diaginertia='{}'/>", vector_of(j.centre),
                           j.mass, vector_of(j.inertia));
}

/// Friction of bristles (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), implicit in them: of stiffness s,
/// sliding at `coulomb`.
double bristle_friction(double& friction, double speed, double coulomb, double stiffness) {
  if (!(coulomb > 0)) return 0;
  friction =
      (friction + stiffness * speed * kTimeStep) / (1 + std::fabs(speed) * stiffness / coulomb * kTimeStep);
  return friction;
}

}  // namespace

std::string world_xml(const Arm& arm) {
  std::string xml = fmt::format(
      "<mujoco><compiler angle='radian' inertiafromgeom='false'/><option timestep='{}' gravity='{:.12g} 0 "
      "{:.12g}'><flag contact='disable' constraint='disable' energy='enable'/></option><worldbody>",
      kTimeStep, kGravity * std::sin(arm.tilt), -kGravity * std::cos(arm.tilt));
  std::string ends;
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    bool bends = false;
    xml += joint_xml(arm.joints[i], i, bends);
    ends += bends ? "</body></body></body>" : "</body></body>";
  }
  if (arm.payload > 0) {
    const double inertia = arm.payload * kPayloadRadius * kPayloadRadius * 0.4;
    xml += fmt::format("<body pos='{}'><inertial pos='0 0 0' mass='{:.12g}' diaginertia='{}'/></body>",
                       vector_of(arm.payload_centre), arm.payload, vector_of({inertia, inertia, inertia}));
  }
  return xml + ends + "</worldbody></mujoco>\n";
}

World::World(const Arm& arm, const std::string& path)
    : arm_(arm),
      model_(nullptr, &mj_deleteModel),
      data_(nullptr, &mj_deleteData),
      bristles_(arm.joints.size()) {
  std::ofstream(path) << world_xml(arm);
  char error[1000] = "";
  model_.reset(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  if (!model_) throw std::runtime_error(path + ": " + error);
  data_.reset(mj_makeData(model_.get()));
  const auto place = [&](const std::string& name) {
    const int id = mj_name2id(model_.get(), mjOBJ_JOINT, name.c_str());
    return id < 0 ? -1 : model_->jnt_dofadr[id];
  };
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const std::string n = std::to_string(i);
    joints_.push_back({place("motor" + n), place("link" + n), place("bend" + n)});
  }
  const Places& last = joints_.back();
  last_body_ = model_->dof_bodyid[last.bend < 0 ? last.link : last.bend];
  mj_forward(model_.get(), data_.get());
}

/// At which the motor slides now.
double World::dry_friction(std::size_t joint) const {
  const Joint& j = arm_.joints[joint];
  const auto bell = [](double x) { return std::exp(-x * x); };
  const double speed = motor_rate(joint), held = std::fabs(teeth_torque(j, twist(joint), 0));
  return j.coulomb * (1 + j.stribeck * bell(speed / j.stribeck_speed) + j.drift * time()) +
         j.breakaway * bell(speed / j.breakaway_speed) + j.ripple.at(motor(joint)) + j.rubbing * held +
         j.spot * bell((motor(joint) - j.spot_place) / j.spot_width);
}

/// Puts friction of motor and link on the joint's coordinates.
double World::friction(std::size_t joint) {
  const Joint& j = arm_.joints[joint];
  const double speed = motor_rate(joint), link_speed = link_rate(joint);
  const double motor =
      bristle_friction(bristles_[joint].motor, speed, dry_friction(joint), j.coulomb / j.bristle) +
      j.viscous * speed + j.drag * speed * std::fabs(speed) + j.lopsided * std::fabs(speed) +
      j.cogging.at(this->motor(joint)) + j.cable * (this->motor(joint) - (j.lower + j.upper) / 2);
  const double link =
      bristle_friction(bristles_[joint].link, link_speed, j.link_coulomb, j.link_coulomb / kLinkBristle) +
      j.link_viscous * link_speed;
  data_->qfrc_applied[joints_[joint].link] = -link;
  return motor + link;  // the coordinate of the motor moves both
}

double World::drive_torque(const std::vector<double>& motors, std::size_t joint) const {
  const Joint& j = arm_.joints[joint];
  return j.gain * motors[joint] - (j.coupling == 0 ? 0 : j.coupling * motors[j.coupled]);
}

void World::step(const std::vector<double>& motors) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Places& at = joints_[i];
    data_->qfrc_applied[at.motor] = drive_torque(motors, i) - friction(i);
    data_->qfrc_applied[at.link] += teeth_torque(arm_.joints[i], twist(i), -data_->qvel[at.link]);
  }
  for (int a = 0; a < 3; ++a) data_->xfrc_applied[6 * last_body_ + a] = 0;
  for (const Push& p : arm_.pushes)
    for (std::size_t a = 0; a < 3; ++a)
      if (time() >= p.begin && time() < p.end) data_->xfrc_applied[6 * last_body_ + int(a)] = p.force[a];
  mj_step(model_.get(), data_.get());
  if (!std::isfinite(data_->qpos[0]) || std::fabs(data_->qpos[0]) > 50)
    throw std::runtime_error("the arm runs away");
}

double World::energy() const {
  // MuJoCo's own are of the begin of the last step: of the state of now, they are computed anew.
  mj_energyPos(model_.get(), data_.get());
  mj_energyVel(model_.get(), data_.get());
  double sum = data_->energy[0] + data_->energy[1];
  for (std::size_t i = 0; i < joints_.size(); ++i) sum += teeth_energy(arm_.joints[i], twist(i));
  return sum;
}

}  // namespace blind_arms
