// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/day_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/diagnosis/change_log.h"
#include "backlash_diagnosis/report/change_file.h"
#include "diagnosis_data.h"
#include "html_template.h"

namespace backlash::report {
namespace {

namespace fs = std::filesystem;

const std::string kChanges = "_changes";

/// Of a joint all that its files hold.
std::map<std::string, JointDay> read_files(const std::string& folder, std::vector<std::string>& warnings) {
  std::map<std::string, JointDay> joints;
  std::error_code failed;
  for (const fs::directory_entry& file : fs::directory_iterator(folder, failed)) {
    if (file.path().extension() != ".csv") continue;
    std::string name = file.path().stem().string();
    const bool changes = name.size() > kChanges.size() &&
                         name.compare(name.size() - kChanges.size(), kChanges.size(), kChanges) == 0;
    if (changes) name.resize(name.size() - kChanges.size());
    JointDay& joint = joints[name];
    joint.joint = name;
    if (changes) {
      joint.changes = diagnosis::read_change_log(file.path());
      continue;
    }
    diagnosis::HistoryFile history = diagnosis::read_history(file.path());
    for (const diagnosis::HistoryEntry& e : history.entries)
      if (e.event == diagnosis::kEstimateEvent) joint.estimates.push_back(e);
    warnings.insert(warnings.end(), history.warnings.begin(), history.warnings.end());
  }
  if (failed) throw MissingInput(folder + ": cannot be read: " + failed.message());
  if (joints.empty()) throw BadData(folder, "holds no JOINT.csv or JOINT_changes.csv of a monitor");
  return joints;
}

double last_time(const std::map<std::string, JointDay>& joints) {
  double last = -INFINITY;
  for (const auto& [name, joint] : joints) {
    for (const diagnosis::HistoryEntry& e : joint.estimates) last = std::max(last, e.time);
    for (const diagnosis::KnownChange& c : joint.changes) last = std::max(last, c.seen);
  }
  return last;
}

JointDay within(JointDay joint, double from, double to) {
  const auto drop = [](auto& all, const auto& outside) {
    all.erase(std::remove_if(all.begin(), all.end(), outside), all.end());
  };
  drop(joint.estimates, [&](const diagnosis::HistoryEntry& e) { return e.time < from || e.time > to; });
  drop(joint.changes, [&](const diagnosis::KnownChange& c) {
    return c.state == diagnosis::ChangeState::withdrawn || c.found.since > to ||
           c.found.until.value_or(to) < from;
  });
  std::stable_sort(joint.estimates.begin(), joint.estimates.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  return joint;
}

/// All plays of a page are in one unit: lengths only if every play has one.
bool lengths(const Day& day) {
  for (const JointDay& joint : day.joints)
    for (const diagnosis::HistoryEntry& e : joint.estimates)
      if (has_play(e) && !std::isfinite(e.backlash) && !std::isfinite(e.upper)) return false;
  return true;
}

bool standing(const JointDay& joint) {
  return std::any_of(joint.changes.begin(), joint.changes.end(), [](const diagnosis::KnownChange& c) {
    return c.state == diagnosis::ChangeState::standing;
  });
}

/// Of the verdict's colour and of the order of joints, the worst first.
const char* const kGrades[] = {"stop", "service", "watch", "cannot_tell", "ungraded", "good"};

/// Place in kGrades; a joint that has changed is one to watch, a silent one is not known.
std::size_t severity(const JointDay& joint) {
  const std::string grade = joint.estimates.empty() ? "cannot_tell" : joint.estimates.back().grade;
  const auto place = std::size_t(std::find(std::begin(kGrades), std::end(kGrades), grade) - kGrades);
  const std::size_t most = standing(joint) ? 2 : joint.silent_since ? 3 : 5;
  return std::min(place, most);
}

/// "changed, watch", "good", "good, silent", "no estimate": what a reader looks for first.
std::string state_text(const JointDay& joint) {
  std::string grade = joint.estimates.empty() ? "no estimate" : joint.estimates.back().grade;
  std::replace(grade.begin(), grade.end(), '_', ' ');
  if (standing(joint))
    grade = grade == "watch" || grade == "service" || grade == "stop" ? "changed, " + grade : "changed";
  return grade + (joint.silent_since ? ", silent" : "");
}

/// "80.0 [78.2, 81.9] um", "< 5.1 um"; empty: none. `length`: along the line of action, else as an angle.
std::string play_text(const diagnosis::HistoryEntry* e, bool length) {
  if (!e) return "";
  const double unit = length ? 1e-6 : 1e-3, value = length ? e->backlash : e->backlash_angle;
  const double lower = length ? e->lower : e->angle_lower, upper = length ? e->upper : e->angle_upper;
  const char* const name = length ? "\u00b5m" : "mrad";
  if (!std::isfinite(value)) return "< " + four_digits(upper / unit) + " " + name;
  return fmt::format("{} [{}, {}] {}", four_digits(value / unit), four_digits(lower / unit),
                     four_digits(upper / unit), name);
}

struct PlayEstimates {
  const diagnosis::HistoryEntry *first = nullptr, *last = nullptr;
  std::size_t count = 0;
};

PlayEstimates play_estimates(const JointDay& joint) {
  PlayEstimates found;
  for (const diagnosis::HistoryEntry& e : joint.estimates) {
    if (!has_play(e)) continue;
    if (!found.first) found.first = &e;
    found.last = &e;
    ++found.count;
  }
  return found;
}

std::string count_text(const JointDay& joint, const PlayEstimates& found) {
  if (joint.estimates.empty()) return "none";
  std::string text = fmt::format("{} of {} with a play", found.count, joint.estimates.size());
  if (found.last) text += ", the last " + utc_time(found.last->time);
  return text;
}

/// Why a joint has no entry at the end of the day, as far as the files show.
std::string silence_text(const JointDay& joint, const Day& day) {
  if (!joint.silent_since) return "";
  const bool all = std::all_of(day.joints.begin(), day.joints.end(), [](const JointDay& other) {
    return other.silent_since.has_value() || other.estimates.empty();
  });
  return fmt::format("nothing since {} ({:.1f} h): {}", utc_time(*joint.silent_since),
                     ((std::isnan(day.now) ? day.to : day.now) - *joint.silent_since) / 3600,
                     all ? "no diagnoser wrote, it had ended or got no sample"
                         : "no sample of this joint, while others had theirs");
}

Json joint_json(const JointDay& joint, const Day& day) {
  const PlayEstimates found = play_estimates(joint);
  Json json = {{"joint", joint.joint},
               {"grade", joint.estimates.empty() ? "" : joint.estimates.back().grade},
               {"estimates", joint.estimates.size()},
               {"told", found.count},
               {"silent_since", joint.silent_since ? Json(*joint.silent_since) : Json(nullptr)},
               {"silence", silence_text(joint, day)},
               {"series", Json::array()},
               {"changes", Json::array()}};
  for (const diagnosis::HistoryEntry& e : joint.estimates)
    json["series"].push_back({{"time", e.time},
                              {"grade", e.grade},
                              {"backlash", json_number(e.backlash)},
                              {"interval", json_interval(e.lower, e.upper)},
                              {"backlash_angle", json_number(e.backlash_angle)},
                              {"angle_interval", json_interval(e.angle_lower, e.angle_upper)}});
  for (const diagnosis::KnownChange& c : joint.changes)
    json["changes"].push_back({{"id", c.id},
                               {"state", diagnosis::to_string(c.state)},
                               {"effect", c.found.effect},
                               {"since", c.found.since},
                               {"since_interval", {c.found.since_from, c.found.since_to}},
                               {"until", c.found.until ? Json(*c.found.until) : Json(nullptr)},
                               {"text", change_text(c.found)}});
  return json;
}

/// "Changed: wrist. Good: elbow, shoulder.", the worst first.
std::string answer_of(const Day& day) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;
  for (std::size_t place = 0; place < std::size(kGrades); ++place)
    for (const JointDay& joint : day.joints) {
      if (severity(joint) != place) continue;
      std::string state = state_text(joint);
      state[0] = char(std::toupper(state[0]));
      auto group =
          std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.first == state; });
      if (group == groups.end()) group = groups.emplace(groups.end(), state, std::vector<std::string>());
      group->second.push_back(joint.joint);
    }
  std::string answer;
  for (const auto& [state, names] : groups)
    answer += (answer.empty() ? "" : " ") + state + ": " + joined(names) + ".";
  return answer;
}

