// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "answers.h"
#include "backlash_diagnosis/arm_findings/arm_play_report.h"
#include "record.h"

namespace blind_arms {
namespace {

using backlash::diagnosis::Estimate;
using backlash::diagnosis::Status;

struct Count {
  int asked = 0, found = 0, within = 0, holds = 0, most = 0, most_holds = 0, wrong_sure = 0;

  void add(const Estimate& e, double truth) {
    ++asked;
    if (e.status != Status::ok && e.status != Status::below_range) return;
    const bool in = e.angle_lower <= truth && e.angle_upper >= truth;
    const double width = e.angle_upper - e.angle_lower;
    wrong_sure += truth < e.angle_lower - 2 * width || truth > e.angle_upper + 2 * width;
    (e.status == Status::ok ? found : most) += 1;
    (e.status == Status::ok ? holds : most_holds) += in;
    within += e.status == Status::ok && std::fabs(e.backlash_angle - truth) <= 0.1 * truth;
  }
  int missed() const { return found - holds + most - most_holds; }
};

void add(Count& sum, const Count& c) {
  sum.asked += c.asked, sum.found += c.found, sum.within += c.within, sum.holds += c.holds;
  sum.most += c.most, sum.most_holds += c.most_holds, sum.wrong_sure += c.wrong_sure;
}

void print(const std::string& name, const Count& c) {
  fmt::print("| {:<9} | {:>5} | {:>5} | {:>6} | {:>5} | {:>7} | {:>5} | {:>11} | {:>14} |\n", name, c.asked,
             c.found, c.within, c.holds, c.most, c.most_holds, c.asked - c.found - c.most, c.wrong_sure);
}

/// The answer of the joint: the last estimate is the motor's where there is one encoder.
const Estimate& answer_of(const backlash::arm_findings::ArmPlayReport& report, std::size_t joint) {
  return report.traverses.empty() ? report.plays[joint].estimate : report.traverses[joint].estimate;
}

void print_missed(const Arm& arm, const std::string& kind, std::size_t joint, const Estimate& e) {
  const double truth = arm.joints[joint].play;
  if (e.status != Status::ok && e.status != Status::below_range) return;
  if (e.angle_lower <= truth && e.angle_upper >= truth) return;
  fmt::print("missed: {} {} {}: {:.3f} mrad, found {:.3f} [{:.3f}, {:.3f}], {}\n", arm.seed, kind,
             joint_name(joint), 1e3 * truth, 1e3 * e.backlash_angle, 1e3 * e.angle_lower, 1e3 * e.angle_upper,
             e.message);
}

}  // namespace

int ask_plays(const Options& options) {
  std::map<std::string, Count> counts;
  Count all;
  Reasons reasons;
  AnswerFile file(options.json);
  for (int i = 0; i < options.arms; ++i) {
    const std::string kind = kind_of(options, kinds(), i);
    const Arm arm = drawn_arm(options.seed + std::uint64_t(i), kind);
    const std::string folder = files_of(options, arm, arm, kind);
    const backlash::geared_arm::GearedArm declared =
        backlash::geared_arm::load_geared_arm(folder + "/rig.yaml");
    backlash::arm::ArmRecord record = read_record(record_of(options, arm, folder, 0), declared.rig);
    for (backlash::record::Record& joint : record.joints)
      if (options.ask == "motors") joint.column(backlash::record::Channel::load_position).clear();
    const backlash::arm_findings::ArmPlayReport report =
        backlash::arm_findings::arm_play_report(declared, record);
    for (std::size_t j = 0; j < arm.joints.size(); ++j) {
      const Estimate& e = answer_of(report, j);
      const double truth = arm.joints[j].play;
      counts[kind].add(e, truth);
      if (e.status != Status::ok && e.status != Status::below_range) reasons.add(e.message);
      print_missed(arm, kind, j, e);
      file.add({{"seed", arm.seed},
                {"kind", kind},
                {"ask", options.ask},
                {"joint", joint_name(j)},
                {"truth", truth},
                {"status", backlash::diagnosis::to_string(e.status)},
                {"value", e.backlash_angle},
                {"lower", e.angle_lower},
                {"upper", e.angle_upper},
                {"message", e.message}});
    }
    std::fflush(stdout);
  }
  fmt::print(
      "| kind | asked | found | < 10 % | holds | at most | holds | cannot tell | wrong and sure |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [kind, count] : counts) print(kind, count), add(all, count);
  print("all", all);
  reasons.print();
  return all.missed();
}

}  // namespace blind_arms
