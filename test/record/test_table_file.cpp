// SPDX-License-Identifier: BSD-3-Clause
// Files as other programs leave them: no header, blanks, tuples, names in the row of units, entries in JSON,
// arrays of NumPy. Values in SI units are worked out by hand; .npz files are written by NumPy itself.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/channels.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/table_file.h"

namespace backlash::record {
namespace {

ChannelMap channels(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text("channels:\n" + text, "rig.yaml");
  ChannelMap map = read_channels(yaml, "axis");
  yaml.finish();
  return map;
}

Record csv(const std::string& text, const ChannelMap& map) {
  std::istringstream in(text);
  return read_csv(in, "run.csv", map, map.joint);
}

template <typename Read>
std::string refusal(const Read& read) {
  try {
    read();
  } catch (const BadData& error) {
    return error.what();
  }
  return "nothing refused";
}

using Values = std::vector<double>;
using C = Channel;

TEST(TableFile, ColumnsByNumberNeedNoHeader) {
  const ChannelMap map = channels(
      "  time: {rate: 500}\n"
      "  motor_torque: {column: 1, unit: N m}\n"
      "  motor_position: {column: 2, unit: mrad}\n");
  // As a C++ stream writes them: blanks between and behind, the word inf in a column that is not read.
  const Record r = csv("0.5 20 0 inf\n-1.5 30  0 2 \n2e-1 -40 0 3\n", map);
  EXPECT_EQ(r.time, (Values{0, 0.002, 0.004}));
  EXPECT_EQ(r.column(C::motor_torque), (Values{0.5, -1.5, 0.2}));
  EXPECT_EQ(r.column(C::motor_position), (Values{0.02, 0.03, -0.04}));
  for (const char* same :
       {"0.5,20,x\n-1.5,30,\n0.2,-40,\n", "0.5\t20\n-1.5\t30\n0.2\t-40\n", "0,5;20\n-1,5;30\n0,2;-40\n",
        "# bench\ntau phi x\n0.5 20 1\n-1.5 30 1\n0.2 -40 1\n", "tau,phi\n0.5,20\n-1.5,30\n0.2,-40\n"})
    EXPECT_EQ(csv(same, map).column(C::motor_position), r.column(C::motor_position)) << same;
  EXPECT_EQ(refusal([&] { csv("0.5 20\n1 2 3\n", map); }), "run.csv:2: 3 fields in '1 2 3', expected 2");
  EXPECT_EQ(refusal([&] { csv("a b\nc d\n", map); }),
            "run.csv: none of the first 100 lines has numbers in all columns of `channels`");
  EXPECT_EQ(csv("time,motor_position\n0,1\n", map).column(C::motor_position), Values{1}) << "the own format";
}

TEST(TableFile, RowsWithoutANumberAreLeftOutAndKeepTheirTime) {
  const ChannelMap map = channels(
      "  time: {rate: 10}\n"
      "  motor_torque: {column: 1, unit: N m}\n");
  const Record r = csv("1 0\ninf 0\n-NaN 0\n4 0\n", map);
  EXPECT_EQ(r.time, (Values{0, 0.3}));
  EXPECT_EQ(r.column(C::motor_torque), (Values{1, 4}));
  ASSERT_FALSE(r.warnings.empty());
  EXPECT_EQ(
      r.warnings.back(),
      "2 rows have no number in a column that is read and are left out; the first: column 1 = 'inf', in "
      "line 2");
  EXPECT_EQ(refusal([&] { csv("inf 0\nnan 0\n", map); }),
            "run.csv: no row has a number in all columns: column 1 = 'inf', in line 1");
}

TEST(TableFile, BlanksSeparateBelowNamesToo) {
  const ChannelMap map = channels(
      "  time: {column: t, unit: ms}\n"
      "  motor_position: {column: phi, unit: deg}\n");
  const Record r = csv("# of May\n  t   phi  note\n 0   180  1\n 2.5 -90  1\n", map);
  EXPECT_EQ(r.time, (Values{0, 0.0025}));
  EXPECT_DOUBLE_EQ(r.column(C::motor_position)[1], -1.5707963267948966);
}

TEST(TableFile, NamesMayStandInTheRowOfUnits) {
  const ChannelMap map = channels(
      "  time: {column: Time}\n"
      "  motor_velocity: {column: Servo motor speed, unit: rpm}\n"
      "  motor_torque: {column: Torque, unit: \"%\", scale: 1.3}\n");  // of 1.3 N m
  const std::string text =
      "Axis1\r\nNumber of sampling data,2\r\nTime,Analog 1,Analog 2,Analog 3\r\n"
      "ms,Servo motor speed,Torque,Not selected\r\n0.0,60.0,-10.0,0\r\n0.5,-60,50,0\r\n\r\n";
  const Record r = csv(text, map);
  EXPECT_EQ(r.time, (Values{0, 0.0005}));
  EXPECT_DOUBLE_EQ(r.column(C::motor_velocity)[0], 2 * 3.14159265358979323846);
  EXPECT_DOUBLE_EQ(r.column(C::motor_torque)[0], -0.13);
  EXPECT_DOUBLE_EQ(r.column(C::motor_torque)[1], 0.65);
}

TEST(TableFile, OfNamesThatRepeatANumberSaysWhich) {
  const std::string text = "t [s],x [rad],x [rad]\n0,1,2\n";
  EXPECT_EQ(
      csv(text, channels("  time: {column: t}\n  motor_position: {column: 3}\n")).column(C::motor_position),
      Values{2});
  EXPECT_EQ(
      refusal([&] { csv(text, channels("  time: {column: t}\n  motor_position: {column: x}\n")); }),
      "run.csv:1: column 'x' of channels.motor_position: there twice (a number, from 1, says which): t [s], "
      "x [rad], x [rad]");
}

TEST(TableFile, TuplesInAFieldAreReadByElement) {
  const ChannelMap map = channels(
      "  time: {column: time}\n"
      "  motor_position: {column: a1 position, element: 1}\n"
      "  motor_velocity: {column: a1 position, element: 2, unit: rad/s}\n");
  const std::string header = "time [s],a1 position [rad],a1 velocity [rad/s],\n";
  const Record r = csv(header + "0.5,\"(0.25, -2.0, 0.0)\",0\n1,\"[ 0.5 -3 1]\",0\n", map);
  EXPECT_EQ(r.column(C::motor_position), (Values{0.25, 0.5}));
  EXPECT_EQ(r.column(C::motor_velocity), (Values{-2, -3}));
  EXPECT_EQ(refusal([&] { csv(header + "0.5,\"(0.25)\",0\n", map); }),
            "run.csv:2: a1 position [rad] = '(0.25)': has no element 2");
  const ChannelMap whole = channels("  time: {column: time}\n  motor_position: {column: a1 position}\n");
  EXPECT_EQ(
      refusal([&] { csv(header + "0.5,\"(0.25, 1)\",0\n", whole); }),
      "run.csv:2: a1 position [rad] = '(0.25, 1)': several numbers: `element` of channels.motor_position "
      "says which, from 1");
}

TEST(TableFile, AChannelIsComputedFromColumns) {
  // Torque of a motor by duty times voltage less its back electromotive force: k/R duty U - k^2/R v.
  const ChannelMap map = channels(
      "  time: {column: t, unit: s}\n"
      "  motor_torque:\n"
      "    unit: N m\n"
      "    sum:\n"
      "      - {product: [{column: duty, unit: raw, bits: 16}, {column: supply, unit: V}], unit: raw, scale: "
      "1e-3}\n"
      "      - {column: v, unit: rad/s, scale: -0.05}\n"
      "  motor_velocity: {column: v, unit: rad/s}\n");
  const Record r = csv("t,duty,supply,v\n0,100,7.5,2\n1,65526,8,-1\n", map);
  EXPECT_DOUBLE_EQ(r.column(C::motor_torque)[0], 0.75 - 0.1);
  EXPECT_DOUBLE_EQ(r.column(C::motor_torque)[1], -0.08 + 0.05) << "65526 is -10 of 16 bits";
  EXPECT_EQ(refusal([&] { csv("t,duty,supply,v\n0,70000,7.5,2\n", map); }),
            "run.csv:2: duty = '70000': no whole number of 16 bits");
  const std::string part = "  motor_torque: {sum: [{column: a, unit: raw}]}\n  time: {column: t, unit: s}\n";
  EXPECT_NE(refusal([&] { channels(part); }).find("channels.motor_torque.unit = '': must be said"),
            std::string::npos);
  EXPECT_EQ(refusal([] {
              channels("  motor_torque: {column: a, sum: [{column: b}], unit: N m}\n");
            }).find("rig.yaml:2: channels.motor_torque.column"),
            0u);
}

const std::string kEntries =
    R"({"mass": 0.5, "log": [1, "a"], "entries": [{"position": 0.5, "load": 2, "timestamp": 1700000000.25, "on": true},
       {"position": NaN, "load": 65535, "timestamp": 1700000000.5, "on": true},
       {"position": [1.5, 2], "load": 1, "timestamp": 1700000000.75, "on": false}]})";

