// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::rig_file {
namespace {

namespace fs = std::filesystem;

class TestRuns : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("test_runs_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  RigFile load(const std::string& runs, const std::string& link = "{inertia: 0.01}") const {
    write("rig.yaml",
          "schema_version: 1\nname: rig\njoint: elbow\n"
          "gear_train:\n"
          "  reduction_ratio: 4\n"
          "  motor: {inertia: 1.0e-3, viscous_damping: 0.1}\n"
          "  input_coupling: rigid\n"
          "  mesh: {backlash_angle: 1.0e-4, contact: {law: linear, stiffness: 1.0e4, damping: 10}}\n"
          "  output_coupling: rigid\n"
          "  link: " +
              link +
              "\n"
              "excitation: {type: sine, amplitude: 1, frequency: 2}\n"
              "sensors: {sampling_rate: 500, seed: 3}\n"
              "diagnosis: {}\n" +
              runs);
    return load_rig_file((folder_ / "rig.yaml").string());
  }

  /// What the loader says against it.
  std::string refusal(const std::string& runs, const std::string& link = "{inertia: 0.01}") const {
    try {
      load(runs, link);
    } catch (const BadData& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

const char* const kRuns =
    "test_runs:\n"
    "  walk: {duration: 2, excitation: {type: constant, torque: 0.5}}\n"
    "  alone: {duration: 3, without_load: true, excitation: {type: constant, torque: 0.5}}\n"
    "  hand: {duration: 4.5, excitation: {type: topic, at: load, motor_brake: true}}\n";

void expect_the_runs(const std::vector<TestRun>& runs) {
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_EQ(runs[0].name, "walk");  // in the order of the file
  EXPECT_EQ(runs[1].name, "alone");
  EXPECT_EQ(runs[2].name, "hand");
  EXPECT_EQ(runs[2].duration, 4.5);
  EXPECT_TRUE(runs[2].excitation.at_load && runs[2].excitation.motor_brake);
  EXPECT_FALSE(runs[0].without_load || runs[2].without_load);
  EXPECT_TRUE(runs[1].without_load);
}

TEST_F(TestRuns, ArePartOfTheRigFileOrOfAFileBesideIt) {
  EXPECT_TRUE(load("").test_runs.empty());
  expect_the_runs(load(kRuns).test_runs);
  write("list.yaml", std::string("schema_version: 1\n") + kRuns);
  expect_the_runs(load("test_runs: list.yaml\n").test_runs);
}

TEST_F(TestRuns, ReplaceTheExcitationOfTheRig) {
  RigFile file = load(kRuns);
  apply_test_run(find_test_run(file.test_runs, "walk"), file);
  EXPECT_EQ(file.simulation.excitation.type, "constant");
  const record::Record record = simulation::simulate_record(file.rig, file.simulation, 2);
  EXPECT_EQ(record.column(record::Channel::motor_torque).front(), 0.5);
  EXPECT_GT(record.column(record::Channel::load_position).back(), 1);
}

TEST_F(TestRuns, WithoutLoadTheDriverIsAlone) {
  RigFile file = load(kRuns);
  apply_test_run(find_test_run(file.test_runs, "alone"), file);
  const record::Record record = simulation::simulate_record(file.rig, file.simulation, 2);
  for (const double position : record.column(record::Channel::load_position)) EXPECT_EQ(position, 0);
  EXPECT_NEAR(record.column(record::Channel::motor_velocity).back(), 0.5 / 0.1, 1e-5);  // 200 time constants
}

TEST_F(TestRuns, AnUnknownNameIsRefusedWithThoseThatThereAre) {
  const auto complaint = [](const RigFile& file, const std::string& name) -> std::string {
    try {
      find_test_run(file.test_runs, name);
    } catch (const InvalidParameter& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint(load(kRuns), "run"), "run = 'run': must be one of walk, alone, hand");
  EXPECT_EQ(complaint(load(""), "walk"), "run = 'walk': the rig file has no test_runs");
}

TEST_F(TestRuns, RefusalsNameFileAndKey) {
  const std::string rig = (folder_ / "rig.yaml").string(), list = (folder_ / "list.yaml").string();
  const auto expect = [](const std::string& refusal, const std::string& file, const std::string& part) {
    EXPECT_EQ(refusal.rfind(file + ":", 0), 0u) << refusal;
    EXPECT_NE(refusal.find(part), std::string::npos) << refusal << " lacks " << part;
  };
  const std::string still = "excitation: {type: constant, torque: 0}";
  expect(refusal("test_runs: {a: {" + still + "}}\n"), rig, "test_runs.a.duration: is missing");
  expect(refusal("test_runs: {a: {duration: 0, " + still + "}}\n"), rig, "test_runs.a.duration = 0");
  expect(refusal("test_runs: {a: {duration: 1}}\n"), rig, "test_runs.a.excitation: is missing");
  expect(refusal("test_runs: {a: {duration: 1, colour: 2, " + still + "}}\n"), rig, "test_runs.a.colour");
  expect(refusal("test_runs: {a: {duration: 1, excitation: {type: saw}}}\n"), rig,
         "test_runs.a.excitation.type");
  expect(refusal("test_runs: {a: {duration: 1, without_load: true, excitation: {type: topic, at: load}}}\n"),
         rig, "test_runs.a.without_load");
  expect(refusal("test_runs: {a: {duration: 1, excitation: {type: topic, at: load}}}\n", "locked"), rig,
         "test_runs.a.excitation.at = load: the link is locked");
  expect(refusal("test_runs: 5: 6\n"), rig, "");
  write("list.yaml", "schema_version: 1\ntest_runs: {}\nmore: 1\n");
  expect(refusal("test_runs: list.yaml\n"), list, "more = 1: unknown key");
  write("list.yaml", "test_runs: {}\n");
  expect(refusal("test_runs: list.yaml\n"), list, "schema_version");
  EXPECT_THROW(load("test_runs: none.yaml\n"), MissingInput);
  EXPECT_THROW(load("test_runs: .\n"), MissingInput);
}

TEST_F(TestRuns, ALoadTorqueOnALockedLinkIsRefusedAlsoAsTheRigsOwn) {
  load("");
  std::ifstream in(folder_ / "rig.yaml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.replace(text.find("link: {inertia: 0.01}"), 21, "link: locked");
  text.replace(text.find("frequency: 2}"), 13, "frequency: 2, at: load}");
  EXPECT_THROW(rig_file_from_text(text, "rig.yaml"), BadData);
}

}  // namespace
}  // namespace backlash::rig_file
