// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "answers.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/base/error.h"
#include "flaws.h"
#include "record.h"

namespace blind_arms {
namespace {

using backlash::arm::ArmStep;
using backlash::arm::ArmTrace;
using Json = nlohmann::ordered_json;

constexpr double kSetByHand = 0.1;  // rad, as src/arm/motion.cpp has it
constexpr double kSure = 3;         // standard errors, beyond which a value is wrong

struct Count {
  int asked = 0, effects = 0, named = 0, among = 0, wrong = 0, none = 0, unexplained = 0;
  int values = 0, beyond_two = 0, beyond_three = 0;  // of payloads and effects, standard errors
};

/// By which Coulomb friction of the changed joint is more than it was.
double more_coulomb(const Arm& arm) {
  return arm.joints[arm.changed].coulomb * (1 - 1 / arm.more_friction);
}

/// What the package should name.
std::vector<Added> expected(const std::string& kind, const Arm& arm) {
  std::vector<Added> all = arm.added;
  if (arm.payload > 0) all.push_back({"payload"});
  if (kind == "friction") all.push_back({"motor_coulomb", arm.changed, more_coulomb(arm), 0});
  if (kind == "tilt") all.push_back({"gravity_direction"});
  return all;
}

/// What it may: Stribeck's friction and bristles, which all drives have and the rig file has not; friction of
/// a motor that is warm is another one, and so is what grows.
bool may(const ArmStep& step, const std::string& kind, const Arm& arm) {
  if (step.effect == "stribeck" || step.effect == "presliding") return true;
  if (kind == "spot" && step.effect == "position_dependent_friction") return true;
  if (step.effect != "friction_drift") return false;
  const bool here = step.joint == joint_name(arm.changed);
  return kind == "warm" || ((kind == "friction" || kind == "drift" || kind == "spot") && here);
}

const Added* found(const ArmStep& step, const std::string& effect, const std::vector<Added>& all) {
  for (const Added& a : all)
    if (a.effect == effect && (step.joint.empty() || step.joint == joint_name(a.joint))) return &a;
  return nullptr;
}

/// Reported as not distinguished from what was named.
bool among(const ArmStep& step, const std::vector<Added>& all) {
  return std::any_of(step.equivalent_to.begin(), step.equivalent_to.end(),
                     [&](const std::string& other) { return found(step, other, all) != nullptr; });
}

/// Errors over standard errors, of strength and shape.
std::vector<double> effect_errors(const ArmStep& step, const Added& truth) {
  const auto of = [](const backlash::arm::ArmParameter& p, double value) {
    return (p.measured.value - value) / p.measured.standard_error;
  };
  std::vector<double> z{of(step.parameters.front(), truth.strength)};
  if (truth.shape > 0) z.push_back(of(step.parameters.back(), truth.shape));
  return z;
}

/// Stribeck's friction that the drive has beside what was put in.
Added stribeck_of_drive(const ArmStep& step, const Arm& arm) {
  std::size_t j = 0;
  while (joint_name(j) != step.joint) ++j;
  const Joint& joint = arm.joints[j];
  return {"stribeck", j, joint.coulomb * joint.stribeck, joint.stribeck_speed};
}

/// As the encoders have it: where their zeros are a little off, about axes along the last joint's, its link
/// is taken to be turned by as much. Zeros that are further off than a gear yields are taken out.
Vector payload_centre(const Arm& arm) {
  const Vector& axis = arm.joints.back().axis;
  double turn = 0;
  std::size_t about = 0;
  for (std::size_t a = 0; a < 3; ++a)
    if (axis[a] != 0) about = a;
  for (const Joint& j : arm.joints)
    if (std::fabs(j.zero) < kSetByHand) turn -= j.zero * j.axis[about];
  const std::size_t x = (about + 1) % 3, y = (about + 2) % 3;
  Vector centre = arm.payload_centre;
  centre[x] = arm.payload_centre[x] * std::cos(turn) - arm.payload_centre[y] * std::sin(turn);
  centre[y] = arm.payload_centre[x] * std::sin(turn) + arm.payload_centre[y] * std::cos(turn);
  return centre;
}

/// Of mass and centre.
std::vector<double> payload_errors(const ArmStep& step, const Arm& arm) {
  const Vector centre = payload_centre(arm);
  const double truth[] = {arm.payload, centre[0], centre[1], centre[2]};
  std::vector<double> z;
  for (std::size_t k = 0; k < 4 && k < step.parameters.size(); ++k)
    z.push_back((step.parameters[k].measured.value - truth[k]) / step.parameters[k].measured.standard_error);
  return z;
}

std::string words_of(const ArmStep& step) {
  std::string text = step.effect + " " + (step.link.empty() ? step.joint : step.link);
  if (!step.equivalent_to.empty()) text += fmt::format(" (or {})", fmt::join(step.equivalent_to, ", "));
  for (const auto& p : step.parameters)
    text += fmt::format(" {} {:.4g} +- {:.2g}", p.name, p.measured.value, p.measured.standard_error);
  return text;
}

std::string truth_of(const Arm& arm) {
  std::vector<std::string> all;
  const Vector centre = payload_centre(arm);
  if (arm.payload > 0)
    all.push_back(
        fmt::format("{:.4g} kg at {:.3f} {:.3f} {:.3f} m", arm.payload, centre[0], centre[1], centre[2]));
  if (arm.more_friction > 1)
    all.push_back(fmt::format("{}, {:.2f} times", joint_name(arm.changed), arm.more_friction));
  if (arm.tilt != 0) all.push_back(fmt::format("{:.3f} rad", arm.tilt));
  for (const Added& a : arm.added)
    all.push_back(fmt::format("{} {} {:.4g} {:.4g}", a.effect, joint_name(a.joint), a.strength, a.shape));
  return all.empty() ? "nothing" : fmt::format("{}", fmt::join(all, ", "));
}

void add_values(Count& c, const std::vector<double>& errors) {
  for (const double z : errors) {
    ++c.values;
    c.beyond_two += std::fabs(z) > 2, c.beyond_three += std::fabs(z) > kSure;
    if (std::fabs(z) > kSure) fmt::print("  missed by {:.1f} standard errors\n", z);
  }
}

void add(Count& c, const ArmTrace& trace, const std::string& kind, const Arm& arm, AnswerFile& file) {
  const std::vector<Added> all = expected(kind, arm);
  ++c.asked;
  c.effects += int(all.size());
  c.none += trace.steps.empty();
  c.unexplained += trace.unexplained.has_value();
  Json steps = Json::array();
  for (const ArmStep& step : trace.steps) {
    steps.push_back(words_of(step));
    const Added* truth = found(step, step.effect, all);
    const bool alike = !truth && among(step, all), good = truth || alike || may(step, kind, arm);
    c.named += truth != nullptr, c.among += alike, c.wrong += !good;
    // Where Stribeck's friction was put in, the record shows that and what the drive had before.
    const bool of_drive = step.effect == "stribeck" && !truth,
               values = of_drive || (truth && step.effect != "friction_drift" &&
                                     step.effect != "gravity_direction" && step.effect != "stribeck");
    if (!good || values)
      fmt::print("{}: {} {}: {}; true: {}\n", good ? "right" : "wrong", arm.seed, kind, words_of(step),
                 truth_of(arm));
    if (values)
      add_values(c, step.effect == "payload" ? payload_errors(step, arm)
                    : of_drive               ? effect_errors(step, stribeck_of_drive(step, arm))
                                             : effect_errors(step, *truth));
  }
  file.add({{"seed", arm.seed},
            {"kind", kind},
            {"truth", truth_of(arm)},
            {"steps", steps},
            {"train", trace.train},
            {"before", trace.before},
            {"after", trace.after},
            {"notes", trace.notes},
            {"unexplained",
             trace.unexplained ? trace.unexplained->channel + ": " + trace.unexplained->signature : ""}});
}

/// What is asked: the machine of the rig file and the training records, and as it is afterwards.
struct Question {
  Arm before, after;
  std::string trained;  // folder's name, of the training records
};

Question question(const Options& options, std::uint64_t seed, const std::string& kind) {
  if (options.ask == "effects")
    return {arm_before(seed, kind), arm_with(seed, kind),
            kind == "later"  ? "before"
            : kind == "bent" ? "bent"
                             : "trained"};
  const bool bends = kind == "bend";
  return {drawn_arm(seed, bends ? "bend" : "unchanged"), drawn_arm(seed, kind),
          bends ? "trained_bent" : "trained"};
}

ArmTrace traced(const Options& options, const Question& q, const std::string& kind) {
  const std::string trained = files_of(options, q.before, q.before, q.trained),
                    folder = files_of(options, q.after, q.before, kind);
  const backlash::arm::ArmRig rig = backlash::arm::load_arm_rig(folder + "/rig.yaml");
  std::vector<backlash::arm::ArmRecord> train;
  for (const int number : {0, 1})
    train.push_back(read_record(record_of(options, q.before, trained, number), rig));
  return backlash::arm::trace_arm(rig, train, read_record(record_of(options, q.after, folder, 2), rig),
                                  false);
}

}  // namespace

int ask_changes(const Options& options) {
  std::map<std::string, Count> counts;
  AnswerFile file(options.json);
  int wrong = 0;
  for (int i = 0; i < options.arms; ++i)
    for (const Kind& kind : options.ask == "effects" ? flaws() : changes()) {
      if (options.kind != "all" && options.kind != kind.name) continue;
      const std::uint64_t seed = options.seed + std::uint64_t(i);
      try {
        const Question q = question(options, seed, kind.name);
        add(counts[kind.name], traced(options, q, kind.name), kind.name, q.after, file);
      } catch (const backlash::CannotIdentify& e) {
        ++counts[kind.name].asked;
        fmt::print("refused: {} {}: {}\n", seed, kind.name, e.what());
      }
      std::fflush(stdout);
    }
  fmt::print(
      "| change | asked | effects | named | among equals | others named | nothing named | unexplained | "
      "values | beyond 2 "
      "standard errors | beyond 3 |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [kind, c] : counts) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", kind, c.asked, c.effects,
               c.named, c.among, c.wrong, c.none, c.unexplained, c.values, c.beyond_two, c.beyond_three);
    wrong += c.wrong + c.beyond_three;
  }
  return wrong;
}

}  // namespace blind_arms
