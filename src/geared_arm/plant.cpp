// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/plant.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::geared_arm {
namespace {

constexpr double kSameTime = 1e-12;  // relative: rounding of a time that is a sum

// Play and deflection are differences of angles; a finer tolerance would not improve them. As for one joint.
constexpr double kLargestAngle = 0.1;  // rad

constexpr double kBristles = 1e-6;  // of their friction; choice

std::vector<simulation::StateTolerance> tolerances(Eigen::Index angles, std::size_t states,
                                                   const simulation::SolverSettings& solver) {
  std::vector<simulation::StateTolerance> all(std::size_t(angles),
                                              {solver.position_tolerance, kLargestAngle});
  all.resize(std::size_t(2 * angles), simulation::StateTolerance{solver.velocity_tolerance});
  all.resize(states, simulation::StateTolerance{kBristles});
  return all;
}

arm::Joints part(const double* values, Eigen::Index count) {
  return Eigen::Map<const Eigen::VectorXd>(values, count);
}

}  // namespace

ArmPlant::ArmPlant(const GearedArm& arm)
    : arm_(arm),
      chain_(arm::loaded_chain(arm.rig)),
      believed_(chain_),
      links_(Eigen::Index(chain_.size())),
      angles_(links_) {
  rotors_ = arm::Joints::Zero(links_);
  given_ = arm::Joints::Constant(links_, kNaN);
  for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
    const GearedJoint& joint = arm_.joints[j];
    Drive drive;
    if (joint.held)
      given_[Eigen::Index(j)] = 0;
    else
      drive.excitation = joint.excitation.create();
    drive.effects = DriveEffects(arm_.rig, j);
    if (joint.gear && !joint.held)
      drive.motor = angles_++;
    else
      rotors_[Eigen::Index(j)] = arm_.rig.joints[j].terms[std::size_t(arm::DriveTerm::rotor_inertia)];
    drives_.push_back(std::move(drive));
  }
  std::size_t states = 2 * std::size_t(angles_);
  for (Drive& drive : drives_) {
    drive.bristles = states;
    states += drive.effects.bristles().size();
  }
  state_.assign(states, 0.0);
  for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
    state_[j] = arm_.joints[j].held.value_or(arm_.joints[j].start);
    if (drives_[j].motor >= 0) state_[std::size_t(drives_[j].motor)] = state_[j];
  }
  integrator_ = std::make_unique<simulation::Integrator>(
      [this](double t, const double* state, double* rate) { derivative(t, state, rate); },
      tolerances(angles_, states, arm_.solver), arm_.solver);
}

arm::Joints ArmPlant::link_positions() const {
  return part(state_.data(), links_);
}

arm::Joints ArmPlant::motor_positions() const {
  arm::Joints q = link_positions();
  for (std::size_t j = 0; j < drives_.size(); ++j)
    if (drives_[j].motor >= 0) q[Eigen::Index(j)] = state_[std::size_t(drives_[j].motor)];
  return q;
}

void ArmPlant::set_state(const arm::Joints& q, const arm::Joints& v, const arm::Joints& motor_q,
                         const arm::Joints& motor_v) {
  for (Eigen::Index j = 0; j < links_; ++j) {
    state_[std::size_t(j)] = q[j];
    state_[std::size_t(angles_ + j)] = v[j];
    const Eigen::Index motor = drives_[std::size_t(j)].motor;
    if (motor < 0) continue;
    state_[std::size_t(motor)] = motor_q[j];
    state_[std::size_t(angles_ + motor)] = motor_v[j];
  }
}

double ArmPlant::mesh_torque(std::size_t joint, const double* state) const {
  const auto j = Eigen::Index(joint), motor = drives_[joint].motor;
  const Gear& gear = *arm_.joints[joint].gear;
  const double twist = state[motor] - state[j], rate = state[angles_ + motor] - state[angles_ + j];
  const double depth = std::fabs(twist) - gear.backlash / 2, side = twist < 0 ? -1 : 1;
  return depth > 0 ? side * std::fmax(0, gear.contact->force(depth, side * rate, 0)) : 0;
}

std::size_t ArmPlant::motor_angle(std::size_t joint) const {
  return drives_[joint].motor >= 0 ? std::size_t(drives_[joint].motor) : joint;
}

