// SPDX-License-Identifier: BSD-3-Clause
// Oracles: files that another implementation wrote (test/data/recording/make.mjs), a SQLite file made here by
// rosbag2's tables, and the formula that the values of all of them follow.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/recording/mcap_writer.h"
#include "backlash_diagnosis/recording/recording.h"

namespace backlash::recording {
namespace {

const std::string kFolder = std::string(BACKLASH_DIAGNOSIS_SOURCE_DIR) + "/test/data/recording/";
const std::string kTopic = "/joint_states";
constexpr int kMessages = 30;

JointState message_of(int i) {
  JointState m;
  m.seconds = 1'700'000'000;
  m.nanoseconds = static_cast<std::uint32_t>(i) * 1'000'000;
  m.name = {"elbow_motor", "elbow_load"};
  m.position = {0.1 * i, 0.1 * i - 0.01};
  m.effort = {std::sin(i), std::nan("")};
  return m;
}

/// The messages of a file, each checked against the formula; how many there were.
int checked(const std::string& path, std::vector<std::string>* warnings = nullptr) {
  const auto recording = open_recording(path);
  int count = 0;
  recording->topics();
  recording->read({kTopic}, [&](const Message& read) {
    EXPECT_EQ(read.topic, kTopic);
    JointState m;
    read_cdr(read.data, read.size, "message", m);
    const JointState wanted = message_of(count++);
    EXPECT_EQ(m.seconds, wanted.seconds);
    EXPECT_EQ(m.nanoseconds, wanted.nanoseconds);
    EXPECT_EQ(m.name, wanted.name);
    EXPECT_EQ(m.position, wanted.position);
    EXPECT_TRUE(m.velocity.empty());
    ASSERT_EQ(m.effort.size(), 2u);
    EXPECT_NEAR(m.effort[0], wanted.effort[0], 1e-15);  // the sine of another library
    EXPECT_TRUE(std::isnan(m.effort[1]));
  });
  if (warnings) *warnings = recording->warnings();
  return count;
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(Cdr, BytesOfTheSpecification) {
  // Stamp 1.000000002 s, frame "b", name "ab", one position; alignment counts from behind the header.
  const Bytes fixed = {
      0, 1, 0, 0,                                      // header: little endian
      1, 0, 0, 0, 2,   0, 0, 0,                        // stamp
      2, 0, 0, 0, 'b', 0, 0, 0,                        // frame, to a multiple of 4
      1, 0, 0, 0, 3,   0, 0, 0, 'a', 'b', 0,    0,     // name
      1, 0, 0, 0, 0,   0, 0, 0, 0,   0,   0xF8, 0x3F,  // position at byte 32 of the fields: 1.5
      0, 0, 0, 0, 0,   0, 0, 0};                       // no velocity, no effort
  JointState m;
  read_cdr(fixed.data(), fixed.size(), "message", m);
  EXPECT_EQ(m.seconds, 1);
  EXPECT_EQ(m.nanoseconds, 2u);
  EXPECT_EQ(m.name, std::vector<std::string>{"ab"});
  EXPECT_EQ(m.position, std::vector<double>{1.5});
  for (std::size_t cut = 0; cut < fixed.size(); ++cut)
    EXPECT_THROW(read_cdr(fixed.data(), cut, "message", m), BadData) << cut;
}

TEST(Mcap, FilesOfAnotherWriter) {
  for (const char* name : {"plain.mcap", "chunks.mcap", "lz4.mcap", "zstd.mcap"}) {
    std::vector<std::string> warnings;
    EXPECT_EQ(checked(kFolder + name, &warnings), kMessages) << name;
    EXPECT_TRUE(warnings.empty()) << name;
    const auto topics = open_recording(kFolder + name)->topics();
    ASSERT_EQ(topics.size(), 1u);
    EXPECT_EQ(topics[0].type, kJointStateType);
    EXPECT_EQ(topics[0].encoding, "cdr");
  }
}

TEST(Mcap, CutAnywhere) {
  const ScratchFolder folder;
  const std::string path = folder.path("cut.mcap");
  for (const char* name : {"plain.mcap", "lz4.mcap", "zstd.mcap"}) {
    const std::string whole = bytes_of(kFolder + name);
    int before = 0;
    for (std::size_t size = 0; size < whole.size(); size += 3) {
      write(path, whole.substr(0, size));
      try {
        std::vector<std::string> warnings;
        const int count = checked(path, &warnings);
        EXPECT_GE(count, before);
        EXPECT_FALSE(warnings.empty()) << name << " cut at " << size;
        before = count;
      } catch (const BadData&) {
        EXPECT_EQ(before, 0) << name << " cut at " << size;
      }
    }
    EXPECT_EQ(before, kMessages);
  }
}

TEST(Mcap, FlippedBytesAreNeverTakenForData) {
  const ScratchFolder folder;
  const std::string path = folder.path("flipped.mcap");
  for (const char* name : {"lz4.mcap", "zstd.mcap"}) {
    const std::string whole = bytes_of(kFolder + name);
    for (std::size_t i = 0; i < whole.size(); i += 5) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(bytes[i] ^ (1 << (i % 8)));
      write(path, bytes);
      try {
        std::vector<std::string> warnings;
        const int count = checked(path, &warnings);
        EXPECT_TRUE(count == kMessages || !warnings.empty()) << name << " byte " << i;
      } catch (const BadData&) {
      }
    }
  }
}

TEST(Mcap, WhatIsWrittenIsRead) {
  const ScratchFolder folder;
  const std::string path = folder.path("a.mcap");
  McapWriter out(path);
  const auto channel = out.add_channel(kTopic, kJointStateType, kJointStateDefinition);
  for (int i = 0; i < kMessages; ++i)
    out.write(channel, 1'700'000'000'000'000'000u + static_cast<std::uint64_t>(i), to_cdr(message_of(i)));
  out.close();
  EXPECT_EQ(checked(path), kMessages);
}

/// rosbag2's tables by hand, the messages in another order than their times, or in theirs.
void write_sqlite(const std::string& path, const std::string& format = "cdr", int messages = kMessages,
                  bool in_order = false) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  const std::string text =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format "
      "TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
      "data "
      "BLOB NOT NULL);"
      "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
      "INSERT INTO topics VALUES(1,'/rosout','rcl_interfaces/msg/Log','cdr','');"
      "INSERT INTO topics VALUES(2,'/joint_states','sensor_msgs/msg/JointState','" +
      format + "','');";
  ASSERT_EQ(sqlite3_exec(db, text.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_exec(db, "BEGIN", nullptr, nullptr, nullptr);
  sqlite3_stmt* insert = nullptr;
  sqlite3_prepare_v2(db, "INSERT INTO messages(topic_id,timestamp,data) VALUES(2,?,?)", -1, &insert, nullptr);
  for (int k = 0; k < messages; ++k) {
    const int i = in_order ? k : messages - 1 - k;
    const Bytes data = to_cdr(message_of(i));
    sqlite3_bind_int64(insert, 1, 1000 + i);
    sqlite3_bind_blob(insert, 2, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    sqlite3_step(insert);
    sqlite3_reset(insert);
  }
  sqlite3_finalize(insert);
  sqlite3_exec(db, "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_close(db);
}

TEST(Sqlite, FileAndFolder) {
  const ScratchFolder folder;
  write_sqlite(folder.path("run 0%.db3"));
  EXPECT_EQ(checked(folder.path("run 0%.db3")), kMessages);
  std::vector<std::string> warnings;
  EXPECT_TRUE(is_recording(folder.path("")));  // without metadata
  EXPECT_EQ(checked(folder.path(""), &warnings), kMessages);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("all files of the folder were read"), std::string::npos) << warnings[0];
  write(folder.path("metadata.yaml"),
        "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: sqlite3\n"
        "  relative_file_paths:\n    - run 0%.db3\n");
  EXPECT_TRUE(is_recording(folder.path("")));
  EXPECT_EQ(checked(folder.path(""), &warnings), kMessages);
  EXPECT_TRUE(warnings.empty());
  for (const char* metadata :  // of recorders that were killed
       {"", "rosbag2_bagfile_information:\n  storage_identifier: \"\"\n  relative_file_paths: []\n",
        "rosbag2_bagfile_information:\n  relative_file_paths: [other.db3]\n"}) {
    write(folder.path("metadata.yaml"), metadata);
    EXPECT_EQ(checked(folder.path(""), &warnings), kMessages) << metadata;
    EXPECT_EQ(warnings.size(), 1u) << metadata;
  }
  std::filesystem::remove(folder.path("run 0%.db3"));
  write(folder.path("metadata.yaml"),
        "rosbag2_bagfile_information:\n  relative_file_paths:\n    - run.db3.zstd\n");
  EXPECT_THROW(open_recording(folder.path("")), BadData);
}

// Parts of one recording in files whose names are in another order, the last two overlapping.
TEST(Mcap, SplitFilesAreReadByTheirTimes) {
  const ScratchFolder folder;
  const auto part = [&](const std::string& name, int from, int to, int step) {
    McapWriter out(folder.path(name));
    const auto channel = out.add_channel(kTopic, kJointStateType, kJointStateDefinition);
    for (int i = from; i < to; i += step)
      out.write(channel, 1'700'000'000'000'000'000u + static_cast<std::uint64_t>(i), to_cdr(message_of(i)));
    out.close();
  };
  part("c_0.mcap", 0, 10, 1);
  part("a_1.mcap", 10, kMessages, 2);
  part("b_2.mcap", 11, kMessages, 2);
  EXPECT_EQ(checked(folder.path("")), kMessages);
  write(folder.path("d_3.mcap"), "no such file");
  std::vector<std::string> warnings;
  EXPECT_EQ(checked(folder.path(""), &warnings), kMessages);
}

TEST(Mcap, NoiseBehindTheCutIsSaidAndNotRead) {
  const ScratchFolder folder;
  const std::string path = folder.path("cut.mcap");
  std::string noise(2000, '\0');
  std::uint32_t state = 1;
  for (char& c : noise) c = static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
  for (const char* name : {"plain.mcap", "chunks.mcap", "zstd.mcap"}) {
    const std::string whole = bytes_of(kFolder + name);
    write(path, whole.substr(0, whole.size() * 7 / 10) + noise);
    try {
      std::vector<std::string> warnings;
      const int count = checked(path, &warnings);
      EXPECT_LE(count, kMessages) << name;
      EXPECT_FALSE(warnings.empty()) << name;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find("byte"), std::string::npos) << name << error.what();
    }
  }
}

// 400 messages on 11 pages, which checked() compares one by one.
TEST(Sqlite, CutAnywhereIsReadUpToThere) {
  const ScratchFolder folder;
  constexpr int kAll = 400;
  write_sqlite(folder.path("whole.db3"), "cdr", kAll, true);
  const std::string whole = bytes_of(folder.path("whole.db3")), path = folder.path("cut.db3");
  EXPECT_THROW(open_recording(folder.path("none.db3")), MissingInput);
  int before = 0;
  for (std::size_t size = 0; size < whole.size(); size += 1511) {
    write(path, whole.substr(0, size));
    try {
      std::vector<std::string> warnings;
      const int count = checked(path, &warnings);
      EXPECT_GE(count, before) << size;
      ASSERT_EQ(warnings.size(), 1u) << size;
      EXPECT_NE(warnings[0].find("the file was cut off"), std::string::npos) << warnings[0];
      before = count;
    } catch (const Error&) {
      EXPECT_EQ(before, 0) << size;
    }
  }
  EXPECT_LE(before, kAll);
  EXPECT_GT(before, kAll * 8 / 10);
}

// What a page holds grows from its end towards its beginning, so that noise is met before what it touches.
TEST(Sqlite, NoiseIsNeverTakenForData) {
  const ScratchFolder folder;
  constexpr int kAll = 400;
  write_sqlite(folder.path("whole.db3"), "cdr", kAll, true);
  const std::string whole = bytes_of(folder.path("whole.db3")), path = folder.path("noise.db3");
  std::uint32_t state = 1;
  for (const std::size_t behind : {0u, 2000u, 200'000u})  // noise in place of the rest, shorter and longer
    for (std::size_t cut = whole.size() / 2; cut < whole.size(); cut += 3001) {
      std::string noise(behind == 0 ? whole.size() - cut : behind, '\0');
      for (char& c : noise) c = static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
      write(path, whole.substr(0, cut) + noise);
      std::vector<std::string> warnings;
      EXPECT_GT(checked(path, &warnings), kAll * 2 / 10) << cut;
      EXPECT_LE(warnings.size(), 1u);
    }
}

}  // namespace
}  // namespace backlash::recording
