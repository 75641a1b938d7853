// SPDX-License-Identifier: BSD-3-Clause
// What the page of a trace shows, for its template.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/report/report_page.h"
#include "report/html_template.h"
#include "value_text.h"

namespace backlash {
namespace {

/// Value, error where it is known, and unit.
Json quantity(const Measured& m, const std::string& unit) {
  const ValueText text = value_text(m);
  return {{"value", text.value}, {"error", text.error}, {"unit", unit == "-" ? "" : unit}};
}

/// The errors of one channel as bars, the longest one as wide as the column.
void add_bars(const std::string& name, const TraceChannel& c, Json& bars) {
  const double most = std::max({c.before, c.after, c.floor, 1e-12});
  const auto add = [&](const char* kind, const char* label, double error) {
    const double width = std::isfinite(error) ? 100 * std::clamp(error / most, 0.0, 1.0) : 0.0;
    bars.push_back({{"channel", kind == std::string("before") ? name : ""},
                    {"kind", kind},
                    {"label", label},
                    {"width", fmt::format("{:.2f}", width)},
                    {"error", percent(error)}});
  };
  add("before", "before", c.before);
  add("after", "after", c.after);
  add("floor", "noise alone", c.floor);
}

Json effect(const FoundEffect& e, bool linear) {
  const Evidence& v = e.evidence;
  std::string alike = e.equivalent_to.empty() ? "none" : joined(e.equivalent_to);
  if (!e.nearest.empty()) alike += "; nearest named effects: " + joined(e.nearest);
  Json json = {{"id", e.id},
               {"map", term_type(e.id).map ? effect_name(e) : ""},
               {"words", Json::array()},
               {"parameters", Json::array()},
               {"channel", e.channel},
               {"before", percent(e.test_error_before)},
               {"after", percent(e.test_error_after)},
               {"gain", percent(v.gain)},
               {"gain_held_out", percent(v.gain_held_out)},
               {"gain_forward", percent(v.gain_forward)},
               {"blocks_better", v.blocks_better},
               {"blocks", v.blocks},
               {"alike", alike}};
  for (const auto& [name, word] : e.words) json["words"].push_back({{"name", name}, {"word", word}});
  for (const EffectParameter& p : e.parameters) {
    json["parameters"].push_back(quantity(p.measured, axis_unit(p.unit, linear)));
    json["parameters"].back()["name"] = p.name;
  }
  return json;
}

Json machine(const Trace& trace) {
  Json rows = Json::array();
  for (const auto& [name, value] : trace.parameters) {
    const std::string unit = axis_unit(trace.units.at(name), trace.augmented.linear);
    const auto before = trace.base_parameters.find(name);
    const Json unknown = {{"value", ""}, {"error", ""}, {"unit", ""}};
    rows.push_back({{"name", name},
                    {"values",
                     {before == trace.base_parameters.end() ? unknown : quantity(before->second, unit),
                      quantity(value, unit)}}});
  }
  return rows;
}

}  // namespace

std::string trace_page(const Trace& trace, const TraceInputs& inputs, const std::string& plots,
                       const std::string& provenance) {
  Json data = {{"verdict", to_string(trace.verdict)},
               {"message", verdict_sentence(trace)},
               {"rig", inputs.rig},
               {"train", joined(inputs.train)},
               {"test", inputs.test},
               {"cutoff", fmt::format("{:.4g}", trace.cutoff)},
               {"bars", Json::array()},
               {"has_effects", !trace.steps.empty()},
               {"effects", Json::array()},
               {"notes", trace.notes},
               {"has_warnings", !trace.warnings.empty()},
               {"warnings", trace.warnings},
               {"plots", plots},
               {"has_independence", !trace.independence.empty()},
               {"independence", Json::array()},
               {"machine", machine(trace)},
               {"provenance", provenance}};
  for (const auto& [name, channel] : trace.channels) add_bars(name, channel, data["bars"]);
  for (const FoundEffect& e : trace.steps) data["effects"].push_back(effect(e, trace.augmented.linear));
  if (trace.unexplained)
    data["unexplained"] = {{"channel", trace.unexplained->channel},
                           {"signature", trace.unexplained->signature}};
  for (const Independence& i : trace.independence)
    data["independence"].push_back({{"channel", i.channel},
                                    {"input", i.input},
                                    {"before", percent(i.before)},
                                    {"after", percent(i.after)}});
  return report_page("What the model of " + trace.augmented.name + " lacks", filled(kTraceTemplate, data));
}

}  // namespace backlash