Json row_of(const JointDay& joint, const Day& day) {
  const PlayEstimates found = play_estimates(joint);
  const bool length = lengths(day);
  Json row = {{"joint", joint.joint},
              {"state", state_text(joint)},
              {"first", play_text(found.first, length)},
              {"last", play_text(found.last, length)},
              {"estimates", count_text(joint, found)},
              {"changes", Json::array()}};
  for (const diagnosis::KnownChange& c : joint.changes)
    row["changes"].push_back(change_text(c.found) + (c.state == diagnosis::ChangeState::ended ? ", over"
                                                     : c.state == diagnosis::ChangeState::unseen
                                                         ? ", no longer seen"
                                                         : ""));
  return row;
}

std::string plots_of(const Day& day) {
  try {
    const ScratchFolder scratch;
    write_file(scratch.path("day.json"), day_json(day));
    return drawn_figures("day_report.py", {scratch.path("day.json")});
  } catch (const CannotWrite& error) {
    return no_figures(error.what());
  }
}

}  // namespace

bool has_play(const diagnosis::HistoryEntry& e) {
  return std::isfinite(e.backlash) || std::isfinite(e.upper) || std::isfinite(e.backlash_angle) ||
         std::isfinite(e.angle_upper);
}

bool silent(const Day& day) {
  return !std::isnan(day.now) && std::all_of(day.joints.begin(), day.joints.end(), [](const JointDay& joint) {
    return joint.silent_since.has_value();
  });
}

