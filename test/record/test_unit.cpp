// SPDX-License-Identifier: BSD-3-Clause
// Oracle: the definitions of the units, written out as numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/record/unit.h"

namespace backlash::record {
namespace {

TEST(Unit, ValuesInSi) {
  // One ulp or two: a product of rounded constants.
  const auto expect = [](const char* unit, double number, double si) {
    ASSERT_NE(find_unit(unit), nullptr) << unit;
    EXPECT_DOUBLE_EQ(find_unit(unit)->si(number), si) << unit;
  };
  expect("ms", 3, 0.003);
  expect("us", 250, 0.00025);
  expect("\xc2\xb5s", 250, 0.00025);
  expect("ns", 5, 5e-9);
  expect("min", 2, 120);
  expect("h", 0.5, 1800);
  expect("deg", 180, M_PI);
  expect("\xc2\xb0", 90, M_PI_2);
  expect("rev", 0.5, M_PI);
  expect("turn", 1, 6.283185307179586);
  expect("arcmin", 60, 0.017453292519943295);
  expect("arcsec", 3600, 0.017453292519943295);
  expect("mrad", 2, 0.002);
  expect("rpm", 60, 6.283185307179586);  // one turn per second
  expect("deg/s", 360, 6.283185307179586);
  expect("deg/s^2", 180, M_PI);
  expect("mm", 25, 0.025);
  expect("um", 40, 4e-5);
  expect("mm/s", 7, 0.007);
  expect("g", 1, 9.80665);
  expect("N m", 2, 2);
  expect("Nm", 2, 2);
  expect("mNm", 50, 0.05);
  expect("Ncm", 50, 0.5);
  expect("kNm", 2, 2000);
  expect("kN", 0.3, 300);
  expect("mA", 1500, 1.5);
}

TEST(Unit, NothingElseIsKnown) {
  for (const char* unit : {"", "nm", "NM", "Deg", "degree", "lbf in", "VA", "RPM", "s ", "m s"})
    EXPECT_EQ(find_unit(unit), nullptr) << unit;
}

TEST(Unit, FitsChannelsOfItsKind) {
  const auto fits = [](const char* unit, Channel channel, bool linear = false, bool scaled = false) {
    return misfit(*find_unit(unit), channel, linear, scaled).empty();
  };
  EXPECT_TRUE(fits("deg", Channel::load_position));
  EXPECT_FALSE(fits("deg", Channel::motor_torque));
  EXPECT_FALSE(fits("deg", Channel::motor_torque, false, true));  // no scale makes an angle a torque
  EXPECT_FALSE(fits("deg", Channel::motor_velocity, false, true));
  EXPECT_FALSE(fits("ms", Channel::motor_position, false, true));
  EXPECT_FALSE(fits("mm", Channel::motor_position));
  EXPECT_TRUE(fits("mm", Channel::motor_position, true));
  EXPECT_TRUE(fits("mm", Channel::load_position, false, true));  // a cable on a drum
  EXPECT_TRUE(fits("N", Channel::output_torque, false, true));   // a load cell on a lever
  EXPECT_FALSE(fits("N", Channel::output_torque));
  EXPECT_FALSE(fits("A", Channel::motor_torque));
  EXPECT_TRUE(fits("A", Channel::motor_torque, false, true));
  EXPECT_FALSE(fits("A", Channel::sensor_torque, false, true));  // the motor's current is no sensor's torque
  EXPECT_TRUE(fits("mA", Channel::motor_current));
  EXPECT_TRUE(fits("mA", Channel::motor_current, true));
  EXPECT_FALSE(fits("g", Channel::acceleration));
  EXPECT_TRUE(fits("g", Channel::acceleration, true));
  EXPECT_FALSE(fits("raw", Channel::motor_position));
  EXPECT_TRUE(fits("raw", Channel::motor_position, false, true));
  EXPECT_EQ(misfit(*find_unit("deg"), Channel::motor_torque, false, false),
            "an angle, expected a torque (N m, Nm, N*m, N\xc2\xb7m, mNm, Ncm, kNm)");
}

TEST(Unit, LabelsEndInTheirUnit) {
  const auto expect = [](const char* text, const std::string& name, const std::string& unit,
                         bool has = true) {
    const Label label = label_of(text);
    EXPECT_EQ(label.name, name) << text;
    EXPECT_EQ(label.unit, unit) << text;
    EXPECT_EQ(label.has_unit, has) << text;
  };
  expect("t [ms]", "t", "ms");
  expect("Iq[A]", "Iq", "A");
  expect(" Motor Speed ( rpm ) ", "Motor Speed", "rpm");
  expect("Angle (left) [deg]", "Angle (left)", "deg");
  expect("time", "time", "", false);
  expect("", "", "", false);
  expect("x]", "x]", "", false);
  expect("[]", "", "");
  expect("[deg] x", "[deg] x", "", false);
}

}  // namespace
}  // namespace backlash::record