double ArmPlant::motor_friction(std::size_t joint, const double* state, double load) const {
  const Drive& drive = drives_[joint];
  const std::size_t angle = motor_angle(joint);
  const double speed = state[std::size_t(angles_) + angle];
  const double fast = std::tanh(speed / arm_.rig.friction_speed(joint));
  const double direction =
      arm_.rig.joints[joint].friction_distance > 0 ? std::fabs(fast) * state[drive.bristles] : fast;
  const model::JointMoment now{0, state[angle], speed, direction, load};
  double sum = arm::drive_friction(arm_.rig.joints[joint], now) + drive.effects.torque(now);
  for (std::size_t i = 0; i < drive.effects.bristles().size(); ++i) {
    const DriveEffects::Bristles& bristles = drive.effects.bristles()[i];
    const double z = state[drive.bristles + i];
    sum += bristles.torque * (z - now.direction) + bristles.damping * (speed - std::fabs(speed) * z);
  }
  return sum;
}

void ArmPlant::bristle_rates(std::size_t joint, const double* state, double* rate) const {
  const Drive& drive = drives_[joint];
  const double speed = state[std::size_t(angles_) + motor_angle(joint)];
  for (std::size_t i = 0; i < drive.effects.bristles().size(); ++i)
    rate[drive.bristles + i] =
        (speed - std::fabs(speed) * state[drive.bristles + i]) / drive.effects.bristles()[i].distance;
}

double ArmPlant::motor_torque(std::size_t joint, double t) const {
  const Drive& drive = drives_[joint];
  return drive.excitation ? drive.excitation->torque(t, drive.segment) + drive.compensation : 0;
}

/// What turns the motor, for what is recorded.
double ArmPlant::acting_torque(std::size_t joint, double t) const {
  const DriveEffects& effects = drives_[joint].effects;
  double torque = motor_torque(joint, t) * effects.gain();
  for (const auto& [other, share] : effects.couplings()) torque -= share * motor_torque(other, t);
  return torque;
}

void ArmPlant::derivative(double t, const double* state, double* rate) const {
  arm::Joints torque(links_);
  for (std::size_t j = 0; j < drives_.size(); ++j) {
    const auto k = Eigen::Index(j), motor = drives_[j].motor;
    const GearedJoint& joint = arm_.joints[j];
    const double speed = state[angles_ + k];
    double drive = acting_torque(j, t);
    if (motor >= 0) {
      const double mesh = mesh_torque(j, state), motor_speed = state[angles_ + motor];
      rate[motor] = motor_speed;
      rate[angles_ + motor] = (drive - motor_friction(j, state, mesh) - mesh) /
                              arm_.rig.joints[j].terms[std::size_t(arm::DriveTerm::rotor_inertia)];
      drive = mesh;
    } else {
      drive -= motor_friction(j, state, 0);
    }
    bristle_rates(j, state, rate);
    torque[k] = drive - joint.link_viscous * speed -
                joint.link_coulomb * std::tanh(speed / arm_.rig.identification.friction_speed);
  }
  const arm::Joints speeds = part(state + angles_, links_);
  const arm::Joints acceleration =
      arm::forward_dynamics(chain_, part(state, links_), speeds, torque, rotors_, given_);
  for (Eigen::Index j = 0; j < links_; ++j) {
    rate[j] = speeds[j];
    rate[angles_ + j] = acceleration[j];
  }
}

/// Of all excitations whose present segment has ended; the torque of gravity with them.
void ArmPlant::begin_segments() {
  bool any = false;
  for (std::size_t j = 0; j < drives_.size(); ++j) {
    Drive& drive = drives_[j];
    if (!drive.excitation) continue;
    const double end = drive.excitation->segment_end(drive.segment);
    if (begun_ && time_ < end - kSameTime * (1 + std::fabs(end))) continue;
    if (begun_) ++drive.segment;
    drive.excitation->begin_segment(drive.segment, observe(j));
    any = true;
  }
  begun_ = true;
  if (any) compensate_gravity();
}

void ArmPlant::compensate_gravity() {
  if (!arm_.gravity_compensation) return;
  const arm::Joints rest = arm::Joints::Zero(links_);
  const arm::Joints gravity = arm::inverse_dynamics(believed_, motor_positions(), rest, rest);
  for (std::size_t j = 0; j < drives_.size(); ++j) drives_[j].compensation = gravity[Eigen::Index(j)];
}

