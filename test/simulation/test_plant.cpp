// SPDX-License-Identifier: BSD-3-Clause
// Switching, restarting, changing and resetting a plant; its motion is tested in test_plant_motion.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

Plant make_plant(double half_gap, const std::string& method = "dormand_prince") {
  return Plant(test::sarkar_rig(half_gap), test::square(0.05, 10), test::solver(1e-6, method));
}

double sensor(const Plant& plant) {
  return plant.observe().sensor_torque;
}

TEST(Plant, BeginsAtRestInTheMiddleOfTheGap) {
  const Plant plant = make_plant(30e-6);
  EXPECT_EQ(plant.time(), 0);
  for (double value : plant.state()) EXPECT_EQ(value, 0);
  EXPECT_EQ(plant.motor_torque(), 0.05);
  EXPECT_EQ(plant.excitation_period(), 0.1);
  EXPECT_EQ(plant.gear_train().backlash(), 60e-6);
}

// A sample at a switch must always see the torque after it, also where k / rate and n / (2 f) round
// differently: otherwise half periods have 49, 50 or 51 samples.
TEST(Plant, EveryHalfPeriodHasTheSameNumberOfSamples) {
  const auto heavy =
      test::wall_rig(1e6, 1, model::make_contact_law("linear", {{"stiffness", 1}, {"damping", 0}}));
  int apart = 0;  // how often the two times differ
  for (double frequency : {10.0, 0.1, 0.7, 3.3, 1.1, 12.3})
    for (int half : {5, 50}) {
      Plant plant(heavy, test::square(1e-9, frequency), test::solver(1e-3));
      const double rate = 2 * frequency * half;
      for (long k = 0; k < 20000; ++k) {
        const long switches = k / half;
        plant.advance_to(k / rate);
        if (k % half == 0 && k / rate != switches / (2 * frequency)) ++apart;
        ASSERT_EQ(plant.motor_torque() > 0, switches % 2 == 0) << "sample " << k << " at " << rate << " Hz";
        ASSERT_NEAR(plant.time(), k / rate, 1e-15 * plant.time());
      }
    }
  EXPECT_GT(apart, 100) << "the test does not show what it is for";
}

TEST(Plant, ChangesARoundingBeforeASwitchAreSurvived) {
  for (const std::string& method : integrator_methods())
    for (int ulp : {1, 2, 3, 4, 5, 8, 20, 100, 1000}) {
      Plant plant = make_plant(30e-6, method);
      double before = 0.05;
      for (int i = 0; i < ulp; ++i) before = std::nextafter(before, 0);
      plant.advance_to(before);
      ASSERT_NO_THROW(plant.set_backlash(50e-6));
      ASSERT_NO_THROW(plant.advance_to(0.05)) << method << ", " << ulp << " roundings before";
      EXPECT_EQ(plant.motor_torque(), -0.05);
      ASSERT_NO_THROW(plant.advance_to(0.06)) << method << ", " << ulp << " roundings before";
    }
}

TEST(Plant, ASwitchIsNeitherSkippedNorSmeared) {
  // free mass: 1 N m on 1 kg m^2, exact parabola per half period
  model::Rig rig =
      test::wall_rig(1 / 0.0004, 1, model::make_contact_law("linear", {{"stiffness", 1}, {"damping", 0}}));
  for (const std::string& method : integrator_methods()) {
    Plant plant(rig, test::square(1, 5), test::solver(1e-8, method));
    for (int k = 1; k <= 40; ++k) {
      plant.advance_to(0.025 * k);  // switches at multiples of 0.1
      const double s = std::fmod(0.025 * k + 1e-12, 0.2);
      const double speed = s < 0.1 ? s : 0.2 - s;
      EXPECT_NEAR(plant.state()[1], speed, 1e-8) << method << " at " << plant.time();
    }
    EXPECT_NEAR(plant.state()[0], 5 * 0.01, 1e-7) << method;  // 0.01 rad per period
  }
}

