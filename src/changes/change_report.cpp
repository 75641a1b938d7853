// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/change_report.h"

#include <fmt/format.h>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/signal/measured_text.h"
#include "report/json.h"

namespace backlash::changes {
namespace {

report::Json change_json(const Change& c, const std::string& joint) {
  report::Json size = report::Json::object();
  for (const ChangeSize& s : c.size) {
    size[s.name] = report::measured(s.measured);
    size[s.name]["unit"] = s.unit;
  }
  report::Json json = {{"effect", c.effect},
                       {"joint", c.joint.empty() ? joint : c.joint},
                       {"since", c.since},
                       {"since_interval", {c.since_from, c.since_to}},
                       {"until", nullptr},
                       {"size", size},
                       {"equivalent_to", c.alike},
                       {"gain", report::json_number(c.gain)},
                       {"error_before", report::json_number(c.error_before)},
                       {"error_after", report::json_number(c.error_after)}};
  if (c.until) json["until"] = *c.until;
  if (!c.link.empty()) json["link"] = c.link;
  return json;
}

}  // namespace

std::string change_summary(const Changes& found) {
  std::string text;
  for (const Change& c : found.changes) {
    const std::string place = !c.link.empty() ? " at " + c.link : !c.joint.empty() ? " of " + c.joint : "";
    text += fmt::format("{}{} since {:.1f} s ({:.1f} to {:.1f})", c.effect, place, c.since, c.since_from,
                        c.since_to);
    if (c.until) text += fmt::format(", until {:.1f} s", *c.until);
    for (const ChangeSize& s : c.size)
      text += fmt::format("; {} {} {}", s.name, signal::with_error(s.measured), s.unit);
    if (c.effect == "unknown")
      text += "; no effect explains it" + (c.alike.empty() ? "" : ", nearest: " + joined(c.alike));
    else if (!c.alike.empty())
      text += "; the record does not distinguish it from: " + joined(c.alike);
    text += "\n";
  }
  if (!found.cannot_tell.empty())
    text +=
        (text.empty() ? "cannot tell: " : "what else has changed is unknown: ") + found.cannot_tell + "\n";
  if (text.empty())
    text =
        found.unjudged.empty() ? "no change found\n" : "no change found of the joints that could be judged\n";
  for (const Unjudged& u : found.unjudged) text += "not judged: " + u.joint + ": " + u.why + "\n";
  if (!found.different.empty())
    text += "from its beginning the record differs from the healthy ones, so that the onset is unknown: " +
            joined(found.different) + "\n";
  return text + fmt::format("{} windows of motion judged\n", found.windows);
}

std::string change_json(const Changes& found, const ChangeInputs& inputs) {
  report::Json changes = report::Json::array();
  for (const Change& c : found.changes) changes.push_back(change_json(c, inputs.joint));
  report::Json unjudged = report::Json::array();
  for (const Unjudged& u : found.unjudged) unjudged.push_back({{"joint", u.joint}, {"why", u.why}});
  report::Json json = {
      {"schema_version", 1},
      {"version", version()},
      {"record", inputs.record},
      {"rig", inputs.rig},
      {"healthy", inputs.healthy},
      {"changes", changes},
      {"windows", found.windows},
      {"false_alarms_per_hour", inputs.false_alarms_per_hour},
      {"threshold", report::json_number(found.threshold)},
      {"healthy_residual", report::json_number(found.noise)},
      {"healthy_deflection_residual", report::json_number(found.deflection_noise)},
      {"healthy_terms", found.healthy_terms},
      {"different_from_beginning", found.different},
      {"cannot_tell", nullptr},
      {"unjudged", unjudged},
      {"warnings", found.warnings},
  };
  if (!found.cannot_tell.empty()) json["cannot_tell"] = found.cannot_tell;
  return report::dumped(json, 2);
}

}  // namespace backlash::changes