void ArmPlant::advance_to(double t) {
  if (!begun_) begin_segments();
  while (time_ < t - kSameTime * (1 + std::fabs(t))) {
    double stop = t, longest = std::numeric_limits<double>::infinity();
    for (const Drive& drive : drives_) {
      if (!drive.excitation) continue;
      stop = std::min(stop, drive.excitation->segment_end(drive.segment));
      longest = std::min(longest, drive.excitation->shortest_period(drive.segment) / 10);  // choice
    }
    integrator_->restart(time_, state_.data(), stop, longest);
    integrator_->integrate_to(stop, state_.data());
    time_ = stop;
    begin_segments();
  }
}

model::Observation ArmPlant::observe(std::size_t joint) const {
  const std::size_t angles = std::size_t(angles_), motor = motor_angle(joint);
  model::Observation o{};
  o.motor_torque = motor_torque(joint, time_);
  o.motor_position = state_[motor];
  o.motor_velocity = state_[angles + motor];
  o.load_position = state_[joint];
  o.load_velocity = state_[angles + joint];
  o.sensor_torque = o.sensor_twist = o.sensor_twist_rate = kNaN;
  o.output_torque = drives_[joint].motor >= 0 ? mesh_torque(joint, state_.data()) : kNaN;
  o.motor_current = arm_.rig.channel == record::Channel::motor_current
                        ? o.motor_torque / arm_.rig.joints[joint].constant
                        : kNaN;
  o.acceleration = kNaN;
  return o;
}

double ArmPlant::backlash(std::size_t joint) const {
  return drives_[joint].motor >= 0 ? arm_.joints[joint].gear->backlash : 0;
}

void ArmPlant::set_backlash(std::size_t joint, double backlash) {
  if (!(backlash >= 0) || !(backlash < 2 * M_PI))
    throw InvalidParameter("backlash", backlash, "must be >= 0 and less than a whole turn, 6.283 rad");
  if (drives_[joint].motor < 0)
    throw InvalidParameter(
        "backlash", backlash,
        "joint '" + arm_.rig.joints[joint].name + "' has no gap: it has no gear or is held");
  arm_.joints[joint].gear->backlash = backlash;
}

void ArmPlant::set_machine(const GearedArm& arm) {
  const auto require = [](bool same, const std::string& what) {
    if (!same) throw InvalidParameter("rig", what, "must be as in the arm that is simulated");
  };
  require(arm.simulated, "a file without `simulation`");  // whose drives nobody checked for one
  require(arm.rig.joint_names() == arm_.rig.joint_names(), joined(arm.rig.joint_names()));
  require(arm.rig.channel == arm_.rig.channel, record::channel_name(arm.rig.channel));
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const GearedJoint &now = arm_.joints[j], &then = arm.joints[j];
    require(now.gear.has_value() == then.gear.has_value(), "gear of joint '" + arm.rig.joints[j].name + "'");
    require(now.held == then.held, "held of joint '" + arm.rig.joints[j].name + "'");
    require(DriveEffects(arm.rig, j).bristles().size() == drives_[j].effects.bristles().size(),
            "presliding of joint '" + arm.rig.joints[j].name + "'");
  }
  arm_.rig = arm.rig;
  chain_ = arm::loaded_chain(arm.rig);
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    GearedJoint& joint = arm_.joints[j];
    joint.gear = arm.joints[j].gear;
    drives_[j].effects = DriveEffects(arm_.rig, j);
    joint.link_coulomb = arm.joints[j].link_coulomb;
    joint.link_viscous = arm.joints[j].link_viscous;
    if (drives_[j].motor < 0)
      rotors_[Eigen::Index(j)] = arm.rig.joints[j].terms[std::size_t(arm::DriveTerm::rotor_inertia)];
  }
}

bool ArmPlant::set_torque(std::size_t joint, double torque) {
  Drive& drive = drives_[joint];
  if (!drive.excitation || !drive.excitation->set_torque(torque)) return false;
  compensate_gravity();
  return true;
}

double ArmPlant::energy() const {
  double sum = arm::energy(chain_, link_positions(), part(state_.data() + angles_, links_));
  for (std::size_t j = 0; j < drives_.size(); ++j) {
    const double inertia = arm_.rig.joints[j].terms[std::size_t(arm::DriveTerm::rotor_inertia)];
    const model::Observation o = observe(j);
    if (!arm_.joints[j].held) sum += inertia * o.motor_velocity * o.motor_velocity / 2;
    if (drives_[j].motor < 0) continue;
    const Gear& gear = *arm_.joints[j].gear;
    const double depth = std::fabs(o.motor_position - o.load_position) - gear.backlash / 2;
    if (depth > 0) sum += gear.contact->elastic_energy(depth);
  }
  return sum;
}

}  // namespace backlash::geared_arm
