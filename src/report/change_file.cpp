// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/change_file.h"

#include <fmt/format.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"
#include "report/json.h"

namespace backlash::report {
namespace {

double number(const Json& json) {
  return json.is_number() ? json.get<double>() : kNaN;
}

diagnosis::FoundChange change_from(const Json& json, double origin) {
  diagnosis::FoundChange change;
  change.effect = json.at("effect");
  change.since = origin + json.at("since").get<double>();
  change.since_from = origin + json.at("since_interval").at(0).get<double>();
  change.since_to = origin + json.at("since_interval").at(1).get<double>();
  if (!json.at("until").is_null()) change.until = origin + json.at("until").get<double>();
  for (const auto& [name, size] : json.at("size").items())
    change.size.push_back(
        {name, size.at("unit"), number(size.at("value")), number(size.at("standard_error"))});
  change.equivalent_to = json.at("equivalent_to").get<std::vector<std::string>>();
  change.gain = number(json.at("gain"));
  change.error_before = number(json.at("error_before"));
  change.error_after = number(json.at("error_after"));
  return change;
}

/// "12:30:05" of "2027-03-01T12:30:05Z"
std::string time_of_day(double time) {
  const std::string text = utc_time(time);
  return text.size() < 20 ? text : text.substr(11, 8);
}

}  // namespace

diagnosis::ChangeLook read_changes(const std::string& path, double origin, bool of_arm) {
  std::ifstream in = open_input(path);
  try {
    const Json json = Json::parse(in);
    diagnosis::ChangeLook look;
    for (const Json& change : json.at("changes")) {
      look.changes.push_back(change_from(change, origin));
      if (of_arm) look.changes.back().joint = change.at("joint");
    }
    look.different = json.at("different_from_beginning").get<std::vector<std::string>>();
    for (const Json& joint : json.at("unjudged"))
      look.unjudged.push_back(joint.at("joint").get<std::string>() + ": " +
                              joint.at("why").get<std::string>());
    look.windows = json.at("windows");
    look.warnings = json.at("warnings").get<std::vector<std::string>>();
    return look;
  } catch (const Json::exception& error) {
    throw BadData(path, std::string("is no list of changes: ") + error.what());
  }
}

std::string change_text(const diagnosis::FoundChange& change) {
  std::string text = (change.joint.empty() ? "" : change.joint + ": ") + change.effect + " since " +
                     utc_time(change.since) + " (" + time_of_day(change.since_from) + " to " +
                     time_of_day(change.since_to) + ")";
  if (change.until) text += ", until " + utc_time(*change.until);
  const char* before = ": ";
  for (const diagnosis::FoundSize& s : change.size) {
    text += fmt::format("{}{} {:.4g} +- {:.2g} {}", before, s.name, s.value, s.standard_error, s.unit);
    before = ", ";
  }
  if (change.effect == "unknown")
    text += "; no effect explains it";
  else if (!change.equivalent_to.empty())
    text += "; not distinguished from " + joined(change.equivalent_to);
  return text;
}

}  // namespace backlash::report
