// SPDX-License-Identifier: BSD-3-Clause
// Changes of rigs with a torque sensor: machines of a rig file with all values off, simulated, learned from
// two healthy records of other drives, and looked at with a change of one of them.
#include "rig_study.h"

#include <fmt/format.h>

#include <cstdio>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes_of_rig.h"
#include "support/changing_rig.h"

namespace backlash::change_study {
namespace {

constexpr double kLearn = 40;  // s, of each healthy record

struct Machine {
  rig_file::RigFile file;
  std::vector<record::Record> healthy;
};

record::Record seen(record::Record record, const RigStudy& study) {
  if (!study.position) record.column(record::Channel::motor_position).clear();
  return record;
}

Machine drawn(const rig_file::RigFile& declared, Random& random, const RigStudy& study) {
  Machine m{test::drawn_rig(declared, random), {}};
  for (int i = 0; i < 2; ++i) {
    rig_file::RigFile other = m.file;
    other.simulation.sensors.seed = random.bits();
    if (i > 0) {
      other.simulation.excitation.amplitude *= random.uniform(0.85, 1.15);
      other.simulation.excitation.frequency = std::round(random.uniform(6, 12));
    }
    m.healthy.push_back(seen(test::settled(other, kLearn), study));
    m.healthy.back().name = "healthy";
  }
  return m;
}

double truth(const test::RigEvent& e, const rig_file::RigFile& f) {
  const model::Rig& r = f.rig;
  return e.share * (e.name == "backlash"            ? r.mesh.backlash
                    : e.name == "contact_stiffness" ? r.mesh.contact_spec().values.at("stiffness")
                    : e.name == "sensor_stiffness"  ? r.input_coupling.stiffness
                    : e.name == "output_stiffness"  ? r.output_coupling.stiffness
                    : e.name == "motor_viscous"     ? r.motor.viscous_damping
                    : e.name == "motor_coulomb"     ? f.simulation.excitation.amplitude
                    : e.name == "load_inertia"
                        ? r.link.inertia + (r.output_coupling.rigid ? r.gear.inertia : 0)
                        : 1);
}

struct Tally {
  int count = 0, found = 0, named = 0, unknown = 0, cannot = 0, wrong = 0, beside = 0, onset = 0, size = 0;
  double width = 0;
};

void judge(const changes::Changes& found, const test::RigEvent& event, double since, double value, Tally& t) {
  const changes::Change* named = nullptr;
  t.found += !found.changes.empty();
  t.cannot += found.changes.empty() && !found.cannot_tell.empty();
  for (const changes::Change& c : found.changes) {
    if (c.effect == event.name && !named)
      named = &c;
    else if (c.effect != "unknown")
      ++t.wrong;
    else if (named || &c != &found.changes.front())
      ++t.beside;
  }
  t.unknown += !named && !found.changes.empty() && found.changes.front().effect == "unknown";
  if (!named) return;
  ++t.named;
  t.onset += named->since_from <= since && since <= named->since_to;
  t.width += named->since_to - named->since_from;
  const signal::Measured& m = named->size.front().measured;
  t.size += std::fabs(m.value - value) <= 1.96 * m.standard_error;
}

void print_found(const changes::Changes& found, const std::string& label, double since, double value) {
  fmt::print("  {} at {:.1f} s, {:.4g}:", label, since, value);
  for (const changes::Change& c : found.changes)
    fmt::print(" {} {:.1f} ({:.1f} to {:.1f}) {:.4g} +- {:.2g} gain {:.3g} [{}];", c.effect, c.since,
               c.since_from, c.since_to, c.size.empty() ? 0 : c.size[0].measured.value,
               c.size.empty() ? 0 : c.size[0].measured.standard_error, c.gain, fmt::join(c.alike, " "));
  fmt::print(" {} {}\n", found.cannot_tell, fmt::join(found.warnings, "; "));
  std::fflush(stdout);
}

std::vector<test::RigEvent> events_of(const model::Rig& rig) {
  std::vector<test::RigEvent> all = {{"backlash", 0.1},
                                     {"backlash", 0.2},
                                     {"backlash", 0.4},
                                     {"backlash", 0.4, 1},
                                     {"contact_stiffness", -0.3},
                                     {"sensor_stiffness", -0.15},
                                     {"motor_viscous", 0.3},
                                     {"motor_coulomb", 0.06},
                                     {"sensor_gain", -0.1},
                                     {"motor_torque_gain", 0.1},
                                     {"motor_position_gain", 0.1},
                                     {"noise", 2, 0, false},
                                     {"drive", 0.15, 0, false}};
  if (!rig.link_locked) all.push_back({"load_inertia", 0.2});
  return all;
}

}  // namespace

void study_rigs(const RigStudy& study) {
  const rig_file::RigFile declared = rig_file::load_rig_file(study.rig);
  changes::ChangeSettings settings;
  settings.false_alarms_per_hour = study.rate;
  Random random(study.seed, 1);
  std::vector<test::RigEvent> events = events_of(declared.rig);
  if (!study.only.empty())
    events.erase(std::remove_if(events.begin(), events.end(),
                                [&](const test::RigEvent& e) { return e.name != study.only; }),
                 events.end());
  if (events.empty()) throw InvalidParameter("rig-change", study.only, "no such change");
  std::map<std::string, Tally> tallies;
  int refused = 0, alarms = 0, cannot = 0, looks = 0;
  const auto look = [&](const Machine& m, const record::Record& r) -> std::optional<changes::Changes> {
    try {
      return changes::detect_changes(declared, m.healthy, seen(r, study), settings);
    } catch (const CannotIdentify& e) {
      ++refused;
      fmt::print("  refused: {}\n", e.what());
      return std::nullopt;
    }
  };
  for (int i = 0; i < study.changes; ++i) {
    const Machine m = drawn(declared, random, study);
    test::RigEvent event = events[static_cast<std::size_t>(i) % events.size()];
    const double since = std::round(random.uniform(0.2, 0.8) * study.duration);
    if (event.span > 0) event.span = study.duration - since;
    const std::string label =
        fmt::format("{} {:+.0f} %{}", event.name, 100 * event.share, event.span > 0 ? ", growing" : "");
    const record::Record r = test::changing_record(m.file, study.duration, event, since);
    Tally& t = tallies[label];
    ++t.count;
    if (const auto found = look(m, r)) {
      judge(*found, event, since, truth(event, m.file), t);
      print_found(*found, label, since, truth(event, m.file));
    }
  }
  for (double s = 0; s < 3600 * study.healthy_hours; s += study.duration, ++looks) {
    const Machine m = drawn(declared, random, study);
    rig_file::RigFile file = m.file;
    file.simulation.sensors.seed = random.bits();
    file.simulation.excitation.frequency = std::round(random.uniform(6, 12));
    file.simulation.excitation.amplitude *= random.uniform(0.85, 1.15);
    if (const auto found = look(m, test::settled(file, study.duration))) {
      alarms += !found->changes.empty(), cannot += found->changes.empty() && !found->cannot_tell.empty();
      if (!found->changes.empty() || !found->cannot_tell.empty() || !found->warnings.empty())
        print_found(*found, "healthy", 0, 0);
    }
  }
  fmt::print("{:32} count found named unknown cannot wrong beside onset width size\n", "change");
  for (const auto& [label, t] : tallies)
    fmt::print("{:32} {:5} {:5} {:5} {:7} {:6} {:5} {:6} {:5} {:5.1f} {:4}\n", label, t.count, t.found,
               t.named, t.unknown, t.cannot, t.wrong, t.beside, t.onset, t.width / std::max(1, t.named),
               t.size);
  fmt::print("refused {}; healthy: {:.2f} h, {} looks, {} found something, {} cannot tell\n", refused,
             looks * study.duration / 3600, looks, alarms, cannot);
}

}  // namespace backlash::change_study
