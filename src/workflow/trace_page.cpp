// SPDX-License-Identifier: BSD-3-Clause
// The page that shows a trace: text and tables from here, figures as they come.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/workflow/trace_files.h"

namespace backlash {
namespace {

const char* const kStyle = R"(
body { font: 15px/1.5 sans-serif; color: #222; max-width: 62em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ccc; }
h3 { font-size: 1em; margin-bottom: 0; }
table { border-collapse: collapse; } th, td { text-align: left; vertical-align: top; padding: 0.3em 1em 0.3em 0; }
th { font-weight: normal; color: #666; } tr + tr td { border-top: 1px solid #eee; }
.verdict { border-left: 0.5em solid; padding: 0.5em 1em; background: #f6f6f6; }
.effect_found { border-color: #d98200; } .nothing_missing { border-color: #2a8a3e; }
.unexplained { border-color: #b3261e; }
.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
.bars td { padding-top: 0; padding-bottom: 0; border: 0; } .bars .wide { width: 32em; }
.bar { height: 0.9em; min-width: 1px; }
.before { background: #9aa7b5; } .after { background: #1f6fb4; } .floor { background: #d5d5d5; }
.small { color: #666; font-size: 0.9em; } figure { margin: 1em 0; } img { max-width: 100%; }
)";

std::string tag(const std::string& name, const std::string& content, const std::string& attributes = "") {
  return "<" + name + (attributes.empty() ? "" : " " + attributes) + ">" + content + "</" + name + ">";
}

std::string cell(const std::string& content, const std::string& kind = "") {
  return tag("td", content, kind.empty() ? "" : "class=\"" + kind + "\"");
}

std::string heads(const std::vector<std::string>& names) {
  std::string cells;
  for (const std::string& name : names) cells += tag("th", name);
  return tag("tr", cells) + "\n";
}

/// "12.3 &plusmn; 0.4 N m"
std::string value_text(const Measured& m, const std::string& unit) {
  std::string text = with_error(m);
  const std::size_t sign = text.find("+-");
  if (sign != std::string::npos) text.replace(sign, 2, "&plusmn;");
  return text + (unit == "-" ? "" : " " + html_text(unit));
}

std::string bars(const std::string& name, const TraceChannel& c) {
  const double most = std::max({c.before, c.after, c.floor, 1e-12});
  std::string rows;
  const std::pair<const char*, double> all[] = {{"before", c.before}, {"after", c.after}, {"floor", c.floor}};
  for (const auto& [kind, error] : all) {
    char style[64];
    std::snprintf(style, sizeof style, "style=\"width:%.2f%%\"",
                  std::isfinite(error) ? 100 * std::clamp(error / most, 0.0, 1.0) : 0.0);
    const std::string label = std::string(kind) == "floor" ? "noise alone" : kind;
    rows += tag("tr", cell(rows.empty() ? tag("b", html_text(name)) : "") + cell(label) +
                          cell(tag("div", "", "class=\"bar " + std::string(kind) + "\" " + style), "wide") +
                          cell(percent(error), "number")) +
            "\n";
  }
  return rows;
}

std::string effect_row(const FoundEffect& e, bool linear) {
  std::string name = tag("b", html_text(e.id)), parameters;
  if (e.id == "learned_map") name += "<br>" + html_text(effect_name(e)) + "; shape as plotted";
  for (const auto& [key, word] : e.words) name += "<br>" + html_text(key + ": " + word);
  for (const EffectParameter& p : e.parameters)
    parameters += html_text(p.name) + " = " +
                  tag("span", value_text(p.measured, axis_unit(p.unit, linear)), "class=\"number\"") + "<br>";
  const Evidence& v = e.evidence;
  const std::string evidence = "training records " + percent(v.gain) + "<br>blocks left out " +
                               percent(v.gain_held_out) + ", " + std::to_string(v.blocks_better) + " of " +
                               std::to_string(v.blocks) + " better<br>last part " + percent(v.gain_forward);
  std::string alike = e.equivalent_to.empty() ? "none" : joined(e.equivalent_to);
  if (!e.nearest.empty()) alike += "; nearest named effects: " + joined(e.nearest);
  return tag("tr", cell(name) + cell(parameters) +
                       cell(html_text(e.channel) + "<br>" + percent(e.test_error_before) + " &rarr; " +
                            percent(e.test_error_after)) +
                       cell(evidence) + cell(html_text(alike))) +
         "\n";
}

std::string effects_section(const Trace& trace) {
  if (trace.steps.empty()) return "";
  std::string rows = heads(
      {"effect", "parameters", "error on the test record", "residual smaller by", "would explain the same"});
  for (const FoundEffect& e : trace.steps) rows += effect_row(e, trace.augmented.linear);
  return tag("h2", "Effects that were added") + "\n" + tag("table", rows) +
         "\n<p class=\"small\">&plusmn; one standard error; without one: chosen among values, or not "
         "known.</p>\n";
}

std::string independence_section(const Trace& trace) {
  if (trace.independence.empty()) return "";
  std::string rows = heads({"residual of", "against", "before", "after"});
  for (const Independence& i : trace.independence)
    rows += tag("tr", cell(html_text(i.channel)) + cell(html_text(i.input)) +
                          cell(percent(i.before), "number") + cell(percent(i.after), "number")) +
            "\n";
  return tag("h2", "Does the residual still follow an input?") + "\n" + tag("table", rows) +
         "\n<p class=\"small\">Share of lags at which the correlation leaves the 99 % band of independence; "
         "1 % by "
         "chance.</p>\n";
}

std::string machine_section(const Trace& trace) {
  std::string rows = heads({"parameter", "without effects", "with effects"});
  for (const auto& [name, value] : trace.parameters) {
    const std::string unit = axis_unit(trace.units.at(name), trace.augmented.linear);
    const auto before = trace.base_parameters.find(name);
    rows += tag("tr", cell(html_text(name)) +
                          cell(before == trace.base_parameters.end() ? "" : value_text(before->second, unit),
                               "number") +
                          cell(value_text(value, unit), "number")) +
            "\n";
  }
  return tag("h2", "The machine, at the load side of the reduction") + "\n" + tag("table", rows) + "\n";
}

std::string remarks_section(const Trace& trace) {
  std::string text;
  if (trace.unexplained)
    text += tag("h2", "Unexplained") + "\n" +
            tag("p", tag("b", html_text(trace.unexplained->channel)) + ": " +
                         html_text(trace.unexplained->signature)) +
            "\n";
  for (const std::string& note : trace.notes) text += tag("p", "Note: " + html_text(note)) + "\n";
  if (trace.warnings.empty()) return text;
  std::string items;
  for (const std::string& warning : trace.warnings) items += tag("li", html_text(warning)) + "\n";
  return text + tag("h2", "Warnings") + "\n" + tag("ul", items) + "\n";
}

}  // namespace

std::string html_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string trace_page(const Trace& trace, const TraceInputs& inputs, const std::string& plots) {
  const std::string title = "What the model of " + html_text(trace.augmented.name) + " lacks";
  std::string errors;
  for (const auto& [name, channel] : trace.channels) errors += bars(name, channel);
  char cutoff[32];
  std::snprintf(cutoff, sizeof cutoff, "%.4g Hz", trace.cutoff);
  const std::string records = "Rig " + html_text(inputs.rig) + "; trained on " +
                              html_text(joined(inputs.train)) + "; tested on " + html_text(inputs.test) + ".";
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n" + tag("title", title) +
         "\n" + tag("style", kStyle) + "\n</head>\n<body>\n" + tag("h1", title) + "\n" +
         tag("p", html_text(verdict_sentence(trace)), "class=\"verdict " + to_string(trace.verdict) + "\"") +
         "\n" + tag("p", records, "class=\"small\"") + "\n" +
         tag("h2", "Before and after, on the test record") + "\n" + tag("table", errors, "class=\"bars\"") +
         "\n<p class=\"small\">Relative error norm(r) / norm(y - mean(y)) of signals low-passed at " +
         cutoff +
         "; before: the declared model, fitted; after: with all effects, fitted; noise alone: what a perfect "
         "model would leave.</p>\n" +
         effects_section(trace) + remarks_section(trace) + tag("h2", "Plots") + "\n" + plots +
         independence_section(trace) + machine_section(trace) +
         "<p class=\"small\">trace_residual (backlash_diagnosis) " + version() + "</p>\n</body>\n</html>\n";
}

}  // namespace backlash
