// SPDX-License-Identifier: BSD-3-Clause
// Arms with gears against energy, today's rig of one joint, KDL and statics.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

constexpr auto kRotor = std::size_t(arm::DriveTerm::rotor_inertia);

GearedArm two_links() {
  GearedArm arm = load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
  arm.solver = {"verner", 1e-9, 1e-12, 1e-10};
  return arm;
}

/// No friction, no damping, no torque.
GearedArm free_arm() {
  GearedArm arm = two_links();
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    arm.joints[j].link_coulomb = arm.joints[j].link_viscous = 0;
    const double rotor = arm.rig.joints[j].terms[kRotor];
    arm.rig.joints[j].terms = {};
    arm.rig.joints[j].terms[kRotor] = rotor;
    arm.joints[j].gear->contact =
        model::make_contact_law("linear", {{"stiffness", j == 0 ? 8000 : 3000}, {"damping", 0}});
    arm.joints[j].excitation.type = "constant";
    arm.joints[j].excitation.amplitude = 0;
  }
  arm.gravity_compensation = false;
  return arm;
}

TEST(GearedArm, UndampedArmKeepsItsEnergy) {
  ArmPlant plant(free_arm());
  const double before = plant.energy();
  double largest = 0, touches = 0;
  for (int i = 1; i <= 2000; ++i) {
    plant.advance_to(i * 1e-3);
    largest = std::fmax(largest, std::fabs(plant.energy() - before));
    touches += plant.observe(0).output_torque != 0;
  }
  EXPECT_GT(touches, 100);  // it does strike
  EXPECT_LT(touches, 1900);
  // The arm falls through some 10 J; tolerances of 1e-9 over 2 s of impacts.
  EXPECT_NEAR(largest, 0, 2e-5);
}

/// A body that is put on while the arm falls: its energy is that of a point (by hand, two links of 0.3 m in a
/// plane), and from then on that of all together stays.
TEST(GearedArm, GoesOnWithAnotherMachineFromWhereItIs) {
  const GearedArm first = free_arm();
  GearedArm loaded = first;
  const double mass = 0.8, from_elbow = 0.25;
  arm::Body body;
  body.mass = mass;
  body.centre = {from_elbow, 0, 0};
  body.inertia = 1e-12 * Eigen::Matrix3d::Identity();
  loaded.rig.payloads.push_back({"forearm", 1, arm::parameters_of(body)});
  ArmPlant plant(first);
  plant.advance_to(0.4);
  const double before = plant.energy();
  plant.set_machine(loaded);
  const double a = plant.observe(0).load_position, b = a + plant.observe(1).load_position;
  const double da = plant.observe(0).load_velocity, db = da + plant.observe(1).load_velocity;
  const double vx = -0.3 * std::sin(a) * da - from_elbow * std::sin(b) * db;
  const double vz = 0.3 * std::cos(a) * da + from_elbow * std::cos(b) * db;
  const double height = 0.3 * std::sin(a) + from_elbow * std::sin(b);
  const double added = mass * (0.5 * (vx * vx + vz * vz) + 9.80665 * height);
  EXPECT_GT(std::fabs(added), 0.1);
  EXPECT_NEAR(plant.energy() - before, added, 1e-9 * std::fabs(added));  // rounding
  const double then = plant.energy();
  plant.advance_to(1.4);
  EXPECT_NEAR(plant.energy(), then, 2e-5);  // as where nothing changes

  GearedArm other = first;
  other.joints[1].gear.reset();
  EXPECT_THROW(plant.set_machine(other), InvalidParameter);
  other = first;
  other.joints[0].held = 0.0;
  EXPECT_THROW(plant.set_machine(other), InvalidParameter);
  other = first;
  other.simulated = false;  // e.g. no rotor in front of a gear
  EXPECT_THROW(plant.set_machine(other), InvalidParameter);
  other = first;
  other.rig.joints[1].name = "wrist";
  EXPECT_THROW(plant.set_machine(other), InvalidParameter);
}

