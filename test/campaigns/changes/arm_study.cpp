// SPDX-License-Identifier: BSD-3-Clause
#include "arm_study.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/arm_changes.h"

namespace backlash::change_study {
namespace {

using arm::DriveTerm;

constexpr double kLearn = 40, kRecord = 60;  // s

/// What is done to the machine, and what should be reported of it.
struct Truth {
  std::string effect, joint, size;
  double value = 0;
};

Truth change(test::Machine& m, const std::string& kind, int size, Random& random) {
  const double share[] = {0.15, 0.3, 0.6}, mass[] = {0.3, 1, 3}, slip[] = {0.01, 0.03, 0.1};  // kg, rad
  const std::size_t joint = random.below(m.drives.size());
  if (kind == "payload") {
    arm::Body body;
    body.mass = mass[size];
    body.centre = test::random_vector(random, 0.15);
    m.chain.links.back() += arm::parameters_of(body);
    return {kind, m.drives.back().name, "mass", body.mass};
  }
  if (kind == "encoder_slip") {
    const std::size_t lifts = 1 + random.below(2);  // gravity shows the slip of others too little
    m.slip[Eigen::Index(lifts)] = slip[size];
    return {kind, m.drives[lifts].name, "offset", slip[size]};
  }
  const DriveTerm term = kind == "motor_coulomb" ? DriveTerm::coulomb : DriveTerm::viscous;
  double& value = m.drives[joint].terms[std::size_t(term)];
  const double added = share[size] * value;
  value += added;
  return {kind, m.drives[joint].name, kind, added};
}

struct Count {
  int all = 0, found = 0, named = 0, wrong = 0, beside = 0, onset = 0, size = 0;
};

bool names(const changes::Change& c, const Truth& truth) {
  return c.effect == truth.effect && c.joint == truth.joint;
}

void count(const changes::Changes& found, const Truth& truth, double since, Count& n) {
  ++n.all;
  n.found += !found.changes.empty();
  const changes::Change* right = nullptr;
  for (const changes::Change& c : found.changes)
    if (names(c, truth)) right = &c;
  n.named += right != nullptr;
  for (const changes::Change& c : found.changes) {
    if (&c == right || c.effect == "unknown") continue;
    right ? ++n.beside : ++n.wrong;
    fmt::print("reported {} of {} at {:.1f} s, gain {:.3g}, alike {}; true: {} of {} at {:.1f} s\n", c.effect,
               c.joint, c.since, c.gain, fmt::join(c.alike, ", "), truth.effect, truth.joint, since);
  }
  if (!right) return;
  n.onset += right->since_from <= since && since <= right->since_to;
  for (const changes::ChangeSize& s : right->size)
    if (s.name == truth.size)
      n.size += std::fabs(s.measured.value - truth.value) < 1.96 * s.measured.standard_error;
}

test::Machine drawn(std::uint64_t seed, bool rough) {
  test::Machine machine(seed);
  if (!rough) return machine;
  machine.coloured = 0.5 * machine.noise;
  machine.wander = 0.03;
  machine.jitter = 0.001;
  return machine;
}

void healthy(int arms, std::uint64_t seed, double rate, bool rough) {
  int reported = 0, cannot = 0;
  for (int i = 0; i < arms; ++i) {
    const std::uint64_t s = seed + std::uint64_t(i);
    const test::Machine machine = drawn(s, rough);
    test::Machine day = machine;  // friction differs from day to day
    Random random(s + 1);
    for (arm::JointDrive& drive : day.drives)
      for (const DriveTerm t : {DriveTerm::coulomb, DriveTerm::viscous})
        drive.terms[std::size_t(t)] *= 1 + 0.1 * random.normal();
    changes::ChangeSettings settings;
    settings.false_alarms_per_hour = rate;
    const auto found = changes::detect_changes(
        machine.declared, {machine.record(10 * s, kLearn), machine.record(10 * s + 1, kLearn)},
        day.record(10 * s + 2, kRecord), settings);
    reported += !found.changes.empty();
    cannot += found.changes.empty() && !found.cannot_tell.empty();
    for (const changes::Change& c : found.changes)
      fmt::print("reported {} of {} at {:.1f} s, gain {:.3g}; true: healthy\n", c.effect, c.joint, c.since,
                 c.gain);
    if (!found.cannot_tell.empty()) fmt::print("healthy, {}\n", found.cannot_tell);
  }
  fmt::print("arms, healthy: {} looks at {} s, {:.3g} false alarms allowed; reported {}, cannot tell {}\n",
             arms, kRecord, rate * kRecord / 3600 * arms, reported, cannot);
}

}  // namespace

void study_arms(int arms, std::uint64_t seed, double rate, bool rough) {
  healthy(arms, seed, rate, rough);
  std::map<std::string, Count> counts;
  for (int i = 0; i < arms; ++i)
    for (const char* kind : {"payload", "motor_coulomb", "motor_viscous", "encoder_slip"}) {
      const std::uint64_t s = seed + 1000 + std::uint64_t(i);
      Random random(s + 7 * std::uint64_t(kind[6]));
      const int size = i % 3;
      const test::Machine machine = drawn(s, rough);
      test::Machine changed = machine;
      const Truth truth = change(changed, kind, size, random);
      const double since = random.uniform(15, 45);
      changes::ChangeSettings settings;
      settings.false_alarms_per_hour = rate;
      const auto found = changes::detect_changes(
          machine.declared, {machine.record(10 * s, kLearn), machine.record(10 * s + 1, kLearn)},
          machine.record(10 * s + 2, kRecord, changed, since), settings);
      count(found, truth, since, counts[fmt::format("{} {}", kind, size + 1)]);
    }
  fmt::print(
      "| change, size | all | found | by name and joint | wrong name | others beside | onset holds | size "
      "holds |\n");
  for (const auto& [name, n] : counts)
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} |\n", name, n.all, n.found, n.named, n.wrong,
               n.beside, n.onset, n.size);
}

}  // namespace backlash::change_study
