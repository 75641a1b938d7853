// SPDX-License-Identifier: BSD-3-Clause
#include "onset_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes.h"

namespace backlash::change_study {
namespace {

constexpr double kLearn = 300, kLook = 300;  // s
constexpr const char* kSizes[] = {"small", "middle", "large"};
constexpr double kWave = 1.5;    // of the noise, that a machine in another task has when healthy
constexpr double kHolds = 1.96;  // standard errors of a 95 % interval

/// What is drawn, and what it is right to call it.
struct Drawn {
  const char* kind;
  double sizes[3];  // - of `unit`
  enum Unit { healthy, noise, absolute } unit;
  const char* name;
  const char* size;                 // the value that is compared with the truth
  std::vector<std::string> beside;  // effects that are right as well
};

const std::vector<Drawn>& one_inertia() {
  static const std::vector<Drawn> all = {
      {"motor_coulomb", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_coulomb", "motor_coulomb", {}},
      {"motor_viscous", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_viscous", "motor_viscous", {}},
      {"motor_inertia", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_inertia", "motor_inertia", {}},
      {"load_dependent_friction",
       {0.03, 0.06, 0.12},
       Drawn::absolute,
       "load_dependent_friction",
       "coefficient",
       {}},
      {"gravity", {0.1, 0.2, 0.4}, Drawn::healthy, "gravity", "amplitude", {}},
      {"payload", {0.1, 0.2, 0.4}, Drawn::healthy, "gravity", "amplitude", {"motor_inertia"}},
      {"cogging", {1, 2, 4}, Drawn::noise, "cogging", "amplitude", {}},
      {"local_fault", {2, 4, 8}, Drawn::noise, "local_fault", "forward", {}},
      {"encoder_slip", {0.01, 0.02, 0.04}, Drawn::absolute, "encoder_slip", "offset", {}},
      {"friction_drift", {0.2, 0.4, 0.8}, Drawn::healthy, "friction_drift", "change", {}},
      {"motor_torque_gain", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_torque_gain", "gain", {}},
      {"asymmetric_coulomb", {1, 2, 4}, Drawn::noise, "asymmetric_coulomb", "torque", {}},
  };
  return all;
}

const std::vector<Drawn>& two_inertias() {
  static const std::vector<Drawn> all = {
      {"backlash", {0.1, 0.2, 0.4}, Drawn::healthy, "backlash", "angle", {}},
      {"growing_backlash", {0.1, 0.2, 0.4}, Drawn::healthy, "backlash", "angle", {}},
      {"motor_coulomb", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_coulomb", "motor_coulomb", {}},
      {"load_coulomb", {0.1, 0.2, 0.4}, Drawn::healthy, "load_coulomb", "load_coulomb", {}},
      {"motor_viscous", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_viscous", "motor_viscous", {}},
      {"load_viscous", {0.1, 0.2, 0.4}, Drawn::healthy, "load_viscous", "load_viscous", {}},
      {"mesh_stiffness", {0.1, 0.2, 0.4}, Drawn::healthy, "mesh_stiffness", "compliance", {}},
      {"load_inertia", {0.1, 0.2, 0.4}, Drawn::healthy, "load_inertia", "load_inertia", {}},
      {"payload", {0.1, 0.2, 0.4}, Drawn::healthy, "gravity", "amplitude", {"load_inertia"}},
      {"local_fault", {2, 4, 8}, Drawn::noise, "local_fault", "forward", {}},
      {"tooth", {1e-5, 3e-5, 1e-4}, Drawn::absolute, "local_fault", "forward", {}},
      {"encoder_slip", {1e-5, 3e-5, 1e-4}, Drawn::absolute, "encoder_slip", "offset", {}},
      {"motor_torque_gain", {0.1, 0.2, 0.4}, Drawn::healthy, "motor_torque_gain", "gain", {}},
  };
  return all;
}

/// What might be taken for a local fault, or a fault of another shape. Named right: by an effect that is
/// near.
const std::vector<Drawn>& look_alikes() {
  static const std::vector<Drawn> all = {
      {"cogging", {1, 2, 4}, Drawn::noise, "cogging", "amplitude", {}},
      {"rubbed_wave", {1, 2, 4}, Drawn::noise, "position_dependent_friction", "amplitude", {}},
      {"presliding", {2, 4, 8}, Drawn::noise, "presliding", "torque", {}},
      {"stribeck", {2, 4, 8}, Drawn::noise, "stribeck", "", {}},
      {"push", {5, 10, 40}, Drawn::noise, "unknown", "", {}},
      {"swing", {0.5, 1, 2}, Drawn::noise, "unknown", "", {}},
      {"other_task", {0.5, 0.7, 1.15}, Drawn::absolute, "nothing", "", {}},
      {"local_fault", {2, 4, 8}, Drawn::noise, "local_fault", "forward", {}},
      {"flat_fault", {2, 4, 8}, Drawn::noise, "local_fault", "forward", {}},
  };
  return all;
}

struct Row {
  int drawn = 0, found = 0, named = 0, wrong = 0, unknown = 0, cannot = 0, onset = 0, size = 0;
  double width = 0;
};

bool contains(const std::vector<std::string>& all, const std::string& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

Added added_to(const Joint& joint, const Drawn& drawn, int size, Random& random) {
  Added a;
  a.effect = drawn.kind;
  if (a.effect == "flat_fault") {
    a.effect = "local_fault";
    a.flat = true;
  }
  a.since = uniform(random, 60, 240);
  a.end = kLook;
  const double unit = drawn.unit == Drawn::healthy ? joint.value(drawn.kind)
                      : drawn.unit == Drawn::noise ? joint.noise
                                                   : 1;
  a.size = drawn.sizes[size] * unit;
  a.order = std::round(uniform(random, 4, 40));
  a.phase = uniform(random, 0, 2 * M_PI);
  a.place = uniform(random, -1, 1);
  a.width = uniform(random, 0.03, 0.12);
  // Of both flanks as a push, as a friction, of one flank only.
  constexpr double kBackward[] = {1, -1, 0};
  a.backward = kBackward[std::uniform_int_distribution<int>(0, 2)(random)];
  return a;
}

void judge(const changes::Changes& found, const Drawn& drawn, const Added& added, Row& row) {
  ++row.drawn;
  row.found += !found.changes.empty();
  row.cannot += found.changes.empty() && !found.cannot_tell.empty();
  bool named = false, wrong = false, unknown = false;
  for (const changes::Change& c : found.changes) {
    const bool right = c.effect == drawn.name || contains(c.alike, drawn.name);
    if (!right) {
      unknown = unknown || c.effect == "unknown";
      if (c.effect != "unknown" && !contains(drawn.beside, c.effect)) {
        wrong = true;
        fmt::print(
            "{} {:.3g} since {:.1f} (place {:.2f} width {:.3f} order {:.0f}): reported {} ({}) since {:.1f}, "
            "gain {:.3g}\n",
            drawn.kind, added.size, added.since, added.place, added.width, added.order, c.effect,
            fmt::join(c.alike, " "), c.since, c.gain);
      }
      continue;
    }
    if (named) continue;
    named = true;
    row.onset += c.since_from <= added.since && added.since <= c.since_to;
    row.width += c.since_to - c.since_from;
    for (const changes::ChangeSize& s : c.size)
      if (c.effect == drawn.name && (s.name == drawn.size || c.size.size() == 1)) {
        row.size += std::fabs(s.measured.value - added.size) <= kHolds * s.measured.standard_error;
        break;
      }
  }
  row.named += named;
  row.wrong += wrong;
  row.unknown += unknown;
}

}  // namespace

void study_onsets(const OnsetOptions& options, unsigned long seed, const MadeOptions& made) {
  Random random(seed);
  std::vector<Drawn> kinds = options.look_alikes ? look_alikes() : made.two ? two_inertias() : one_inertia();
  if (!options.only.empty())
    kinds.erase(
        std::remove_if(kinds.begin(), kinds.end(), [&](const Drawn& d) { return d.kind != options.only; }),
        kinds.end());
  if (kinds.empty()) throw InvalidParameter("only", 0, "must be one of the kinds of the table");
  std::map<std::pair<std::size_t, int>, Row> rows;
  changes::ChangeSettings settings;
  settings.false_alarms_per_hour = options.rate_of_look;
  for (int i = 0; i < options.count; ++i) {
    const std::size_t kind = static_cast<std::size_t>(i) % kinds.size();
    const int size = i / static_cast<int>(kinds.size()) % 3;
    MadeOptions of_joint = made;
    if (kinds[kind].name == std::string("nothing")) of_joint.wave = kWave;
    of_joint.cyclic = options.look_alikes && i / static_cast<int>(kinds.size()) % 2 == 1;
    const Joint joint(random, of_joint);
    const Added added = added_to(joint, kinds[kind], size, random);
    const std::vector<record::Record> learned = {joint.record(random, kLearn, true, false)};
    const record::Record record = joint.record(random, kLook, false, false, added);
    judge(changes::detect_changes(joint.rig(), learned, record, settings), kinds[kind], added,
          rows[{kind, size}]);
  }
  fmt::print("{:25}{:8}{:>7}{:>7}{:>7}{:>7}{:>9}{:>8}{:>7}{:>9}{:>6}\n", "change", "size", "drawn", "found",
             "named", "wrong", "unknown", "cannot", "onset", "wide [s]", "size");
  Row sum;
  for (const auto& [key, r] : rows) {
    fmt::print("{:25}{:8}{:7}{:7}{:7}{:7}{:9}{:8}{:7}{:9.1f}{:6}\n", kinds[key.first].kind,
               kSizes[key.second], r.drawn, r.found, r.named, r.wrong, r.unknown, r.cannot, r.onset,
               r.width / std::max(r.named, 1), r.size);
    sum.drawn += r.drawn, sum.found += r.found, sum.named += r.named, sum.wrong += r.wrong;
    sum.unknown += r.unknown, sum.cannot += r.cannot, sum.onset += r.onset, sum.size += r.size;
    sum.width += r.width;
  }
  fmt::print("{:33}{:7}{:7}{:7}{:7}{:9}{:8}{:7}{:9.1f}{:6}\n", "all", sum.drawn, sum.found, sum.named,
             sum.wrong, sum.unknown, sum.cannot, sum.onset, sum.width / std::max(sum.named, 1), sum.size);
}

}  // namespace backlash::change_study