/// Today's rig with the same numbers as the shoulder, with the elbow held and no gravity.
TEST(GearedArm, OneGearWithTheRestHeldIsTheRigOfOneJoint) {
  GearedArm arm = two_links();
  arm.rig.chain.gravity.setZero();
  arm.gravity_compensation = false;
  arm.joints[1].held = 0.0;
  arm.joints[0].link_coulomb = 0, arm.joints[0].link_viscous = 0.02;
  arm.rig.joints[0].terms[std::size_t(arm::DriveTerm::coulomb)] = 0;
  // About the shoulder: two rods of 0.3 m, 2 kg and 1 kg, m (l^2 / 12 + d^2), d = 0.15 and 0.45 m.
  const double inertia = 2.0 * (0.09 / 12 + 0.15 * 0.15) + 1.0 * (0.09 / 12 + 0.45 * 0.45);

  rig_file::RigFile file = rig_file::load_rig_file(test::package_file("config/two_inertia_servo.yaml"));
  model::Rig& rig = file.rig;
  rig.motor.inertia = arm.rig.joints[0].terms[kRotor];
  rig.motor.viscous_damping = arm.rig.joints[0].terms[std::size_t(arm::DriveTerm::viscous)];
  rig.motor.coulomb_friction = 0;
  rig.reduction_ratio = 1;
  rig.link.inertia = inertia;
  rig.link.viscous_damping = 0.02;
  rig.link.coulomb_friction = 0;
  rig.mesh.backlash = arm.joints[0].gear->backlash;
  rig.mesh.contact = arm.joints[0].gear->contact;
  simulation::Plant one(rig, arm.joints[0].excitation, arm.solver);
  ArmPlant plant(arm);
  double moved = 0;
  for (int i = 1; i <= 2000; ++i) {
    one.advance_to(i * 1e-3);
    plant.advance_to(i * 1e-3);
    const model::Observation a = plant.observe(0), b = one.observe();
    // Integration tolerances of 1e-9, which impacts and the loop pass on.
    ASSERT_NEAR(a.motor_position, b.motor_position, 1e-7) << i;
    ASSERT_NEAR(a.load_position, b.load_position, 1e-7) << i;
    moved = std::fmax(moved, std::fabs(a.load_position));
  }
  EXPECT_GT(moved, 0.3);
}

TEST(GearedArm, JointsWithoutGearMoveAsKdlSays) {
  GearedArm arm = free_arm();
  for (std::size_t j = 0; j < 2; ++j) {
    arm.joints[j].gear.reset();
    arm.joints[j].excitation.amplitude = j == 0 ? 4.0 : -1.5;
  }
  ArmPlant plant(arm);
  const KDL::Chain kdl = test::to_kdl(arm.rig.chain);
  KDL::ChainIdSolver_RNE solver(kdl, KDL::Vector(0, 0, -9.80665));
  constexpr double h = 1e-4;  // s: differences of speed over 2 h, error of order h^2
  for (int i = 1; i <= 10; ++i) {
    arm::Joints q(2), v(2), before(2), after(2);
    const auto speeds = [&](double t, arm::Joints& out) {
      plant.advance_to(t);
      for (std::size_t j = 0; j < 2; ++j) out[Eigen::Index(j)] = plant.observe(j).load_velocity;
    };
    speeds(0.05 * i - h, before);
    speeds(0.05 * i, v);
    q = plant.link_positions();
    speeds(0.05 * i + h, after);
    const arm::Joints a = (after - before) / (2 * h);
    KDL::JntArray torque(2);
    solver.CartToJnt(test::to_kdl(q), test::to_kdl(v), test::to_kdl(a),
                     KDL::Wrenches(kdl.getNrOfSegments(), KDL::Wrench::Zero()), torque);
    for (Eigen::Index j = 0; j < 2; ++j)
      EXPECT_NEAR(torque(unsigned(j)) + arm.rig.joints[std::size_t(j)].terms[kRotor] * a[j],
                  arm.joints[std::size_t(j)].excitation.amplitude, 1e-4);
  }
}

