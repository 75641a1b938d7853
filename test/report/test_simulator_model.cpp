// SPDX-License-Identifier: BSD-3-Clause
// Exported joints. What MuJoCo makes of its model is compared with closed forms and with our own simulator.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/report/simulator_model.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/servo.h"

#ifdef BACKLASH_DIAGNOSIS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace backlash::report {
namespace {

rig_file::RigFile servo() {
  return test::servo_file();
}

#ifdef BACKLASH_DIAGNOSIS_MUJOCO

/// A joint as MuJoCo runs it.
class World {
 public:
  explicit World(const rig_file::RigFile& file, const std::string& impedance = "") {
    const ScratchFolder folder;
    const std::string path = folder.path("joint.xml");
    std::string text = simulator_model(file, SimulatorFormat::mjcf).text;
    const std::string attribute = "solimplimit=\"0.0001 0.0001 ";
    if (!impedance.empty())
      text.replace(text.find(attribute), attribute.size(), "solimplimit=\"" + impedance + " ");
    write_file(path, text);
    char error[1000] = "";
    model_ = mj_loadXML(path.c_str(), nullptr, error, sizeof error);
    if (model_ == nullptr) throw Error(error);
    data_ = mj_makeData(model_);
  }
  ~World() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void step(double torque) {
    data_->ctrl[0] = torque;
    mj_step(model_, data_);
  }
  double time() const { return data_->time; }
  double time_step() const { return model_->opt.timestep; }
  double position(int joint) const { return data_->qpos[joint]; }
  double velocity(int joint) const { return data_->qvel[joint]; }
  double acceleration(int joint) {
    mj_forward(model_, data_);
    return data_->qacc[joint];
  }
  void set(int joint, double position, double velocity) {
    data_->qpos[joint] = position;
    data_->qvel[joint] = velocity;
  }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

rig_file::RigFile without_friction() {
  rig_file::RigFile file = servo();
  for (model::Body* body : {&file.rig.motor, &file.rig.link})
    body->viscous_damping = body->coulomb_friction = 0;
  return file;
}

/// The servo as one inertia of 114.3 kg m^2, with the friction of both.
rig_file::RigFile one_inertia() {
  rig_file::RigFile file = servo();
  file.rig.mesh = {};
  file.rig.mesh.rigid = true;
  return file;
}

TEST(MujocoModel, TheGapIsCrossedAsTheMotorAloneWould) {
  World world(without_friction());
  // From the middle of the gap, half of 5.4e-4 rad, under 400 N m on 6.3 kg m^2.
  const double expected = std::sqrt(2 * 2.7e-4 * 6.3 / 400);
  while (world.velocity(1) == 0 && world.time() < 1) world.step(400);
  // The load moves in the step in which the flank is met; the next one is seen.
  EXPECT_NEAR(world.time(), expected, 2 * world.time_step());
}

TEST(MujocoModel, TheFlankIsTheSpringAndDamper) {
  const rig_file::RigFile file = without_friction();
  World world(file);
  // Pressed together by 1000 N m on the motor and shaken free of it: relative motion about the rest, closed
  // form x'' = -(K x + C x') / J with J = 6.3 * 108 / 114.3 kg m^2, K = 460e3 N m/rad, C = 483 N m s/rad.
  const double reduced = 6.3 * 108 / 114.3, stiffness = 460e3, damping = 483;
  const double rest = 1000 / 6.3 * reduced / stiffness;  // the load takes 108/114.3 of the torque
  const double start = 0.5 * rest;                       // the flank never opens
  world.set(0, 2.7e-4 + rest + start, 0);
  const double decay = damping / (2 * reduced), rate = std::sqrt(stiffness / reduced - decay * decay);
  double worst = 0;
  while (world.time() < 0.1) {  // four periods
    world.step(1000);
    const double t = world.time();
    const double x = start * std::exp(-decay * t) * (std::cos(rate * t) + decay / rate * std::sin(rate * t));
    worst = std::fmax(worst, std::fabs(world.position(0) - world.position(1) - 2.7e-4 - rest - x));
  }
  // The impedance of 1e-4 leaves 1e-4 of the outer torque on the teeth; the step of 0.028 rad of the
  // vibration costs less than that (fourth order).
  EXPECT_LT(worst, 2e-4 * rest);
  EXPECT_GT(worst, 1e-8 * rest);  // it has been looked at
}

TEST(MujocoModel, FrictionIsDryAndViscous) {
  World world(one_inertia());
  // (400 - 78) / 22 rad/s, reached with the time constant 114.3 / 22 s.
  const double steady = (400.0 - 63 - 15) / (13 + 9), constant = 114.3 / 22;
  while (world.time() < 2) world.step(400);
  EXPECT_NEAR(world.velocity(0), steady * (1 - std::exp(-world.time() / constant)), 1e-3 * steady);
  World stuck(one_inertia());
  while (stuck.time() < 2) stuck.step(77);  // of 78
  EXPECT_LT(std::fabs(stuck.position(0)), 1e-6);
  EXPECT_NE(stuck.position(0), 0);
}

TEST(MujocoModel, TheMotorsOwnShaftIsGeared) {
  rig_file::RigFile file = servo();
  const double ratio = file.rig.reduction_ratio;  // 110
  file.rig.motor_side = true;
  file.rig.motor.inertia /= ratio * ratio;
  file.rig.motor.viscous_damping /= ratio * ratio;
  file.rig.motor.coulomb_friction /= ratio;
  World world(file);
  world.step(400 / ratio);
  // 400 N m at the load, less 63 N m that oppose, on 6.3 kg m^2; the impedance of dry friction leaves 1e-4 of
  // it.
  EXPECT_NEAR(world.velocity(0), (400.0 - 63) / 6.3 * world.time_step(), 1e-3 * 53 * world.time_step());
}

struct Difference {
  double position = 0, deflection = 0;  // largest, over the largest there was
};

/// Both simulators under a square torque, over three periods of 1 s.
Difference difference(const rig_file::RigFile& file, double torque, const std::string& impedance = "") {
  simulation::ExcitationSettings square;
  square.type = "square";
  square.amplitude = torque;
  square.frequency = 1;
  simulation::SolverSettings solver = file.simulation.solver;
  solver.relative_tolerance = 1e-9;
  solver.position_tolerance = 1e-12;
  solver.velocity_tolerance = 1e-10;
  simulation::Plant plant(file.rig, square, solver);
  World world(file, impedance);
  Difference worst;
  double travel = 0, most = 0;
  for (long k = 1; k <= std::lround(3 / world.time_step()); ++k) {
    const double t = static_cast<double>(k) * world.time_step();
    world.step(std::fmod(t - 0.5 * world.time_step(), 1) < 0.5 ? torque : -torque);
    plant.advance_to(t);
    const model::Observation o = plant.observe();
    const double both = o.motor_position - o.load_position;
    worst.position = std::fmax(worst.position, std::fabs(world.position(1) - o.load_position));
    worst.deflection = std::fmax(worst.deflection, std::fabs(world.position(0) - world.position(1) - both));
    travel = std::fmax(travel, std::fabs(o.load_position));
    most = std::fmax(most, std::fabs(both));
  }
  return {worst.position / travel, worst.deflection / most};
}

void print(const std::string& what, const Difference& d) {
  std::cout << what << ": position " << 100 * d.position << " %, deflection " << 100 * d.deflection << " %\n";
}

TEST(MujocoModel, MovesAsOurOwnSimulator) {
  const Difference ours = difference(servo(), 400);
  print("servo", ours);
  // Measured: 0.014 % of the travel and 0.14 % of the deflection. A touch of the flank and a reversal of the
  // friction fall within a step of 1e-4 s of their moments, about twelve of them in 3 s.
  EXPECT_LT(ours.position, 5e-4);
  EXPECT_LT(ours.deflection, 0.005);
  rig_file::RigFile closed = servo();
  closed.rig.mesh.backlash = 0;
  EXPECT_LT(difference(closed, 400).deflection, 0.005);
  // A limit whose impedance is not small is no such spring, whatever its solref.
  for (const char* impedance : {"0.01 0.01", "0.1 0.1", "0.9 0.95"})
    print(std::string("impedance ") + impedance, difference(servo(), 400, impedance));
  EXPECT_GT(difference(servo(), 400, "0.9 0.95").deflection, 0.3);  // MuJoCo's own
}

constexpr int kMachines = 8;

TEST(MujocoModel, DrawnMachinesMoveAsInOurOwnSimulator) {
  Random random(1);
  const auto between = [&](double least, double most) {
    return least * std::pow(most / least, random.uniform());
  };
  std::vector<double> deflections;
  for (int machine = 0; machine < kMachines; ++machine) {
    rig_file::RigFile file = servo();
    model::Rig& rig = file.rig;
    rig.motor.inertia = between(0.01, 10);
    rig.link.inertia = rig.motor.inertia * between(0.1, 30);
    const double reduced = 1 / (1 / rig.motor.inertia + 1 / rig.link.inertia);
    const double rate = 2 * M_PI * between(5, 60);  // rad/s, of the vibration on the flank
    const double stiffness = reduced * rate * rate, damping = 2 * between(0.02, 0.5) * reduced * rate;
    rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", stiffness}, {"damping", damping}});
    const double torque = (rig.motor.inertia + rig.link.inertia) * between(1, 10);
    rig.mesh.backlash = torque / stiffness * between(0.05, 2);
    rig.mesh.start_in_gap = 2 * random.uniform() - 1;
    rig.motor.coulomb_friction = torque * between(0.01, 0.3);
    rig.link.coulomb_friction = torque * between(0.01, 0.3);
    rig.motor.viscous_damping = rig.motor.inertia * between(0.01, 3);
    rig.link.viscous_damping = rig.link.inertia * between(0.01, 3);
    const Difference d = difference(file, torque);
    print("machine " + std::to_string(machine), d);
    EXPECT_LT(d.position, 0.005) << machine;  // measured: 0.0025 and less
    deflections.push_back(d.deflection);
  }
  // Measured: 0.003. Where a lightly loaded flank chatters, each impact multiplies what the impedance leaves,
  // and the two are out of step after a second: machine 0 has 0.3.
  std::nth_element(deflections.begin(), deflections.begin() + kMachines / 2, deflections.end());
  EXPECT_LT(deflections[kMachines / 2], 0.01);
}

TEST(MujocoModel, GravityIsThatOfTheTerm) {
  for (const bool one : {true, false}) {
    rig_file::RigFile file = one ? one_inertia() : without_friction();
    for (model::Body* body : {&file.rig.motor, &file.rig.link})
      body->viscous_damping = body->coulomb_friction = 0;
    file.rig.terms.push_back(model::make_term("gravity", {{"amplitude", 90.0}, {"phase", 0.7}}));
    World world(file);
    for (const double q : {-2.0, 0.0, 0.4, 3.0}) {
      for (int joint = 0; joint < (one ? 1 : 2); ++joint) world.set(joint, q, 0);
      const double expected = -90 * std::sin(q + 0.7) / (one ? 114.3 : 108);
      EXPECT_NEAR(world.acceleration(one ? 0 : 1), expected, 1e-9) << q;
    }
  }
}

#else

TEST(MujocoModel, RunsInMujoco) {
  GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
}

#endif

std::string refusal(const rig_file::RigFile& file, SimulatorFormat format = SimulatorFormat::mjcf) {
  try {
    simulator_model(file, format);
  } catch (const BadData& error) {
    return error.what();
  }
  return "";
}

bool says(const std::vector<std::string>& unsaid, const std::string& part) {
  for (const std::string& text : unsaid)
    if (text.find(part) != std::string::npos) return true;
  return false;
}

TEST(SimulatorModel, UrdfIsWhatItsParserReads) {
  const SimulatorModel model = simulator_model(servo(), SimulatorFormat::urdf);
  const auto robot = urdf::parseURDF(model.text);
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->getRoot()->name, "joint_frame");
  const auto motor = robot->getJoint("joint_motor"), gap = robot->getJoint("joint_gap");
  ASSERT_NE(motor, nullptr);
  ASSERT_NE(gap, nullptr);
  EXPECT_EQ(motor->type, urdf::Joint::CONTINUOUS);
  EXPECT_EQ(motor->dynamics->friction, 63);
  EXPECT_EQ(motor->dynamics->damping, 13);
  EXPECT_EQ(gap->type, urdf::Joint::REVOLUTE);
  EXPECT_DOUBLE_EQ(gap->limits->upper - gap->limits->lower, 5.4e-4);
  EXPECT_EQ(robot->getLink(motor->child_link_name)->inertial->iyy, 6.3);
  EXPECT_EQ(robot->getLink(gap->child_link_name)->inertial->iyy, 108);
  EXPECT_TRUE(says(model.unsaid, "stiffness 460000 N m/rad"));
  EXPECT_TRUE(says(model.unsaid, "friction of the load"));
}

TEST(SimulatorModel, ReversesTheGapForTheLoadOnTheMotor) {
  rig_file::RigFile file = servo();
  file.rig.mesh.start_in_gap = 0.5;  // nearer to the flank that drives forward: 1.35e-4 rad from it
  const auto robot = urdf::parseURDF(simulator_model(file, SimulatorFormat::urdf).text);
  EXPECT_DOUBLE_EQ(robot->getJoint("joint_gap")->limits->lower, -1.35e-4);
  EXPECT_DOUBLE_EQ(robot->getJoint("joint_gap")->limits->upper, 4.05e-4);
  EXPECT_NE(simulator_model(file, SimulatorFormat::mjcf).text.find("range=\"-0.000405 0.000135\""),
            std::string::npos);
  EXPECT_NE(simulator_model(file, SimulatorFormat::sdf)
                .text.find("<lower>-0.000135</lower><upper>0.000405</upper>"),
            std::string::npos);
}

TEST(SimulatorModel, WhatCannotBeSaidIsNamedAndStandsInTheFile) {
  rig_file::RigFile file = servo();
  EXPECT_TRUE(simulator_model(file, SimulatorFormat::mjcf).unsaid.empty());
  file.rig.motor.coulomb_asymmetry = 4;
  file.rig.encoder_skew = 0.002;
  file.rig.terms.push_back(model::make_term("delay", {{"delay", 0.001}}));
  file.rig.name = "a <b> & \"c\" -- d";
  for (const auto format : {SimulatorFormat::mjcf, SimulatorFormat::urdf, SimulatorFormat::sdf}) {
    const SimulatorModel model = simulator_model(file, format);
    for (const char* part : {"motor: friction that differs between the directions by 8 N m",
                             "encoder_skew of 0.002 s", "term delay"}) {
      EXPECT_TRUE(says(model.unsaid, part)) << part;
      EXPECT_NE(model.text.find(std::string("Not said here: ") + part), std::string::npos) << model.text;
    }
    EXPECT_NE(model.text.find("\"a &lt;b&gt; &amp; &quot;c&quot; -- d\""), std::string::npos) << model.text;
    EXPECT_EQ(model.text.find("<!-- a <b> & \"c\" -- d"), std::string::npos);  // a comment ends at --
  }
}

TEST(SimulatorModel, OtherContactLawsAreTakenAtATorque) {
  rig_file::RigFile file = servo();
  // F = K d^1.5 (1 + 3/2 alpha d'): at rest d = (F / K)^(2/3), dF/dd = 1.5 F / d, dF/dd' = 3/2 alpha F.
  file.rig.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 1e7}, {"exponent", 1.5}, {"alpha", 0.02}});
  EXPECT_EQ(refusal(file).find(file.source + ": contact law hunt_crossley is no spring and damper"), 0u)
      << refusal(file);
  const SimulatorModel model = simulator_model(file, SimulatorFormat::sdf, 300);
  const double depth = std::pow(300 / 1e7, 2 / 3.0);
  const auto start = model.text.find("<stiffness>") + 11;
  EXPECT_NEAR(std::stod(model.text.substr(start)), 1.5 * 300 / depth,
              1e-4 * 1.5 * 300 / depth);                   // a difference
  EXPECT_TRUE(says(model.unsaid, "damping 9 N m s/rad"));  // 1.5 * 0.02 * 300
  EXPECT_TRUE(
      says(model.unsaid, "contact law hunt_crossley: stiffness and damping are its tangent at 300 N m"));
  EXPECT_THROW(simulator_model(file, SimulatorFormat::sdf, 0.0), InvalidParameter);
}

TEST(SimulatorModel, RefusesWhatIsNoSuchJoint) {
  const std::string sarkar = test::package_file("config/sarkar_1997.yaml");
  EXPECT_EQ(refusal(rig_file::load_rig_file(sarkar)),
            sarkar + ": gear_train.link is locked: no joint is left");
  const std::string free = test::package_file("config/sarkar_1997_free.yaml");
  EXPECT_EQ(refusal(rig_file::load_rig_file(free)),
            free + ": has flexible couplings: only one inertia, or two with a gap, can be exported");
}

}  // namespace
}  // namespace backlash::report
