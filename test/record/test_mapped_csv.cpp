// SPDX-License-Identifier: BSD-3-Clause
// Files of a test bench, whose values in SI units are worked out by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::record {
namespace {

ColumnSource column(Channel channel, const std::string& name, const std::string& unit = "",
                    std::optional<double> scale = std::nullopt, double offset = 0) {
  ColumnSource source;
  source.channel = channel;
  source.column = name;
  source.unit = unit;
  source.scale = scale;
  source.offset = offset;
  return source;
}

ChannelMap bench() {
  ChannelMap map;
  map.joint = "elbow";
  map.time.column = "t [ms]";
  map.columns = {column(Channel::motor_position, "EncoderAngle [deg]"),
                 column(Channel::motor_velocity, "Motor Speed (rpm)"),
                 column(Channel::motor_torque, "Iq[A]", "", 0.5)};  // N m/A
  return map;
}

Record parse(const std::string& text, const ChannelMap& map = bench()) {
  EXPECT_NO_THROW(check(map));
  std::istringstream in(text);
  return read_csv(in, "bench.csv", map, map.joint);
}

std::string refusal(const std::string& text, const ChannelMap& map = bench()) {
  try {
    parse(text, map);
  } catch (const BadData& error) {
    return error.what();
  }
  return "nothing refused";
}

void expect_near(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_DOUBLE_EQ(values[i], expected[i]) << i;
}

/// What all spellings of the same file must give.
void expect_bench(const Record& record) {
  EXPECT_EQ(record.name, "bench.csv");
  expect_near(record.time, {0, 0.001, 0.0025});
  expect_near(record.column(Channel::motor_position), {M_PI, -M_PI_2, 0.0017453292519943296});
  expect_near(record.column(Channel::motor_velocity), {2 * M_PI, -2 * M_PI, 0});
  expect_near(record.column(Channel::motor_torque), {1, -0.25, 0.0005});
  EXPECT_FALSE(record.has(Channel::load_position));
  EXPECT_EQ(record.origin, 0);
}

const std::string kHeader = "t [ms],Motor Speed (rpm),Iq[A],EncoderAngle [deg],Temperature [K],note\n";
const std::string kRows = "0,60,2,180,300.5,warm\n1,-60,-0.5,-90,,\n2.5,0,1e-3,0.1,,\n";

TEST(MappedCsv, UnitsOfTheHeaderAreConverted) {
  expect_bench(parse(kHeader + kRows));
}

TEST(MappedCsv, OtherLayoutsReadTheSame) {
  expect_bench(parse("# bench 4\n# run, of 12 May\n\n" + kHeader + kRows));
  expect_bench(parse("#" + kHeader + kRows));  // as numpy writes it
  expect_bench(parse(
      "\xef\xbb\xbf\"t [ms]\";\"Motor Speed (rpm)\";\"Iq[A]\";\"EncoderAngle [deg]\";\"say \"\"a;b\"\"\"\r\n"
      "0;60;2;180;\"x;y\"\r\n\"1\";-60;-0,5;-90,0;\r\n2,5;0;1,0e-3;0,1;\r\n\r\n"));
  expect_bench(
      parse("t [ms]\tMotor Speed (rpm)\tIq[A]\tEncoderAngle [deg]\n0\t60\t2\t180\n1\t-60\t-0.5\t-90\n"
            "2.5\t0\t0.001\t0.1\n"));
}

TEST(MappedCsv, UnitsComeFromTheRowBelowOrFromTheMap) {
  ChannelMap map = bench();
  map.time.column = "t";
  map.columns[0].column = "angle";
  map.columns[1].column = "speed";
  map.columns[2].column = "current";
  expect_bench(parse(
      "t;angle;speed;current;T\nms;[deg];(rpm);A;K\n0;180;60;2;1\n1;-90;-60;-0,5;\n2,5;0,1;0;0,001;\n", map));
  map.time.unit = "ms", map.columns[0].unit = "deg", map.columns[1].unit = "rpm", map.columns[2].unit = "A";
  expect_bench(parse("t,angle,speed,current\n0,180,60,2\n1,-90,-60,-0.5\n2.5,0.1,0,1e-3\n", map));
  expect_bench(parse("t,angle,speed,current\nms,,,A\n0,180,60,2\n1,-90,-60,-0.5\n2.5,0.1,0,1e-3\n", map));
  // Brackets that are no unit, where the map says it.
  expect_bench(
      parse("t [ms],angle (filtered),speed,current\n0,180,60,2\n1,-90,-60,-0.5\n2.5,0.1,0,1e-3\n", map));
}

TEST(MappedCsv, ScaleAndOffsetAreThoseOfTheChannel) {
  ChannelMap map;
  map.joint = "axis";
  map.time = column(Channel::motor_position, "t", "s");
  map.columns = {column(Channel::motor_position, "enc", "raw", 0.25, 10),
                 column(Channel::load_position, "out", "deg", -1, 1),
                 column(Channel::output_torque, "cell", "kN", 0.3)};  // lever of 0.3 m
  const Record record = parse("t,enc,out,cell\n7,8,90,0.02\n", map);
  expect_near(record.column(Channel::motor_position), {12});
  expect_near(record.column(Channel::load_position), {1 - M_PI_2});
  expect_near(record.column(Channel::output_torque), {6});
}

ChannelMap clock(const std::string& unit) {
  ChannelMap map;
  map.joint = "axis";
  map.time = column(Channel::motor_position, "t", unit);
  map.columns = {column(Channel::motor_position, "x", "rad")};
  return map;
}

TEST(MappedCsv, StampsSince1970KeepAllTheirDigits) {
  // 1.7e18 is beyond the whole numbers that a double holds: 1 us would become 1.024 us.
  const Record ns =
      parse("t,x\n1700000000123456789,0\n1700000000123457789,1\n1700000001123456789,2\n", clock("ns"));
  EXPECT_EQ(ns.time, (std::vector<double>{0, 1e-6, 1}));
  EXPECT_DOUBLE_EQ(ns.origin, 1700000000.123456789);
  const Record s = parse("t,x\n1700000000.999999,0\n1700000001.000001,1\n", clock("s"));
  EXPECT_EQ(s.time.front(), 0);
  EXPECT_NEAR(s.time.back(), 2e-6, 1e-15);  // digits of a double near 1
  EXPECT_DOUBLE_EQ(s.origin, 1700000000.999999);
}

TEST(MappedCsv, TimesOfDay) {
  EXPECT_EQ(parse("t;x\n9:59:59,75;0\n10:00:00;1\n10:00:00,5;2\n", clock("hh:mm:ss")).time,
            (std::vector<double>{35999.75, 36000, 36000.5}));
  for (const char* wrong :
       {"10:60:00", "10:00:61", "1:2:3", "10:00", "-1:00:00", "10:00:00.5e1", "100:00:00", "x"})
    EXPECT_EQ(refusal("t,x\n" + std::string(wrong) + ",0\n", clock("hh:mm:ss")),
              "bench.csv:2: t = '" + std::string(wrong) + "': not a time hh:mm:ss");
  EXPECT_EQ(refusal("t,x\n23:59:59,0\n00:00:00,1\n", clock("hh:mm:ss")),
            "bench.csv:3: t = '00:00:00': goes back, the row before has 86399 s: give what follows as a file "
            "of its own");
}

// Found by a fuzzer: names above names, the last above empty, and a row that is as short.
TEST(MappedCsv, ARowWithoutAColumnThatIsNamedInTheSecondLineIsRefused) {
  const std::string header = "t,drive,\n[s],mode,x\n";
  EXPECT_EQ(parse(header + "0,1,2\n1,1,3\n", clock("s")).column(Channel::motor_position),
            (std::vector<double>{2, 3}));
  EXPECT_EQ(refusal(header + "0,1\n", clock("s")).find("bench.csv:3: 2 fields in '0,1', expected 3"), 0u);
}

TEST(MappedCsv, TheOwnFormatIsReadAsBefore) {
  const std::string own = "time,motor_position\n0,0.1\n1,0.30000000000000004\n";
  EXPECT_EQ(parse(own).column(Channel::motor_position), (std::vector<double>{0.1, 0.30000000000000004}));
  EXPECT_EQ(parse("time,elbow/motor_position,knee/motor_position\n0,1,2\n").column(Channel::motor_position),
            std::vector<double>{1});
  EXPECT_EQ(refusal("time,motor_position\n0,1;2\n"), "bench.csv:2: motor_position = '1;2': not a number");
}

TEST(MappedCsv, UnitsAlsoStandBehindTheOwnNames) {
  std::istringstream in(
      "time [ms],elbow/motor_position [deg],elbow/sensor_torque (mNm)\n5,180,50\n6,-90,0\n");
  const std::vector<JointRecord> joints = read_joints_csv(in, "run.csv");
  ASSERT_EQ(joints.size(), 1u);
  expect_near(joints[0].record.time, {0.005, 0.006});
  expect_near(joints[0].record.column(Channel::motor_position), {M_PI, -M_PI_2});
  expect_near(joints[0].record.column(Channel::sensor_torque), {0.05, 0});
}

struct Wrong {
  std::string text, message;
};

TEST(MappedCsv, WhatIsNotPlainlyRightIsRefusedWithItsPlace) {
  const std::string own = "; there are: ";
  const Wrong cases[] = {
      {"", "bench.csv:1: empty, expected column names"},
      {"x\nt [ms],Iq[A],EncoderAngle [deg],note\n0,1,2,3\n",
       "bench.csv:2: column 'Motor Speed (rpm)' of channels.motor_velocity: not there, there are: t [ms], "
       "Iq[A], "
       "EncoderAngle [deg], note"},
      {"Iq[A]," + kHeader + "1," + kRows,
       "bench.csv:1: column 'Iq[A]' of channels.motor_torque: there twice (a number, from 1, says which): "
       "Iq[A], t "
       "[ms], Motor Speed (rpm), Iq[A], EncoderAngle [deg], Temperature [K], note"},
      {kHeader, "bench.csv: no data: there are only column names"},
      {kHeader + "0,60,2,180,1\n",
       "bench.csv:2: 5 fields in '0,60,2,180,1', expected 6: t [ms], Motor Speed (rpm), Iq[A], EncoderAngle "
       "[deg], Temperature [K], note"},
      {kHeader + "0,60,nan,180,,\n1,60,inf,180,,\n2,60,,180,,\n",
       "bench.csv: no row has a number in all columns: Iq[A] = 'nan', in line 2"},
      {kHeader + "0,60,2,1e400,,\n",
       "bench.csv:2: EncoderAngle [deg] = '1e400': too large or too small for a double"},
      {kHeader + "0,60,\"2,5\",180,,\n", "bench.csv:2: Iq[A] = '2,5': not a number"},  // between commas
      {kHeader + "0,60,\"2,180,,\n", "bench.csv:2: a quote that does not enclose a field"},
      {kHeader + "0,60,\"2\"x,180,,\n", "bench.csv:2: a quote that does not enclose a field"},
      {kHeader + "0,60,2,180,,\n\n1,60,2,180,,\n", "bench.csv:3: an empty line amid the data"},
      {kHeader + "2,60,2,180,,\n1,60,2,180,,\n",
       "bench.csv:3: t [ms] = '1': goes back, the row before has 0.002 s: give what follows as a file of its "
       "own"},
      {kHeader + "ms,rpm,mA,deg,,\n0,60,2,180,,\n",
       "bench.csv:2: Iq[A]: unit = 'mA' of channels.motor_torque: is A elsewhere"},
  };
  for (const Wrong& c : cases) EXPECT_EQ(refusal(c.text), c.message);
}

TEST(MappedCsv, DecimalMarksAreOneThroughout) {
  ChannelMap map = clock("s");
  EXPECT_EQ(refusal("t;x\n0,5;1\n1.5;1\n", map),
            "bench.csv:3: t = '1.5': a decimal point, but a comma in line 2");
  EXPECT_EQ(refusal("t;x\n0.5;1\n1;1,25\n", map),
            "bench.csv:3: x = '1,25': a decimal comma, but a point in line 2");
  EXPECT_EQ(refusal("t;x\n0;1.234,5\n", map), "bench.csv:2: x = '1.234,5': not a number");
  EXPECT_EQ(refusal("t;x\n0;1,234,567\n", map), "bench.csv:2: x = '1,234,567': not a number");
  // One thousand two hundred and thirty-four, or a little over one?
  EXPECT_EQ(
      refusal("t;x\n0;999\n1;1,234\n2;-12,345\n", map),
      "bench.csv:3: x = '1,234': a decimal comma, or one between thousands? All numbers of the file with "
      "a comma could be either; write them with a decimal point");
  expect_near(parse("t;x\n0;1,234\n1;0,999\n", map).column(Channel::motor_position), {1.234, 0.999});
}

TEST(MappedCsv, UnitsThatAreUnknownOrOfAnotherKindAreRefused) {
  const auto begins = [](const std::string& text, const std::string& start) {
    EXPECT_EQ(text.substr(0, start.size()), start);
  };
  ChannelMap map = clock("s");
  map.columns[0] = column(Channel::motor_position, "x");
  begins(refusal("t,x\n0,1\n", map),
         "bench.csv:1: x: unit = '' of channels.motor_position: neither the file nor the map says it, known "
         "are rad, mrad, deg, ");
  begins(refusal("t,x [furlong]\n0,1\n", map),
         "bench.csv:1: x [furlong]: unit = 'furlong' of channels.motor_position: unknown, known are s, ");
  begins(refusal("t,x\ns,furlong\n0,1\n", map),
         "bench.csv:2: x: unit = 'furlong' of channels.motor_position: unknown, known are s, ");
  begins(refusal("t,x [Nm]\n0,1\n", map),
         "bench.csv:1: x [Nm]: unit = 'Nm' of channels.motor_position: a torque, expected an angle (rad, ");
  begins(refusal("t,x [mm]\n0,1\n", map),
         "bench.csv:1: x [mm]: unit = 'mm' of channels.motor_position: a length, expected an angle (rad, ");
  map.linear = true;
  expect_near(parse("t,x [mm]\n0,1\n", map).column(Channel::motor_position), {0.001});
  begins(refusal("t,x [deg]\n0,1\n", map),
         "bench.csv:1: x [deg]: unit = 'deg' of channels.motor_position: an angle, expected a length of a "
         "linear "
         "axis (m, mm, ");
  map = clock("");
  begins(refusal("t [deg],x\n0,1\n", map), "bench.csv:1: t [deg]: unit = 'deg' of channels.time: is no time");
  map = clock("s");
  begins(refusal("t [ms],x\n0,1\n", map),
         "bench.csv:1: t [ms]: unit = 'ms' of channels.time: is s elsewhere");
  map.columns[0] = column(Channel::motor_position, "x", "rad", 1e300);
  begins(refusal("t,x\n0,1e300\n", map), "bench.csv:2: x = '1e300': too large in SI units");

  const auto own = [&](const char* text) {
    std::istringstream in(text);
    try {
      read_csv(in, "run.csv");
    } catch (const BadData& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  begins(own("time,motor_position [Nm]\n0,1\n"),
         "run.csv:1: motor_position [Nm]: unit = 'Nm': a torque, expected an angle (rad, ");
  begins(own("time,motor_position [furlong]\n0,1\n"),
         "run.csv:1: motor_position [furlong]: unit = 'furlong': unknown, known are s, ");
  begins(own("time [rad],motor_position\n0,1\n"), "run.csv:1: time [rad]: unit = 'rad': is no time");
  begins(own("time,motor_position [deg],motor_position\n0,1,2\n"),
         "run.csv:1: column = 'motor_position': there twice");
  begins(own("time,motor_current [raw]\n0,1\n"),
         "run.csv:1: motor_current [raw]: unit = 'raw': needs a scale");
}

TEST(MappedCsv, AMapMayNotMakeOwnNamesMeanSomethingElse) {
  const auto message = [](const ChannelMap& map) -> std::string {
    try {
      check(map);
    } catch (const InvalidParameter& error) {
      return error.what();
    }
    return "";
  };
  ChannelMap map = clock("s");
  map.columns[0] = column(Channel::motor_position, "motor_position");
  map.time = column(Channel::motor_position, "time");
  EXPECT_EQ(message(map), "");
  expect_near(parse("time;motor_position\n0,5;1\n", map).time, {0.5});
  map.columns[0].scale = -1;
  EXPECT_NE(message(map).find("channels.motor_position.column = motor_position"), std::string::npos)
      << message(map);
  map.columns[0] = column(Channel::motor_position, "motor_position", "deg");
  EXPECT_NE(message(map), "");
  map.columns[0] = column(Channel::load_position, "motor_position");
  EXPECT_NE(message(map), "");
  map.columns[0] = column(Channel::motor_position, "motor_position [deg]", "", -1);
  EXPECT_EQ(message(map), "");
  map.time.unit = "ms";
  EXPECT_NE(message(map), "");
  map.time = {};
  EXPECT_NE(message(map).find("must name the column with the time"), std::string::npos);
}

}  // namespace
}  // namespace backlash::record