/// Cogging takes no energy: A sin(n q + p) is the slope of -A / n cos(n q + p).
TEST(GearedArm, CoggingOfADriveKeepsTheEnergy) {
  GearedArm arm = free_arm();
  constexpr double kAmplitude = 1.5, kOrder = 7, kPhase = 0.4;
  arm.rig.joints[0].effects = {
      {"cogging", kOrder, "", {kAmplitude * std::sin(kPhase), kAmplitude * std::cos(kPhase)}}};
  ArmPlant plant(arm);
  const auto energy = [&] {
    return plant.energy() - kAmplitude / kOrder * std::cos(kOrder * plant.observe(0).motor_position + kPhase);
  };
  const double before = energy();
  double largest = 0, held = 0;
  for (int i = 1; i <= 1000; ++i) {
    plant.advance_to(i * 1e-3);
    largest = std::fmax(largest, std::fabs(energy() - before));
    held = std::fmax(held, std::fabs(plant.energy() - before));
  }
  EXPECT_GT(held, 0.2);           // J, in the wave
  EXPECT_NEAR(largest, 0, 2e-5);  // as without
}

/// What acts is less than what is recorded by the gain, and by what another drive takes.
TEST(GearedArm, GainAndCouplingOfADriveAreOtherTorques) {
  GearedArm effects = free_arm();
  for (std::size_t j = 0; j < 2; ++j) {
    effects.joints[j].gear.reset();
    effects.joints[j].excitation.amplitude = j == 0 ? 4.0 : -1.5;
  }
  GearedArm plain = effects;
  effects.rig.joints[1].effects = {{"motor_torque_gain", 0, "", {0.25, 0}},
                                   {"transmission_coupling", 0, effects.rig.joints[0].name, {0.1, 0}}};
  plain.joints[1].excitation.amplitude = -1.5 / 1.25 - 0.1 * 4;
  ArmPlant a(effects), b(plain);
  a.advance_to(0.5), b.advance_to(0.5);
  EXPECT_LT((a.link_positions() - b.link_positions()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(a.observe(1).motor_torque, -1.5);  // is what the record has
}

/// Held by bristles: a torque T < F bends them by -x_s log(1 - T / F) (Dahl's law from rest); turned to -T,
/// by -x_s log((1 + T / F) / (1 - T / F)) from there. The viscous friction is so large that it creeps there.
TEST(GearedArm, BristlesHoldAJointAsDahlSays) {
  GearedArm arm = free_arm();
  arm.rig.chain.gravity.setZero();
  arm.joints[0].gear.reset();
  arm.joints[1].held = 0.3;
  arm.joints[0].excitation.type = "topic";
  const double friction = 2, distance = 0.01, torque = 1.2;
  arm.rig.joints[0].terms[std::size_t(arm::DriveTerm::coulomb)] = friction;
  arm.rig.joints[0].terms[std::size_t(arm::DriveTerm::viscous)] = 60;
  GearedArm without = arm;
  arm.rig.joints[0].effects = {{"presliding", distance, "", {friction, 0}}};
  ArmPlant plant(arm);
  plant.set_torque(0, torque);
  plant.advance_to(10);
  const double bent = -distance * std::log(1 - torque / friction);
  EXPECT_NEAR(plant.link_positions()[0], bent, 1e-6);
  plant.set_torque(0, -torque);
  plant.advance_to(20);
  EXPECT_NEAR(plant.link_positions()[0],
              bent - distance * std::log((1 + torque / friction) / (1 - torque / friction)), 1e-6);
  plant.set_torque(0, 0);
  plant.advance_to(40);  // and gives back what it can
  EXPECT_NEAR(plant.link_positions()[0],
              bent - distance * std::log((1 + torque / friction) / (1 - torque / friction)) +
                  distance * std::log(1 + torque / friction),
              1e-6);
  EXPECT_THROW(plant.set_machine(without), InvalidParameter);
}

/// All dry friction of a drive builds up: the equation of arm_rig.h, by Runge and Kutta's method here.
TEST(GearedArm, FrictionOfADriveBuildsUpOverItsDistance) {
  GearedArm arm = free_arm();
  arm.rig.chain.gravity.setZero();
  arm.joints[0].gear.reset();
  arm.joints[1].held = 0.3;
  arm.joints[0].excitation = {};
  arm.joints[0].excitation.type = "topic";
  const double friction = 2, distance = 5e-3, slow = arm.rig.friction_speed(0);
  GearedArm frictionless = arm;
  arm.rig.joints[0].terms[std::size_t(arm::DriveTerm::coulomb)] = friction;
  arm.rig.joints[0].friction_distance = distance;
  ArmPlant plant(arm), free(frictionless);
  free.set_torque(0, 1);
  free.advance_to(1e-2);
  const double inertia = 1e-2 / free.observe(0).motor_velocity;  // of all that turns with the joint
  std::array<double, 3> x = {0, 0, 0};                           // angle, speed, bristles
  const auto rate = [&](const std::array<double, 3>& s, double torque) {
    return std::array<double, 3>{s[1],
                                 (torque - friction * std::fabs(std::tanh(s[1] / slow)) * s[2]) / inertia,
                                 (s[1] - std::fabs(s[1]) * s[2]) / distance};
  };
  const auto beside = [](const std::array<double, 3>& s, const std::array<double, 3>& r, double h) {
    return std::array<double, 3>{s[0] + h * r[0], s[1] + h * r[1], s[2] + h * r[2]};
  };
  const double h = 1e-5;
  for (const double torque : {5.0, -9.0, 8.0}) {
    plant.set_torque(0, torque);
    plant.advance_to(plant.time() + 0.1);
    for (int i = 0; i < 10000; ++i) {
      const auto a = rate(x, torque), b = rate(beside(x, a, h / 2), torque),
                 c = rate(beside(x, b, h / 2), torque), d = rate(beside(x, c, h), torque);
      for (std::size_t k = 0; k < 3; ++k) x[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
    }
    EXPECT_NEAR(plant.observe(0).motor_position, x[0], 1e-7) << torque;
    EXPECT_NEAR(plant.observe(0).motor_velocity, x[1], 1e-6) << torque;
    EXPECT_GT(x[1] * torque, 0);  // so that it turns round twice
  }
}

/// Friction that follows the load stands against a motor that is pushed slowly through its mesh: with the
/// load of the teeth T it is mu T, by the balance of torques at nearly constant speed.
TEST(GearedArm, FrictionFollowsTheTorqueOfTheTeeth) {
  GearedArm arm = two_links();
  const auto driven = [&](double coefficient) {
    GearedArm machine = arm;
    if (coefficient > 0)
      machine.rig.joints[0].effects = {{"load_dependent_friction", 0, "", {coefficient, 0}}};
    return simulate_arm(machine, 3);
  };
  const record::Record with = driven(0.2)[0].record, without = driven(0)[0].record;
  // Both follow the same positions, so that the difference of torques is the friction.
  double own = 0, expected = 0;
  for (std::size_t k = 0; k < with.size(); ++k) {
    const double v = (with.column(record::Channel::motor_position)[std::min(k + 5, with.size() - 1)] -
                      with.column(record::Channel::motor_position)[k]) /
                     5e-3;
    if (std::fabs(v) < 0.3) continue;
    const double sign = v > 0 ? 1 : -1;
    own += sign *
           (with.column(record::Channel::motor_torque)[k] - without.column(record::Channel::motor_torque)[k]);
    expected += 0.2 * std::fabs(without.column(record::Channel::motor_torque)[k] - 0.4 * sign - 0.3 * v);
  }
  EXPECT_GT(expected, 100);
  EXPECT_NEAR(own, expected, 0.1 * expected);  // the controller's errors, the rotor's inertia
}

TEST(GearedArm, AGivenJointMovesAsGivenAndTheOthersAsKdlSays) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const arm::Chain chain = test::random_chain(random, 5);
    const arm::Joints q = test::random_joints(random, 5, 3), v = test::random_joints(random, 5, 2),
                      torque = test::random_joints(random, 5, 10);
    arm::Joints given = arm::Joints::Constant(5, NAN);
    given[i % 5] = random.uniform(-5, 5);
    given[(i + 2) % 5] = 0;
    const arm::Joints a = arm::forward_dynamics(chain, q, v, torque, {}, given);
    const KDL::Chain kdl = test::to_kdl(chain);
    KDL::ChainIdSolver_RNE solver(kdl, KDL::Vector(chain.gravity.x(), chain.gravity.y(), chain.gravity.z()));
    KDL::JntArray needed(5);
    solver.CartToJnt(test::to_kdl(q), test::to_kdl(v), test::to_kdl(a),
                     KDL::Wrenches(kdl.getNrOfSegments(), KDL::Wrench::Zero()), needed);
    for (Eigen::Index j = 0; j < 5; ++j) {
      if (std::isnan(given[j]))
        EXPECT_NEAR(needed(unsigned(j)), torque[j], 1e-8);
      else
        EXPECT_EQ(a[j], given[j]);
    }
  }
}

TEST(GearedArm, AtRestTheMeshCarriesGravity) {
  GearedArm arm = two_links();
  for (GearedJoint& joint : arm.joints) {
    joint.excitation.moves.positions = {0.0, 0.0};
    joint.link_coulomb = 0;
  }
  ArmPlant plant(arm);
  plant.advance_to(6);
  const double q1 = plant.link_positions()[0], q12 = q1 + plant.link_positions()[1], g = 9.80665;
  const double elbow = 1.0 * g * 0.15 * std::cos(q12);
  const double shoulder = 2.0 * g * 0.15 * std::cos(q1) + 1.0 * g * 0.3 * std::cos(q1) + elbow;
  // What still creeps through the friction of the motors: a thousandth.
  EXPECT_NEAR(plant.observe(0).output_torque, shoulder, 1e-3 * shoulder);
  EXPECT_NEAR(plant.observe(1).output_torque, elbow, 1e-3 * elbow);
  // The gap and the spring: b / 2 + T / k.
  const model::Observation o = plant.observe(0);
  EXPECT_NEAR(o.motor_position - o.load_position, 1e-3 + shoulder / 8000, 1e-5);
}

TEST(GearedArm, TheSameSeedGivesTheSameRecord) {
  const GearedArm arm = load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
  const auto a = simulate_arm(arm, 0.2), b = simulate_arm(arm, 0.2);
  ASSERT_EQ(a.size(), 2u);
  for (std::size_t j = 0; j < 2; ++j)
    EXPECT_EQ(a[j].record.column(record::Channel::motor_torque),
              b[j].record.column(record::Channel::motor_torque));
  EXPECT_NE(a[0].record.column(record::Channel::motor_position),
            a[1].record.column(record::Channel::motor_position));
  EXPECT_THROW(simulate_arm(arm, -1), InvalidParameter);
}

TEST(GearedArm, AnotherBacklashFromTheBeginningIsAnotherArm) {
  GearedArm wide = two_links(), arm = wide;
  wide.joints[1].gear->backlash = 8e-3;
  ArmPlant declared(wide), changed(arm);
  changed.set_backlash(1, 8e-3);
  EXPECT_EQ(changed.backlash(1), 8e-3);
  EXPECT_EQ(changed.backlash(0), arm.joints[0].gear->backlash);
  declared.advance_to(0.5), changed.advance_to(0.5);
  EXPECT_EQ(changed.observe(1).motor_position, declared.observe(1).motor_position);
  EXPECT_THROW(changed.set_backlash(1, -1e-3), InvalidParameter);
  EXPECT_THROW(changed.set_backlash(1, std::nan("")), InvalidParameter);
}

TEST(GearedArm, AJointWithoutGapHasNoBacklash) {
  GearedArm arm = two_links();
  arm.joints[0].gear.reset();
  arm.joints[1].held = 0.3;
  ArmPlant plant(arm);
  for (const std::size_t joint : {0, 1}) {
    EXPECT_EQ(plant.backlash(joint), 0);
    EXPECT_THROW(plant.set_backlash(joint, 1e-3), InvalidParameter);
  }
  EXPECT_FALSE(plant.set_torque(1, 1)) << "held";
}

/// A torque from outside that never changes is the constant one; gravity is compensated beside it.
TEST(GearedArm, ATorqueFromOutsideIsThatOfTheMotor) {
  GearedArm constant = free_arm(), topic = constant;
  constant.joints[0].excitation.amplitude = 2.5;
  topic.joints[0].excitation.type = "topic";
  ArmPlant a(constant), b(topic);
  EXPECT_FALSE(b.set_torque(1, 1)) << "of an excitation of its own";
  EXPECT_TRUE(b.set_torque(0, 2.5));
  a.advance_to(0.3), b.advance_to(0.3);
  EXPECT_EQ(b.observe(0).motor_torque, 2.5);
  EXPECT_EQ(b.observe(0).motor_position, a.observe(0).motor_position);
  EXPECT_THROW(b.set_torque(0, std::nan("")), InvalidParameter);

  topic.gravity_compensation = true;
  ArmPlant held(topic);
  held.set_state(arm::Joints::Constant(2, 0.4), arm::Joints::Zero(2), arm::Joints::Constant(2, 0.4),
                 arm::Joints::Zero(2));
  held.set_torque(0, 0);
  const double g = 9.80665;  // the rods and where they are, as above
  EXPECT_NEAR(held.observe(0).motor_torque,
              (2.0 * 0.15 + 1.0 * 0.3) * g * std::cos(0.4) + 1.0 * 0.15 * g * std::cos(0.8), 1e-9);
}

TEST(ArmSimulation, AResetIsTheBeginning) {
  const GearedArm arm = load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
  ArmSimulation simulation(arm);
  std::vector<double> first, again;
  for (int i = 0; i < 100; ++i) first.push_back(simulation.step()[1].motor_position);
  simulation.plant().set_backlash(1, 0.01);
  simulation.step();
  simulation.reset();
  EXPECT_EQ(simulation.index(), 0);
  EXPECT_EQ(simulation.plant().backlash(1), 3e-3);
  for (int i = 0; i < 100; ++i) again.push_back(simulation.step()[1].motor_position);
  EXPECT_EQ(again, first);
}

TEST(ArmSimulation, ShowsWhatTheFileDeclares) {
  GearedArm arm = load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
  EXPECT_TRUE(std::isnan(ArmSimulation(arm).step()[0].load_velocity));
  arm.sensors.of(record::Channel::load_velocity).declared = true;
  EXPECT_EQ(ArmSimulation(arm).step()[0].load_velocity, 0);
  arm.simulated = false;
  EXPECT_THROW(ArmSimulation{arm}, BadData);
}

TEST(ArmSimulation, EffectsThatItCannotMoveAreRefused) {
  const std::string folder = test::package_file("config/two_link_arm");
  const std::string text = read_start(folder + "/two_link_arm.yaml", 100000);
  const auto outcome = [&](const std::string& effect, bool geared) {
    std::string changed = text;
    const std::size_t place = changed.find("    gear:"), end = changed.find("    motion_limits", place);
    if (!geared) changed.erase(place, end - place);
    changed.insert(place, "    effects: [{" + effect + "}]\n");
    try {
      geared_arm_from_text(changed, "arm.yaml", folder);
    } catch (const BadData& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string load = "id: load_dependent_friction, coefficient: 0.1";
  EXPECT_EQ(outcome(load, true), "accepted");
  EXPECT_NE(outcome(load, false).find("needs a `gear`"), std::string::npos) << outcome(load, false);
  EXPECT_EQ(outcome("id: motor_torque_gain, gain: 0.1", false), "accepted");
  EXPECT_NE(outcome("id: motor_torque_gain, gain: -0.6}, {id: motor_torque_gain, gain: -0.6", true)
                .find("no torque"),
            std::string::npos);
  EXPECT_EQ(outcome("id: presliding, torque: 1, distance: 0.01", true), "accepted");
}

}  // namespace
}  // namespace backlash::geared_arm