TEST(Plant, HowItIsSampledDoesNotMatter) {
  Plant often = make_plant(30e-6), once = make_plant(30e-6);
  for (int k = 1; k <= 1300; ++k) often.advance_to(k * 1e-4);
  once.advance_to(0.13);
  EXPECT_EQ(often.motor_torque(), once.motor_torque());
  // the first step after a switch is guessed from the distance to the next sample: differences of the
  // tolerance's size, 1e-6 of 4 mrad and 0.15 N m times some thousand steps
  EXPECT_NEAR(often.observe().motor_position, once.observe().motor_position, 1e-7);
  EXPECT_NEAR(sensor(often), sensor(once), 1e-5);
}

TEST(Plant, AdvancingToNowChangesNothing) {
  Plant plant = make_plant(30e-6);
  plant.advance_to(0.05);
  const Plant::State state = plant.state();
  for (int i = 0; i < 3; ++i) plant.advance_to(0.05);
  plant.advance_to(std::nextafter(0.05, 0));
  EXPECT_EQ(plant.state(), state);
  EXPECT_EQ(plant.time(), 0.05);
  EXPECT_EQ(plant.motor_torque(), -0.05);
}

TEST(Plant, RefusesTimesThatAreNoFuture) {
  Plant plant = make_plant(30e-6);
  plant.advance_to(0.03);
  const Plant::State state = plant.state();
  const double infinity = std::numeric_limits<double>::infinity();
  for (double t : {0.02, -1.0, std::nan(""), infinity, -infinity})
    EXPECT_THROW(plant.advance_to(t), InvalidParameter) << t;
  EXPECT_EQ(plant.time(), 0.03);
  EXPECT_EQ(plant.state(), state);
  EXPECT_NO_THROW(plant.advance_to(0.06));
}

TEST(Plant, RestartingTwiceAtTheSameTimeIsRestartingOnce) {
  Plant once = make_plant(30e-6), thrice = make_plant(30e-6);
  for (double t : {0.01, 0.05, 0.0723}) {
    once.advance_to(t);
    thrice.advance_to(t);
    once.set_backlash(60e-6);
    thrice.set_backlash(90e-6);
    thrice.set_state(thrice.state());
    thrice.set_backlash(60e-6);
  }
  once.advance_to(0.09);
  thrice.advance_to(0.09);
  EXPECT_EQ(once.state(), thrice.state());
}

TEST(Plant, BacklashMayChangeWhileTheTeethAreInContact) {
  const double step = 10e-6 / 0.014917;  // of the half gap, as an angle
  Plant plant(test::sarkar_rig(30e-6), test::constant(0.05), test::solver(1e-8));
  plant.advance_to(1);
  const Plant::State settled = plant.state();
  plant.set_backlash(80e-6);  // the flank gives way: the pinion follows by the difference
  EXPECT_EQ(plant.gear_train().backlash(), 80e-6);
  EXPECT_EQ(plant.state(), settled);  // by moving, not by jumping
  plant.advance_to(1.002);
  EXPECT_GT(plant.state()[1], settled[1]);
  plant.advance_to(2);
  // 1e-8 of 5 mrad per step, most of which the damping takes back
  EXPECT_NEAR(plant.state()[0] - settled[0], step, 1e-9);
  Plant wide(test::sarkar_rig(40e-6), test::constant(0.05), test::solver(1e-8));
  wide.advance_to(2);
  EXPECT_NEAR(plant.state()[0], wide.state()[0], 1e-9);
  plant.set_backlash(0);  // 40 um inside the flank now: thrown back, and it comes to rest where it belongs
  plant.advance_to(4);
  EXPECT_NEAR(plant.state()[0] - settled[0], -3 * step, 1e-9);
}

