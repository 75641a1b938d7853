// SPDX-License-Identifier: BSD-3-Clause
// A page of the last day of a robot's joints, from the folder that its monitors keep.
#include <algorithm>
#include <ctime>
#include <iostream>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/report/day_page.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "day_report";
  c.summary =
      "Writes a page of the last day of a robot's joints: how much play each had, when that was estimated, "
      "and "
      "what has changed since when.";
  c.positional = {"HISTORY_FOLDER"};
  c.options = {
      {"out", "DAY.html", "page to write, with the plots inside", true},
      {"json", "DAY.json", "the same as data"},
      {"hours", "H", "length of the day; default: 24"},
      {"until", "TIME",
       "its end, UTC, as 2027-03-01T12:00:00Z; default: the last entry of the folder, and since when there "
       "is "
       "none"},
  };
  c.notes =
      "HISTORY_FOLDER is what `~history` of the diagnoser and of change_watch names: JOINT.csv and "
      "JOINT_changes.csv of each joint. It may be read while they write.";
  c.examples = {"day_report ~/history --out day.html", "day_report ~/history --hours 168 --out week.html"};
  c.exit_codes =
      "  0   no change, all grades are good\n"
      "  1   watch: the last grade of a joint\n"
      "  2   a joint has changed, or its last grade is service or stop\n"
      "  3   no estimate states the play of any joint, and no change; or all were good, and nothing "
      "was reported since\n";
  return c;
}

/// NaN where it is not given.
double until(const Arguments& arguments) {
  const std::string text = arguments.text("until");
  if (text.empty()) return kNaN;
  std::tm time = {};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  if (end == nullptr || *end != '\0')
    throw UsageError("--until " + text + " is no time such as 2027-03-01T12:00:00Z");
  return static_cast<double>(timegm(&time));
}

int exit_code(const report::Day& day) {
  int code = kInconclusive;
  const auto worse = [&code](int other) { code = code == kInconclusive ? other : std::max(code, other); };
  for (const report::JointDay& joint : day.joints) {
    if (!joint.changes.empty()) worse(kFault);
    const auto last = std::find_if(joint.estimates.rbegin(), joint.estimates.rend(), report::has_play);
    if (last == joint.estimates.rend()) continue;
    worse(last->grade == "service" || last->grade == "stop" ? kFault
          : last->grade == "watch"                          ? kWatch
                                                            : kHealthy);
  }
  return code == kHealthy && report::silent(day) ? kInconclusive : code;
}

int run(const Arguments& arguments) {
  const std::string& folder = arguments.positional(0);
  const std::string out = arguments.text("out"), json = arguments.text("json");
  check_output(out, {});
  if (!json.empty()) check_output(json, {out});
  const report::Day day = report::read_day(
      folder, until(arguments), arguments.number("hours", 24, Range::positive()), double(std::time(nullptr)));
  if (!json.empty()) write_text(json, report::day_json(day));
  report::Provenance provenance;
  provenance.command = {"day_report"};
  provenance.command.insert(provenance.command.end(), arguments.words().begin(), arguments.words().end());
  write_text(out, report::day_page(day, provenance));
  for (const std::string& warning : day.warnings) std::cerr << "day_report: " << warning << '\n';
  std::cout << report::day_summary(day) << '\n';
  return exit_code(day);
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, run);
}