ChannelMap entries() {
  return channels(
      "  time: {column: timestamp, unit: s}\n"
      "  motor_position: {column: position, element: 1, unit: rad}\n"
      "  motor_current: {column: load, unit: mA}\n");
}

TEST(TableFile, JsonIsAListOfEntriesOrOfColumns) {
  const Record r = read_json(kEntries, "run.json", entries());
  EXPECT_EQ(r.time, (Values{0, 0.5}));
  EXPECT_DOUBLE_EQ(r.origin, 1700000000.25);
  EXPECT_EQ(r.column(C::motor_position), (Values{0.5, 1.5}));
  EXPECT_EQ(r.column(C::motor_current), (Values{0.002, 0.001}));
  EXPECT_EQ(r.warnings.size(), 1u);  // the entry without a position
  const std::string list =
      kEntries.substr(kEntries.find("[{"), kEntries.rfind(']') + 1 - kEntries.find("[{"));
  EXPECT_EQ(read_json(list, "run.json", entries()).time, r.time);
  const std::string columns =
      R"({"position": [[0.5], [1.5]], "load": [2, 1], "timestamp": [1700000000.25, 1700000000.75], "name": "x"})";
  EXPECT_EQ(read_json(columns, "run.json", entries()).column(C::motor_current), r.column(C::motor_current));
}

