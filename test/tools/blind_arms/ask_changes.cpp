// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "answers.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/base/error.h"
#include "record.h"

namespace blind_arms {
namespace {

using backlash::arm::ArmStep;
using backlash::arm::ArmTrace;
using Json = nlohmann::ordered_json;

constexpr double kSure = 3;  // standard errors, beyond which a value is wrong

struct Count {
  int asked = 0, named = 0, wrong = 0, none = 0, unexplained = 0;
  int values = 0, beyond_two = 0, beyond_three = 0;  // of mass and centre, standard errors
};

/// The effect that the package should name; empty: none.
std::string effect_of(const std::string& kind) {
  return kind == "payload"    ? "payload"
         : kind == "friction" ? "friction_drift"
         : kind == "tilt"     ? "gravity_direction"
                              : "";
}

/// Friction of a motor that is warm may be told: it is another one.
bool right(const ArmStep& step, const std::string& kind, const Arm& arm) {
  if (kind == "warm") return step.effect == "friction_drift";
  if (step.effect != effect_of(kind)) return false;
  return step.effect != "friction_drift" || step.joint == joint_name(arm.changed);
}

/// Errors of mass and centre over their standard errors.
std::vector<double> payload_errors(const ArmStep& step, const Arm& arm) {
  const double truth[] = {arm.payload, arm.payload_centre[0], arm.payload_centre[1], arm.payload_centre[2]};
  std::vector<double> z;
  for (std::size_t k = 0; k < 4 && k < step.parameters.size(); ++k)
    z.push_back((step.parameters[k].measured.value - truth[k]) / step.parameters[k].measured.standard_error);
  return z;
}

std::string words_of(const ArmStep& step) {
  std::string text = step.effect + " " + (step.link.empty() ? step.joint : step.link);
  for (const auto& p : step.parameters)
    text += fmt::format(" {} {:.4g} +- {:.2g}", p.name, p.measured.value, p.measured.standard_error);
  return text;
}

std::string truth_of(const Arm& arm) {
  if (arm.payload > 0)
    return fmt::format("{:.4g} kg at {:.3f} {:.3f} {:.3f} m", arm.payload, arm.payload_centre[0],
                       arm.payload_centre[1], arm.payload_centre[2]);
  if (arm.more_friction > 1)
    return fmt::format("{}, {:.2f} times", joint_name(arm.changed), arm.more_friction);
  return arm.tilt != 0 ? fmt::format("{:.3f} rad", arm.tilt) : "nothing";
}

void add(Count& c, const ArmTrace& trace, const std::string& kind, const Arm& arm, AnswerFile& file) {
  ++c.asked;
  c.none += trace.steps.empty();
  c.unexplained += trace.unexplained.has_value();
  bool named = false;
  Json steps = Json::array();
  for (const ArmStep& step : trace.steps) {
    steps.push_back(words_of(step));
    const bool good = right(step, kind, arm);
    named = named || good;
    c.wrong += !good;
    if (!good || step.effect == "payload")
      fmt::print("{}: {} {}: {}; true: {}\n", good ? "told" : "wrong", arm.seed, kind, words_of(step),
                 truth_of(arm));
    if (!good || step.effect != "payload") continue;
    for (const double z : payload_errors(step, arm)) {
      ++c.values;
      c.beyond_two += std::fabs(z) > 2, c.beyond_three += std::fabs(z) > kSure;
      if (std::fabs(z) > kSure) fmt::print("  missed by {:.1f} standard errors\n", z);
    }
  }
  c.named += named;
  file.add({{"seed", arm.seed},
            {"kind", kind},
            {"truth", truth_of(arm)},
            {"steps", steps},
            {"notes", trace.notes},
            {"unexplained",
             trace.unexplained ? trace.unexplained->channel + ": " + trace.unexplained->signature : ""}});
}

ArmTrace traced(const Options& options, const Arm& before, const Arm& after, const std::string& kind) {
  const std::string trained = files_of(options, before, before, kind == "bend" ? "bent" : "trained"),
                    folder = files_of(options, after, before, kind);
  const backlash::arm::ArmRig rig = backlash::arm::load_arm_rig(folder + "/rig.yaml");
  std::vector<backlash::arm::ArmRecord> train;
  for (const int number : {0, 1})
    train.push_back(read_record(record_of(options, before, trained, number), rig));
  return backlash::arm::trace_arm(rig, train, read_record(record_of(options, after, folder, 2), rig), false);
}

}  // namespace

int ask_changes(const Options& options) {
  std::map<std::string, Count> counts;
  AnswerFile file(options.json);
  int wrong = 0;
  for (int i = 0; i < options.arms; ++i)
    for (const Kind& kind : changes()) {
      if (options.kind != "all" && options.kind != kind.name) continue;
      const std::uint64_t seed = options.seed + std::uint64_t(i);
      const Arm before = drawn_arm(seed, kind.name == "bend" ? "bend" : "unchanged"),
                after = drawn_arm(seed, kind.name);
      try {
        add(counts[kind.name], traced(options, before, after, kind.name), kind.name, after, file);
      } catch (const backlash::CannotIdentify& e) {
        ++counts[kind.name].asked;
        fmt::print("refused: {} {}: {}\n", seed, kind.name, e.what());
      }
      std::fflush(stdout);
    }
  fmt::print(
      "| change | asked | named | others named | nothing named | unexplained | values of payloads | beyond 2 "
      "standard errors | beyond 3 |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [kind, c] : counts) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", kind, c.asked, c.named, c.wrong, c.none,
               c.unexplained, c.values, c.beyond_two, c.beyond_three);
    wrong += c.wrong + c.beyond_three;
  }
  return wrong;
}

}  // namespace blind_arms
