// SPDX-License-Identifier: BSD-3-Clause
// What the page of a trace shows, for its template.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/report/report_page.h"
#include "backlash_diagnosis/signal/measured_text.h"
#include "report/html_template.h"

namespace backlash::findings {
namespace {

/// Value, error where it is known, and unit.
report::Json quantity(const signal::Measured& m, const std::string& unit) {
  const signal::ValueText text = signal::value_text(m);
  return {{"value", text.value}, {"error", text.error}, {"unit", unit == "-" ? "" : unit}};
}

/// The errors of one channel as bars, the longest one as wide as the column.
void add_bars(const std::string& name, const identification::TraceChannel& c, report::Json& bars) {
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

report::Json effect(const identification::FoundEffect& e, bool linear) {
  const identification::Evidence& v = e.evidence;
  std::string alike = e.equivalent_to.empty() ? "none" : joined(e.equivalent_to);
  if (!e.nearest.empty()) alike += "; nearest named effects: " + joined(e.nearest);
  report::Json json = {{"id", e.id},
                       {"map", model::term_type(e.id).map ? effect_name(e) : ""},
                       {"words", report::Json::array()},
                       {"parameters", report::Json::array()},
                       {"channel", e.channel},
                       {"before", percent(e.test_error_before)},
                       {"after", percent(e.test_error_after)},
                       {"gain", percent(v.gain)},
                       {"gain_held_out", percent(v.gain_held_out)},
                       {"alike", alike}};
  for (const auto& [name, word] : e.words) json["words"].push_back({{"name", name}, {"word", word}});
  for (const identification::EffectParameter& p : e.parameters) {
    json["parameters"].push_back(quantity(p.measured, model::axis_unit(p.unit, linear)));
    json["parameters"].back()["name"] = p.name;
  }
  return json;
}

report::Json machine(const identification::Trace& trace) {
  report::Json rows = report::Json::array();
  for (const auto& [name, value] : trace.parameters) {
    const std::string unit = model::axis_unit(trace.units.at(name), trace.augmented.linear);
    const auto before = trace.base_parameters.find(name);
    const report::Json unknown = {{"value", ""}, {"error", ""}, {"unit", ""}};
    rows.push_back({{"name", name},
                    {"values",
                     {before == trace.base_parameters.end() ? unknown : quantity(before->second, unit),
                      quantity(value, unit)}}});
  }
  return rows;
}

}  // namespace

std::string trace_page(const identification::Trace& trace, const TraceInputs& inputs,
                       const std::string& plots, const std::string& provenance) {
  report::Json data = {{"verdict", to_string(trace.verdict)},
                       {"has_result", trace.determined},
                       {"message", verdict_sentence(trace)},
                       {"rig", inputs.rig},
                       {"train", joined(inputs.train)},
                       {"test", inputs.test},
                       {"cutoff", fmt::format("{:.4g}", trace.cutoff)},
                       {"bars", report::Json::array()},
                       {"has_effects", !trace.steps.empty()},
                       {"effects", report::Json::array()},
                       {"notes", trace.notes},
                       {"warnings", report::warnings_section(trace.warnings)},
                       {"plots", plots},
                       {"has_independence", !trace.independence.empty()},
                       {"independence", report::Json::array()},
                       {"machine", machine(trace)},
                       {"provenance", provenance}};
  for (const auto& [name, channel] : trace.channels) add_bars(name, channel, data["bars"]);
  for (const identification::FoundEffect& e : trace.steps)
    data["effects"].push_back(effect(e, trace.augmented.linear));
  if (trace.unexplained)
    data["unexplained"] = {{"channel", trace.unexplained->channel},
                           {"signature", trace.unexplained->signature}};
  for (const identification::Independence& i : trace.independence)
    data["independence"].push_back({{"channel", i.channel},
                                    {"input", i.input},
                                    {"before", percent(i.before)},
                                    {"after", percent(i.after)}});
  return report::report_page("What the model of " + trace.augmented.name + " lacks",
                             report::filled(report::kTraceTemplate, data));
}

}  // namespace backlash::findings