TEST(Plant, AnotherMachineGoesOnInTheSameMotion) {
  model::Rig rig;
  rig.mesh.rigid = true;
  rig.input_coupling.rigid = rig.output_coupling.rigid = true;
  rig.motor.inertia = 2;
  Plant plant(rig, test::constant(4), test::solver(1e-8));
  const double inertia = plant.gear_train().motor_inertia();
  plant.advance_to(1);
  const double speed = plant.state()[1];
  EXPECT_NEAR(speed, 4 / inertia, 1e-6);  // w = T t / J
  rig.motor.inertia += inertia;           // twice as much in all
  plant.set_machine(rig);
  EXPECT_EQ(plant.state()[1], speed);
  plant.advance_to(2);
  EXPECT_NEAR(plant.state()[1] - speed, 2 / inertia, 1e-6);
  EXPECT_THROW(plant.set_machine(test::sarkar_rig(30e-6)), InvalidParameter);
  rig.motor.coulomb_friction = 1;  // friction begins where there was none
  EXPECT_THROW(plant.set_machine(rig), InvalidParameter);
  plant.reset();
  plant.advance_to(1);
  EXPECT_NEAR(plant.state()[1], speed, 1e-9);
}

TEST(Plant, RefusedChangesLeaveItAlone) {
  Plant plant = make_plant(30e-6), undisturbed = make_plant(30e-6);
  plant.advance_to(0.02);
  undisturbed.advance_to(0.02);
  EXPECT_THROW(plant.set_backlash(-1e-6), InvalidParameter);
  EXPECT_THROW(plant.set_backlash(std::nan("")), InvalidParameter);
  EXPECT_FALSE(plant.set_torque(1));
  EXPECT_FALSE(plant.set_torque(std::nan("")));
  plant.advance_to(0.06);
  undisturbed.advance_to(0.06);
  EXPECT_EQ(plant.state(), undisturbed.state());
}

TEST(Plant, TopicTorqueActsFromNowOn) {
  Plant plant(test::sarkar_rig(30e-6), test::topic(), test::solver(1e-6));
  Plant square = make_plant(30e-6);
  plant.advance_to(0);
  EXPECT_TRUE(plant.set_torque(0.05));
  plant.advance_to(0.05);
  EXPECT_TRUE(plant.set_torque(-0.05));
  EXPECT_THROW(plant.set_torque(std::nan("")), InvalidParameter);
  EXPECT_EQ(plant.motor_torque(), -0.05);
  plant.advance_to(0.08);
  square.advance_to(0.08);
  EXPECT_NEAR(sensor(plant), sensor(square),
              1e-5);  // hundred tolerances of 0.1 N m: the square knows where it will stop
  plant.reset();
  EXPECT_EQ(plant.motor_torque(), 0);
}

TEST(Plant, MovesAfterALongRest) {
  for (const std::string& method : integrator_methods()) {
    Plant rested(test::sarkar_rig(30e-6), test::topic(), test::solver(1e-8, method));
    Plant fresh(test::sarkar_rig(30e-6), test::topic(), test::solver(1e-8, method));
    rested.advance_to(36000);
    for (double value : rested.state()) EXPECT_EQ(value, 0);
    rested.set_torque(0.05);
    fresh.set_torque(0.05);
    for (int k = 1; k <= 20; ++k) {
      rested.advance_to(36000 + k * 1e-3);
      fresh.advance_to(k * 1e-3);
      // ten hours are known to 7e-12 s; the sensor torque changes by up to 100 N m/s
      EXPECT_NEAR(sensor(rested), sensor(fresh), 1e-6) << method;
    }
  }
}

TEST(Plant, ADriftAcrossTheGapOfManyMinutesEndsInAnOrdinaryImpact) {
  for (const std::string& method : integrator_methods()) {
    const auto law =
        model::make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0}});
    const double half_gap = 0.3, speed = 1e-4, flight = half_gap / speed;  // 50 minutes
    Plant plant(test::wall_rig(0.125, half_gap, law), test::constant(0), test::solver(1e-9, method));
    Plant::State state{};
    state[1] = speed / 0.02;
    plant.set_state(state);
    plant.advance_to(0.999 * flight);
    EXPECT_NEAR(plant.state()[1], speed / 0.02, 1e-9) << method;
    plant.advance_to(1.1 * flight);
    EXPECT_NEAR(plant.state()[1], -speed / 0.02, 1e-3 * speed / 0.02) << method;  // restitution 1
  }
}