Day read_day(const std::string& folder, double to, double hours, double now) {
  Day day;
  const std::map<std::string, JointDay> all = read_files(folder, day.warnings);
  day.to = std::isnan(to) ? last_time(all) : to;
  if (!std::isfinite(day.to)) throw BadData(folder, "its files hold no estimate and no change");
  day.from = day.to - 3600 * hours;
  if (std::isnan(to) && now > day.to) day.now = now;
  for (const auto& [name, joint] : all) {
    day.joints.push_back(within(joint, day.from, day.to));
    day.joints.back().silent_since =
        diagnosis::silent_since(day.joints.back().estimates, std::isnan(day.now) ? day.to : day.now);
  }
  return day;
}

std::string day_summary(const Day& day) {
  std::vector<std::string> changes;
  std::size_t mute = 0;
  for (const JointDay& joint : day.joints) {
    mute += play_estimates(joint).count == 0;
    for (const diagnosis::KnownChange& c : joint.changes)
      changes.push_back(joint.joint + ": " + change_text(c.found));
  }
  std::string text = fmt::format("{} to {}: {} {}, ", utc_time(day.from), utc_time(day.to), day.joints.size(),
                                 day.joints.size() == 1 ? "joint" : "joints");
  text += changes.empty() ? "no change was reported" : "changed: " + joined(changes);
  if (mute > 0) text += fmt::format("; of {} no estimate states the play", mute);
  for (const JointDay& joint : day.joints)
    if (joint.silent_since) text += "; " + joint.joint + ": " + silence_text(joint, day);
  return text;
}

std::string day_json(const Day& day) {
  Json json = {
      {"schema_version", 1},         {"version", version()},    {"from", day.from},        {"to", day.to},
      {"summary", day_summary(day)}, {"joints", Json::array()}, {"warnings", day.warnings}};
  for (const JointDay& joint : day.joints) json["joints"].push_back(joint_json(joint, day));
  return dumped(json, 1);
}

std::string day_page(const Day& day, const Provenance& provenance) {
  std::size_t worst = std::size(kGrades) - 1;
  for (const JointDay& joint : day.joints) worst = std::min(worst, severity(joint));
  Json data = {{"grade", kGrades[worst]},
               {"answer", answer_of(day)},
               {"from", utc_time(day.from)},
               {"to", utc_time(day.to)},
               {"notes", Json::array()},
               {"joints", Json::array()},
               {"plots", plots_of(day)},
               {"warnings", warnings_section(day.warnings)},
               {"provenance", provenance_sections(provenance)}};
  for (const JointDay& joint : day.joints) {
    data["joints"].push_back(row_of(joint, day));
    for (const Json& change : data["joints"].back()["changes"])
      data["notes"].push_back(joint.joint + ": " + change.get<std::string>());
    if (joint.silent_since) data["notes"].push_back(joint.joint + ": " + silence_text(joint, day));
  }
  return report_page("Joints on " + utc_date(day.to), filled(kDayTemplate, data));
}

}  // namespace backlash::report
