// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::record {
namespace {

namespace fs = std::filesystem;

Record parse(const std::string& text) {
  std::istringstream in(text);
  return read_csv(in, "run.csv");
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const BadData& error) {
    return error.what();
  }
  return "nothing thrown";
}

class CsvFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / "backlash_csv_XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  std::string folder_;
};

TEST(Csv, ReadsColumnsInAnyOrder) {
  const Record record = parse(
      "sensor_torque,time,motor_torque,motor_position,motor_velocity,load_position,load_velocity,"
      "reference_position,acceleration,motor_current\n"
      "1,0,2,3,4,5,6,7,8,9\n"
      "-1e-3,0.5,+2.5,.5,5.,0,-0,1E2,-8,0.9\n"
      "1,1,2,3,4,5,6,7,8,9\n");
  EXPECT_EQ(record.name, "run.csv");
  EXPECT_EQ(record.time, (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(record.column(Channel::sensor_torque), (std::vector<double>{1, -1e-3, 1}));
  EXPECT_EQ(record.column(Channel::motor_torque), (std::vector<double>{2, 2.5, 2}));
  EXPECT_EQ(record.column(Channel::motor_position), (std::vector<double>{3, 0.5, 3}));
  EXPECT_EQ(record.column(Channel::motor_velocity), (std::vector<double>{4, 5, 4}));
  EXPECT_EQ(record.column(Channel::load_position), (std::vector<double>{5, 0, 5}));
  EXPECT_EQ(record.column(Channel::load_velocity), (std::vector<double>{6, 0, 6}));
  EXPECT_EQ(record.column(Channel::reference_position), (std::vector<double>{7, 100, 7}));
  EXPECT_EQ(record.column(Channel::acceleration), (std::vector<double>{8, -8, 8}));
  EXPECT_EQ(record.column(Channel::motor_current), (std::vector<double>{9, 0.9, 9}));
  EXPECT_TRUE(record.warnings.empty());
}

TEST(Csv, HarmlessVariationsReadTheSame) {
  for (const char* text :
       {"time,motor_torque\n0,1\n1,2\n2,3\n", "time,motor_torque\n0,1\n1,2\n2,3",
        "\xef\xbb\xbftime,motor_torque\n0,1\n1,2\n2,3\n", "time,motor_torque\r\n0,1\r\n1,2\r\n2,3\r\n",
        "time,motor_torque\r\n0,1\r\n1,2\r\n2,3", " time ,\tmotor_torque \n 0 , 1\n1,\t2\t\n2,3 \n",
        "time,motor_torque\n0,1\n1,2\n2,3\n\n \r\n\n"}) {
    const Record record = parse(text);
    EXPECT_EQ(record.time, (std::vector<double>{0, 1, 2})) << text;
    EXPECT_EQ(record.column(Channel::motor_torque), (std::vector<double>{1, 2, 3})) << text;
    EXPECT_TRUE(record.warnings.empty()) << text;
  }
}

TEST(Csv, OneSampleAndAnyChannelOfMotionIsEnough) {
  for (const char* channel : {"motor_torque", "sensor_torque", "motor_position", "load_position",
                              "motor_current", "acceleration", "output_torque"}) {
    EXPECT_EQ(parse("time," + std::string(channel) + "\n0,1\n").column(channel_from_name(channel)).size(),
              1u);
  }
}

const std::string kHeader = "time,motor_torque\n";

struct Malformed {
  std::string text, message;
};

TEST(Csv, MalformedHeadersAreRefusedWithPlaceAndReason) {
  const std::string known =
      "known are time, motor_torque, motor_position, motor_velocity, load_position, load_velocity, "
      "sensor_torque, "
      "reference_position, motor_current, acceleration, output_torque; a file with names of its own, or "
      "none, "
      "is read by `channels` of a rig file (--rig)";
  const std::string needed =
      "no torque, position, speed of the motor, current or acceleration: needs at least one of motor_torque, "
      "sensor_torque, "
      "motor_position, motor_velocity, load_position, motor_current, acceleration, output_torque; "
      "there are: ";
  const Malformed cases[] = {
      {"", "run.csv:1: empty, expected column names"},
      {"\xef\xbb\xbf", "run.csv:1: an empty line, expected column names"},
      {"\n" + kHeader + "0,1\n", "run.csv:1: an empty line, expected column names"},
      {"time,torque\n0,1\n", "run.csv:1: column = 'torque': unknown, " + known},
      {"Time,motor_torque\n0,1\n", "run.csv:1: column = 'Time': unknown, " + known},
      {"\"time\",motor_torque\n", "run.csv:1: column = '\"time\"': unknown, " + known},
      {"0,1\n1,2\n", "run.csv:1: column = '0': unknown, " + known},
      {"time,motor_torque,time\n", "run.csv:1: column = 'time': there twice"},
      {"time,motor_torque, motor_torque\n", "run.csv:1: column = 'motor_torque': there twice"},
      {"time,motor_torque,\n", "run.csv:1: column 3 has no name"},
      {"motor_torque\n1\n", "run.csv:1: no column 'time'; there are: motor_torque"},
      {"time\n0\n", "run.csv:1: " + needed + "time"},
      {"time,load_velocity,reference_position\n",
       "run.csv:1: " + needed + "time, load_velocity, reference_position"},
      {"time;motor_torque\n0;1\n", "run.csv:1: separator is ';', expected ','"},
      {"time\tmotor_torque\n0\t1\n", "run.csv:1: separator is '\\t', expected ','"},
      {std::string("t\0ime,motor_torque\n", 19), "run.csv:1: contains a NUL byte: not a text file in UTF-8"},
      {"\x89PNG\x1a,x\n", "run.csv:1: column = '\\x89PNG\\x1a': unknown, " + known},
      {"time,motor_torque\r0,1\r1,2\r", "run.csv:1: column = 'motor_torque\\x0d0': unknown, " + known},
      {kHeader, "run.csv: no data: there are only column names"},
      {kHeader + "\n\n", "run.csv: no data: there are only column names"},
      {std::string(2 << 20, 'x'), "run.csv:1: line is longer than 1048576 bytes"},
  };
  for (const Malformed& c : cases) {
    EXPECT_EQ(message_of([&] { parse(c.text); }), c.message) << c.text.substr(0, 80);
  }
}

TEST(Csv, ACellMayBeNoNumber) {
  const Record record = parse("time,motor_torque,motor_position\n0,nan,2\n1,3,NaN\n2,,4\n3,-Inf,null\n");
  const auto& torque = record.column(Channel::motor_torque);
  const auto& position = record.column(Channel::motor_position);
  ASSERT_EQ(torque.size(), 4u);
  for (const std::size_t k : {0, 2, 3}) EXPECT_TRUE(std::isnan(torque[k])) << k;
  for (const std::size_t k : {1, 3}) EXPECT_TRUE(std::isnan(position[k])) << k;
  EXPECT_EQ(torque[1], 3);
  EXPECT_EQ(position[2], 4);
}

TEST(Csv, ARowThatComesLateIsDropped) {
  const Record record = parse("time,motor_torque\n0,1\n1,2\n3,4\n2,3\n4,5\n");
  EXPECT_EQ(record.time, (std::vector<double>{0, 1, 3, 4}));
  EXPECT_EQ(record.column(Channel::motor_torque), (std::vector<double>{1, 2, 4, 5}));
  EXPECT_EQ(record.repeated_stamps, 1u);
}

TEST(Csv, MalformedRowsAreRefusedWithPlaceColumnAndText) {
  const Malformed cases[] = {
      {"0,1\n1,abc\n", "run.csv:3: motor_torque = 'abc': not a number"},
      {"0,1\nx,1\n", "run.csv:3: time = 'x': not a number"},
      {"0,1.5Nm\n", "run.csv:2: motor_torque = '1.5Nm': not a number"},
      {"0,1 2\n", "run.csv:2: motor_torque = '1 2': not a number"},
      {"0,0x10\n", "run.csv:2: motor_torque = '0x10': not a number"},
      {"0,+-1\n", "run.csv:2: motor_torque = '+-1': not a number"},
      {"0,\"1\"\n", "run.csv:2: motor_torque = '\"1\"': not a number"},
      {"NaN,1\n", "run.csv:2: time = 'NaN': not a finite number"},
      {"0,1e999\n", "run.csv:2: motor_torque = '1e999': too large or too small for a double"},
      {" ,1\n", "run.csv:2: time = '': empty"},
      {"0\n", "run.csv:2: 1 field in '0', expected 2: time, motor_torque"},
      {"0,1\n0,5,1,5\n", "run.csv:3: 4 fields in '0,5,1,5', expected 2: time, motor_torque"},
      {"0,1,\n", "run.csv:2: 3 fields in '0,1,', expected 2: time, motor_torque"},
      {"0;1\n", "run.csv:2: separator is ';', expected ','"},
      {"0\t1\n", "run.csv:2: separator is '\\t', expected ','"},
      {"0,1\n\n1,2\n", "run.csv:3: an empty line amid the data"},
      {"0,1\n# note\n", "run.csv:3: 1 field in '# note', expected 2: time, motor_torque"},
      {std::string("0,1\n1,\0002\n", 9), "run.csv:3: contains a NUL byte: not a text file in UTF-8"},
      {"0,1\n1,\x1b[31m\xff\n", "run.csv:3: motor_torque = '\\x1b[31m\\xff': not a number"},
      {"0,1\n1," + std::string(2 << 20, '1') + "\n", "run.csv:3: line is longer than 1048576 bytes"},
      {"0,1\n1," + std::string(1000, '1') + "\n",
       "run.csv:3: motor_torque = '" + std::string(60, '1') + "...': too large or too small for a double"},
      {"0,1\n0.25,1\n0.2,1\n",
       "run.csv:4: time = '0.2': goes back, the row before has 0.25 s: give what follows as a file of its "
       "own"},
      {"0,1\n1e-3,1\n-1,1\n2,1\n",
       "run.csv:4: time = '-1': goes back, the row before has 0.001 s: give what follows as a file of its "
       "own"},
      {"5,1\n5,1\n4,1\n",
       "run.csv:4: time = '4': goes back, the row before has 5 s: give what follows as a file of its own"},
      {"5,1\n5,x\n",
       "run.csv:3: motor_torque = 'x': not a number"},  // a row that would be dropped is read too
  };
  for (const Malformed& c : cases) {
    EXPECT_EQ(message_of([&] { parse(kHeader + c.text); }), c.message) << c.text.substr(0, 80);
  }
}

TEST(Csv, LinesUpToTheLimitAndAcrossBuffersAreRead) {
  // Rows of 1 MiB less a little, so that every row straddles the buffer of the reader.
  std::string text = kHeader;
  for (int i = 0; i < 5; ++i) {
    const std::string number = std::to_string(i);
    text.append(number).append(",").append(kLongestCsvLine - 10, ' ').append(number).append("\n");
  }
  const Record record = parse(text);
  EXPECT_EQ(record.time, (std::vector<double>{0, 1, 2, 3, 4}));
  EXPECT_EQ(record.column(Channel::motor_torque), record.time);

  const std::string longest = "1," + std::string(kLongestCsvLine - 3, ' ') + "1";
  EXPECT_EQ(parse(kHeader + longest).size(), 1u);
  EXPECT_EQ(parse(kHeader + longest + "\n2,2\n").size(), 2u);
  for (const char* end : {"", "\n", "\n2,2\n"}) {
    EXPECT_EQ(message_of([&] { parse(std::string(kHeader).append(" ").append(longest).append(end)); }),
              "run.csv:2: line is longer than 1048576 bytes");
  }
}

TEST(Csv, RepeatedStampsLoseTheLaterRowWithOneWarning) {
  const Record record = parse(kHeader + "0,1\n1,2\n1,99\n1,98\n2,3\n2,97\n3,4\n");
  EXPECT_EQ(record.time, (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(record.column(Channel::motor_torque), (std::vector<double>{1, 2, 3, 4}));
  ASSERT_EQ(record.warnings.size(), 1u);
  EXPECT_EQ(record.warnings[0],
            "3 repeated time stamps: the later sample dropped; first at line 4, time = 1 s");
}

// Two recordings behind one another. What is out of order within ten rows is refused: see above.
TEST(Csv, RowsWhoseClockBeginsAnewCountOn) {
  std::string text = kHeader;
  for (int k = 0; k < 24; ++k) text += std::to_string(k % 12) + ',' + std::to_string(k) + '\n';
  const Record record = parse(text);
  ASSERT_EQ(record.size(), 24u);
  ASSERT_EQ(record.clock_steps.size(), 1u);
  EXPECT_EQ(record.clock_steps[0].time, record.time[12]);
  EXPECT_EQ(record.clock_steps[0].back, 11);
  EXPECT_EQ(record.time[23] - record.time[12], 11);
  ASSERT_FALSE(record.warnings.empty());
  EXPECT_EQ(record.warnings[0],
            "the time goes back by 11 s after 12 samples: later times count on behind a gap");
}

TEST(Csv, GapsAndJitterAreReported) {
  const Record gap = parse(kHeader + "0,1\n1,1\n2,1\n3,1\n33,1\n34,1\n");
  EXPECT_EQ(
      gap.warnings,
      (std::vector<std::string>{"1 time gap: the longest 30 s after time = 3 s (median interval 1 s)"}));
  const Record jitter = parse(kHeader + "0,1\n1,1\n2.5,1\n3,1\n4,1\n");
  ASSERT_EQ(jitter.warnings.size(), 1u);
  EXPECT_EQ(jitter.warnings[0].rfind("time jitter: ", 0), 0u) << jitter.warnings[0];
}

TEST_F(CsvFileTest, FilesKeepTheirPathAsName) {
  const std::string path = folder_ + "/run.csv";
  std::ofstream(path) << kHeader << "0,1\n1,z\n";
  EXPECT_EQ(message_of([&] { read_csv(path); }), path + ":3: motor_torque = 'z': not a number");
  std::ofstream(path, std::ios::trunc) << kHeader << "0,1\n";
  EXPECT_EQ(read_csv(path).name, path);
}

TEST_F(CsvFileTest, MissingFilesAndFoldersAreMissingInput) {
  EXPECT_THROW(read_csv(folder_ + "/none.csv"), MissingInput);
  EXPECT_THROW(read_csv(folder_), MissingInput);
  EXPECT_THROW(read_csv(std::string()), MissingInput);
}

Record noisy_record(std::size_t samples) {
  Random random(7);
  Record record;
  record.name = "noise";
  for (std::size_t i = 0; i < samples; ++i) {
    record.time.push_back(static_cast<double>(i) * 1e-4);
    record.column(Channel::motor_torque).push_back(random.normal() * 1e-7);
    record.column(Channel::sensor_torque).push_back(random.normal() * 1e12);
    record.column(Channel::reference_position).push_back(std::round(random.normal()));
  }
  return record;
}

TEST_F(CsvFileTest, WhatIsWrittenIsReadBack) {
  const Record record = noisy_record(5000);
  const std::string path = folder_ + "/out.csv";
  write_csv(record, path);
  const Record back = read_csv(path);
  for (const Channel channel : kChannels) EXPECT_EQ(back.column(channel), record.column(channel));
  ASSERT_EQ(back.size(), record.size());
  for (std::size_t i = 0; i < record.size(); ++i) {
    // nine decimals: half a nanosecond, and 1e-15 for the rounding of the comparison itself
    ASSERT_NEAR(back.time[i], record.time[i], 0.5e-9 + 1e-15);
  }
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(files(), 1u);
}

TEST_F(CsvFileTest, ExtremeValuesSurvive) {
  Record record;
  record.time = {-1, 1700000000.123456, 1700000000.125};
  record.column(Channel::load_position) = {5e-324, -std::numeric_limits<double>::max(), 0.1};
  const std::string path = folder_ + "/out.csv";
  write_csv(record, path);
  const Record back = read_csv(path);
  EXPECT_EQ(back.column(Channel::load_position), record.column(Channel::load_position));
  EXPECT_EQ(back.time,
            record.time);  // a double of this size has a resolution of 2e-7 s, coarser than nine decimals
}

TEST_F(CsvFileTest, TheTextIsShort) {
  Record record;
  record.time = {0, 0.1 + 0.2, 1};
  record.column(Channel::motor_torque) = {1, -0.05, 1e-5};
  record.column(Channel::motor_position) = {0, 2, 3};
  const std::string path = folder_ + "/out.csv";
  write_csv(record, path);
  std::ifstream in(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}),
            "time,motor_torque,motor_position\n0,1,0\n0.3,-0.05,2\n1,1e-05,3\n");
}

TEST_F(CsvFileTest, WhatCouldNotBeReadBackIsNotWritten) {
  const std::string path = folder_ + "/out.csv";
  const auto broken = [&](const std::function<void(Record&)>& change) {
    Record record = noisy_record(3);
    change(record);
    return message_of([&] { write_csv(record, path); });
  };
  EXPECT_EQ(broken([](Record& r) { r = Record(); }), ": a record without samples cannot be written");
  EXPECT_EQ(broken([](Record& r) {
              r.column(Channel::motor_torque).clear();
              r.column(Channel::sensor_torque).clear();
            }),
            "noise: a record needs at least one of motor_torque, sensor_torque, motor_position, "
            "motor_velocity, load_position, motor_current, acceleration, output_torque to be written");
  EXPECT_EQ(broken([](Record& r) { r.column(Channel::motor_torque).pop_back(); }),
            "noise: motor_torque has 2 values, time has 3");
  EXPECT_EQ(broken([](Record& r) { r.column(Channel::sensor_torque)[1] = std::nan(""); }),
            "noise: sensor_torque = nan in sample 1: not a finite number");
  EXPECT_EQ(broken([](Record& r) { r.time[2] = std::numeric_limits<double>::infinity(); }),
            "noise: time = inf s in sample 2: not a finite number");
  EXPECT_EQ(broken([](Record& r) {
              r.time = {0, 2, 1};
            }),
            "noise: time = 1 s in sample 2: does not increase by at least 1 ns");
  EXPECT_EQ(broken([](Record& r) {
              r.time = {0, 1, 1 + 1e-11};
            }),
            "noise: time = 1.00000000001 s in sample 2: does not increase by at least 1 ns");
  EXPECT_EQ(files(), 0u);
}

TEST_F(CsvFileTest, PlacesThatCannotBeWrittenAreNamed) {
  EXPECT_THROW(write_csv(noisy_record(3), folder_), CannotWrite);
  EXPECT_THROW(write_csv(noisy_record(3), folder_ + "/none/out.csv"), CannotWrite);
  EXPECT_EQ(files(), 0u);
}

// Whatever the bytes are: a record that fits together, or BadData that names the source.
TEST(Csv, RandomTextsEndInARecordOrBadData) {
  Random random(20240502);
  const std::string source = "time,motor_torque,load_position\n0,1,2\n0.1,1.5,-2e-3\n0.2,1,3\n0.3,+4,5\n";
  const std::string alphabet = "0123456789.,-+e\n\r\t; \"";
  int read = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = source;
    const std::size_t changes = 1 + random.below(3);
    for (std::size_t k = 0; k < changes; ++k) {
      const std::size_t at = i % 4 == 0 ? random.below(text.size()) : 32 + random.below(text.size() - 32);
      const char c = random.below(8) == 0 ? static_cast<char>(random.below(256))
                                          : alphabet[random.below(alphabet.size())];
      if (random.below(3) == 0) {
        text.erase(at, 1);
      } else {
        text[at] = c;
      }
    }
    try {
      const Record record = parse(text);
      ++read;
      ASSERT_GT(record.size(), 0u) << text;
      for (std::size_t k = 1; k < record.size(); ++k) ASSERT_GT(record.time[k], record.time[k - 1]) << text;
      for (const Channel channel : kChannels) {
        ASSERT_TRUE(!record.has(channel) || record.column(channel).size() == record.size()) << text;
      }
    } catch (const BadData& error) {
      ASSERT_EQ(std::string(error.what()).rfind("run.csv:", 0), 0u) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(read, 1000);  // both branches are met; the exact shares follow from the seed
  EXPECT_GT(refused, 1000);
}

TEST(Csv, ColumnsOfSeveralJointsAreOneRecordEach) {
  std::istringstream in("time,b/motor_position,a/motor_current,a/motor_position\n0,1,2,3\n1,4,5,6\n");
  const std::vector<JointRecord> joints = read_joints_csv(in, "run.csv");
  ASSERT_EQ(joints.size(), 2u);
  EXPECT_EQ(joints[0].joint, "b");
  EXPECT_EQ(joints[1].joint, "a");
  EXPECT_EQ(joints[0].record.column(Channel::motor_position), (std::vector<double>{1, 4}));
  EXPECT_EQ(joints[1].record.column(Channel::motor_current), (std::vector<double>{2, 5}));
  EXPECT_EQ(joints[1].record.time, (std::vector<double>{0, 1}));
  EXPECT_EQ(record_of_joint(joints, "a", "run.csv").column(Channel::motor_position),
            (std::vector<double>{3, 6}));
  EXPECT_EQ(message_of([&] { record_of_joint(joints, "c", "run.csv"); }),
            "run.csv: several joints: b, a; the rig file asks for joint 'c'");
  EXPECT_EQ(message_of([&] { parse("time,a/motor_position,motor_torque\n0,1,2\n"); }),
            "run.csv:1: some columns name their joint and some do not: all or none must (JOINT/channel)");
  EXPECT_EQ(message_of([&] { parse("time,a/motor_position,b/reference_position\n0,1,2\n"); }).substr(0, 26),
            "run.csv:1: joint 'b': no t");
  EXPECT_EQ(message_of([&] { parse("time,a/motor_position,a/motor_position\n0,1,2\n"); }),
            "run.csv:1: column = 'a/motor_position': there twice");
  EXPECT_EQ(message_of([&] { parse("time,/motor_position\n0,1\n"); }).substr(0, 40),
            "run.csv:1: column = '/motor_position': u");
}

}  // namespace
}  // namespace backlash::record