TEST(Plant, ResetBeginsAgain) {
  for (const std::string& method : integrator_methods()) {
    Plant plant = make_plant(30e-6, method), fresh = make_plant(30e-6, method);
    plant.advance_to(0.123);
    plant.set_backlash(90e-6);
    plant.advance_to(0.2);
    plant.reset();
    EXPECT_EQ(plant.time(), 0);
    EXPECT_EQ(plant.gear_train().backlash(), 60e-6);
    EXPECT_EQ(plant.motor_torque(), 0.05);
    plant.advance_to(0.13);
    fresh.advance_to(0.13);
    EXPECT_EQ(plant.state(), fresh.state()) << method;
  }
}

TEST(Plant, FailureIsAnExceptionAndResetMendsIt) {
  for (const std::string& method : integrator_methods()) {
    Plant plant = make_plant(30e-6, method), fresh = make_plant(30e-6, method);
    plant.advance_to(0.01);
    Plant::State broken = plant.state();
    broken[4] = std::nan("");
    plant.set_state(broken);
    EXPECT_THROW(plant.advance_to(0.02), IntegrationError) << method;
    plant.reset();
    plant.advance_to(0.07);
    fresh.advance_to(0.07);
    EXPECT_EQ(plant.state(), fresh.state()) << method;
  }
}

TEST(Plant, TwoPlantsDoNotInfluenceEachOther) {
  for (const std::string& method : integrator_methods()) {
    Plant a = make_plant(10e-6, method), b = make_plant(55e-6, method);
    Plant alone_a = make_plant(10e-6, method), alone_b = make_plant(55e-6, method);
    for (int k = 1; k <= 120; ++k) {  // in turns
      a.advance_to(k * 1e-3);
      b.advance_to(k * 1e-3);
    }
    for (int k = 1; k <= 120; ++k) alone_a.advance_to(k * 1e-3);
    for (int k = 1; k <= 120; ++k) alone_b.advance_to(k * 1e-3);
    EXPECT_EQ(a.state(), alone_a.state()) << method;
    EXPECT_EQ(b.state(), alone_b.state()) << method;
    EXPECT_GT(std::fabs(a.observe().motor_position - b.observe().motor_position), 1e-3) << method;
  }
}

TEST(Plant, PlantsMayRunInParallel) {
  std::vector<Plant::State> parallel(4), one_by_one(4);
  std::vector<std::thread> threads;
  const auto run = [](int i) {
    Plant plant = make_plant(i * 20e-6);
    plant.advance_to(0.12);
    return plant.state();
  };
  for (int i = 0; i < 4; ++i) threads.emplace_back([&, i] { parallel[i] = run(i); });
  for (std::thread& thread : threads) thread.join();
  for (int i = 0; i < 4; ++i) EXPECT_EQ(parallel[i], run(i)) << i;
}

TEST(Plant, EveryKindOfRigRuns) {
  for (bool rigid_input : {false, true})
    for (bool rigid_output : {false, true})
      for (bool locked : {false, true})
        for (double half_gap : {0.0, 30e-6}) {
          model::Rig rig = test::sarkar_rig(half_gap);
          if (rigid_input) rig.input_coupling = model::Coupling{};
          if (rigid_output) rig.output_coupling = model::Coupling{};
          rig.link_locked = locked;
          rig.link.inertia = 1e-4;
          rig.link.viscous_damping = 0.01;
          Plant plant(rig, test::square(0.05, 10), test::solver(1e-6));
          double travel = 0;
          for (int k = 1; k <= 200; ++k) {
            plant.advance_to(k * 1e-3);
            travel = std::max(travel, std::fabs(plant.observe().motor_position));
          }
          EXPECT_GT(travel, half_gap / 0.014917);
          EXPECT_EQ(std::isnan(sensor(plant)), rigid_input);
          EXPECT_EQ(plant.observe().load_position == 0, locked);
        }
}

}  // namespace
}  // namespace backlash::simulation