TEST(TableFile, WhatJsonLacksIsSaidWithItsPlace) {
  const auto said = [](const std::string& text) {
    return refusal([&] { read_json(text, "run.json", entries()); });
  };
  EXPECT_EQ(said("{").find("run.json: is no JSON: "), 0u);
  EXPECT_EQ(said("{\"a\": 1}").find("run.json: holds no table: expected a list of entries"), 0u);
  EXPECT_EQ(said("[{\"timestamp\": 0, \"load\": 1}]"),
            "run.json: column 'position' of channels.motor_position: not there, there are: timestamp, load");
  EXPECT_EQ(said("[{\"timestamp\": 0, \"load\": 1, \"position\": \"far\"}]"),
            "run.json, entry 1: position = 'far': not a number");
  EXPECT_EQ(said("[{\"timestamp\": 1, \"load\": 1, \"position\": 1}, {\"timestamp\": 0, \"load\": 1, "
                 "\"position\": 1}]"),
            "run.json, entry 2: timestamp = '0': goes back, the row before has 1 s: give what follows as a "
            "file of its own");
  EXPECT_EQ(said("[{\"timestamp\": 1, \"load\": 1, \"position\": 1}, 7]"), "run.json, entry 2: is no object");
  EXPECT_EQ(said(R"({"timestamp": [0, 1], "load": [1], "position": [1, 2]})"),
            "run.json: load has 1 values, timestamp has 2");
}

class Npz : public testing::Test {
 protected:
  std::string written(const std::string& call) {
    const std::string path = folder_.path("run.npz");
    const std::string command =
        "/usr/bin/python3 -c \"import numpy as np; t = np.array([1460034864.0, 1460034864.005, "
        "1460034864.010]); q = np.array([[1., 2.], [3., 4.], [5., 6.]]); np." +
        call + "\" '" + path + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return path;
  }
  ScratchFolder folder_;
};

ChannelMap arrays() {
  return channels(
      "  time: {column: times, unit: s}\n"
      "  motor_position: {column: positions, element: 2, unit: rad}\n"
      "  motor_torque: {column: torques, element: 1, unit: N m}\n");
}

TEST_F(Npz, ArraysOfNumPyAreRead) {
  for (const char* call :
       {"savez(__import__('sys').argv[1], times=t, positions=q, torques=-q.astype('f4'), name=np.array('x'))",
        "savez_compressed(__import__('sys').argv[1], times=t, positions=np.asfortranarray(q), "
        "torques=-q.astype('>i2'))"}) {
    const Record r = read_table(written(call), arrays());
    ASSERT_EQ(r.size(), 3u) << call;
    EXPECT_NEAR(r.time[2], 0.01, 2.4e-7) << "the digits of a double at 1.46e9";
    EXPECT_EQ(r.column(C::motor_position), (Values{2, 4, 6})) << call;
    EXPECT_EQ(r.column(C::motor_torque), (Values{-1, -3, -5})) << call;
  }
}

TEST_F(Npz, WhatCannotBeReadIsSaid) {
  const auto said = [&](const std::string& call) {
    const std::string path = written(call);
    const std::string text = refusal([&] { read_table(path, arrays()); });
    EXPECT_EQ(text.find(path), 0u) << text;
    return text.substr(std::min(text.size(), path.size()));
  };
  EXPECT_EQ(said("savez(__import__('sys').argv[1], times=t, positions=q)"),
            ": column 'torques' of channels.motor_torque: not there, there are: times, positions");
  EXPECT_EQ(said("savez(__import__('sys').argv[1], times=t, positions=q[:, :1], torques=q)"),
            ", array positions: has 1 columns: channels.motor_position must say which as element, from 1");
  EXPECT_EQ(said("savez(__import__('sys').argv[1], times=t, positions=q[:2], torques=q)"),
            ", array positions: has 2 rows, times has 3");
  EXPECT_EQ(said("savez(__import__('sys').argv[1], times=t, positions=q.reshape(1, 3, 2), torques=q)"),
            ", array positions: has the shape (1, 3, 2), expected one or two dimensions");
  EXPECT_EQ(said("savez(__import__('sys').argv[1], times=t, positions=np.array(['a', 'b', 'c']), torques=q)"),
            ", array positions: holds '<U1', expected whole or floating-point numbers of 1 to 8 bytes");
  std::ofstream(folder_.path("cut.npz")) << "PK";
  EXPECT_NE(refusal([&] { read_table(folder_.path("cut.npz"), arrays()); }).find("is no archive of NumPy"),
            std::string::npos);
  EXPECT_THROW(read_table(folder_.path("absent.npz"), arrays()), MissingInput);
}

}  // namespace
}  // namespace backlash::record
