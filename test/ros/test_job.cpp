// SPDX-License-Identifier: BSD-3-Clause
// Jobs with the shell in place of a command of this package.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/ros/job.h"

namespace backlash::ros_bridge {
namespace {

using SteadyClock = std::chrono::steady_clock;

Job shell(const std::string& script) {
  Job job;
  job.words = {"/bin/sh", "-c", script};
  return job;
}

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

std::string failure(const Job& job) {
  try {
    run_job(job);
  } catch (const JobFailed& error) {
    return error.what();
  }
  return "no failure";
}

TEST(Job, ReportsHowFarItIsAndWhatItHas) {
  Job job = shell(
      "echo 'no progress'; echo '{\"fraction\":0.25,\"phase\":\"first\",\"best\":\"a\"}'; sleep 0.3;"
      "echo '{\"fraction\":0.75,\"phase\":\"second\",\"best\":\"b\"}'; sleep 0.3; exit 3");
  job.done = {0, 3};
  std::vector<std::string> phases, bests;
  job.progress = [&](double fraction, const std::string& phase) {
    EXPECT_EQ(fraction, phase == "starting" ? 0 : phase == "first" ? 0.25 : 0.75);
    if (phases.empty() || phases.back() != phase) phases.push_back(phase);
    return true;
  };
  job.best_so_far = [&](const std::string& best) { bests.push_back(best); };
  run_job(job);
  if (!phases.empty() && phases.front() == "starting") phases.erase(phases.begin());  // it may be quicker
  EXPECT_EQ(phases, (std::vector<std::string>{"first", "second"}));
  EXPECT_EQ(bests, (std::vector<std::string>{"a", "b"}));
}

TEST(Job, RunsAtTheLowestPriorityAndIsTheFirstToBeEnded) {
  Job job = shell("echo \"$(nice) $(cat /proc/self/oom_score_adj)\" >&2; exit 1");
  EXPECT_EQ(failure(job), "19 1000");
}

TEST(Job, FailuresAreReportedInItsLastWords) {
  EXPECT_EQ(failure(shell("echo first >&2; echo 'sh: no such record' >&2; exit 66")), "no such record");
  EXPECT_EQ(failure(shell("exit 5")), "sh ended with exit code 5");
  EXPECT_NE(failure(shell("kill -9 $$")).find("sh was ended by signal 9"), std::string::npos);
  Job missing;
  missing.words = {"/nowhere/command"};
  EXPECT_EQ(failure(missing), "cannot be started");
}

// 2 GB where 0.5 are allowed: the job fails, nobody else.
TEST(Job, MemoryIsBounded) {
  Job job;
  job.words = {"/usr/bin/python3", "-c", "x = bytes(2 * 10**9)"};
  job.memory = 0.5;
  EXPECT_EQ(failure(job), "MemoryError");
  job.memory = 3;
  EXPECT_EQ(failure(job), "no failure");
  job.memory = 0;
  EXPECT_THROW(run_job(job), InvalidParameter);
}

TEST(Job, IsCancelledWithinASecondAlsoWhereItDoesNotListen) {
  const ScratchFolder scratch;
  for (const std::string trap : {"", "trap '' TERM; "}) {
    const std::string file = scratch.path("id");
    Job job = shell(fmt::format("{}echo $$ >{}; while :; do sleep 0.1; done", trap, file));
    const auto start = SteadyClock::now();
    SteadyClock::time_point asked;
    job.progress = [&](double, const std::string&) {
      asked = SteadyClock::now();
      return seconds_since(start) < 0.5;
    };
    EXPECT_THROW(run_job(job), Cancelled);
    EXPECT_LT(seconds_since(asked), 1);
    std::FILE* const stream = std::fopen(file.c_str(), "r");
    ASSERT_TRUE(stream);
    int id = 0;
    EXPECT_EQ(std::fscanf(stream, "%d", &id), 1);
    std::fclose(stream);
    EXPECT_NE(::kill(id, 0), 0) << "still there: " << id;
  }
}

// A command may leave a child behind that holds its pipes.
TEST(Job, DoesNotWaitForWhatTheCommandLeavesBehind) {
  const auto start = SteadyClock::now();
  run_job(shell("sleep 20 & exit 0"));
  EXPECT_LT(seconds_since(start), 10);
}

TEST(Job, RigFilesAreTheirOwnFileOrACopy) {
  const ScratchFolder scratch;
  rig_file::RigFile rig = rig_file::default_rig_file();  // built in
  const std::string copy = file_of(rig, scratch);
  EXPECT_EQ(copy, scratch.path("rig.yaml"));
  const rig_file::RigFile again = rig_file::load_rig_file(copy);
  EXPECT_EQ(again.digest, rig.digest);
  const ScratchFolder other;
  EXPECT_EQ(file_of(again, other), copy);
  rig.text += "# changed since\n";
  rig.source = copy;
  EXPECT_EQ(file_of(rig, other), other.path("rig.yaml"));
}

}  // namespace
}  // namespace backlash::ros_bridge
