// SPDX-License-Identifier: BSD-3-Clause
// The page that shows a trace: text and tables from here, figures as they come.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/report/html.h"
#include "backlash_diagnosis/report/report_page.h"
#include "backlash_diagnosis/report/trace_files.h"

namespace backlash {
namespace {

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
    rows +=
        html_row(html_cell(rows.empty() ? html_tag("b", html_text(name)) : "") + html_cell(label) +
                 html_cell(html_tag("div", "", "class=\"bar " + std::string(kind) + "\" " + style), "wide") +
                 html_cell(percent(error), "number"));
  }
  return rows;
}

std::string effect_row(const FoundEffect& e, bool linear) {
  std::string name = html_tag("b", html_text(e.id)), parameters;
  if (term_type(e.id).map) name += "<br>" + html_text(effect_name(e)) + "; shape as plotted";
  for (const auto& [key, word] : e.words) name += "<br>" + html_text(key + ": " + word);
  for (const EffectParameter& p : e.parameters)
    parameters += html_text(p.name) + " = " +
                  html_tag("span", value_text(p.measured, axis_unit(p.unit, linear)), "class=\"number\"") +
                  "<br>";
  const Evidence& v = e.evidence;
  const std::string evidence = "training records " + percent(v.gain) + "<br>blocks left out " +
                               percent(v.gain_held_out) + ", " + std::to_string(v.blocks_better) + " of " +
                               std::to_string(v.blocks) + " better<br>last part " + percent(v.gain_forward);
  std::string alike = e.equivalent_to.empty() ? "none" : joined(e.equivalent_to);
  if (!e.nearest.empty()) alike += "; nearest named effects: " + joined(e.nearest);
  return html_row(html_cell(name) + html_cell(parameters) +
                  html_cell(html_text(e.channel) + "<br>" + percent(e.test_error_before) + " &rarr; " +
                            percent(e.test_error_after)) +
                  html_cell(evidence) + html_cell(html_text(alike)));
}

std::string effects_section(const Trace& trace) {
  if (trace.steps.empty()) return "";
  std::string rows = html_heads(
      {"effect", "parameters", "error on the test record", "residual smaller by", "would explain the same"});
  for (const FoundEffect& e : trace.steps) rows += effect_row(e, trace.augmented.linear);
  return html_tag("h2", "Effects that were added") + "\n" + html_table(rows) +
         "<p class=\"small\">&plusmn; one standard error; without one: chosen among values, or not "
         "known.</p>\n";
}

std::string independence_section(const Trace& trace) {
  if (trace.independence.empty()) return "";
  std::string rows = html_heads({"residual of", "against", "before", "after"});
  for (const Independence& i : trace.independence)
    rows += html_row(html_cell(html_text(i.channel)) + html_cell(html_text(i.input)) +
                     html_cell(percent(i.before), "number") + html_cell(percent(i.after), "number"));
  return html_tag("h2", "Does the residual still follow an input?") + "\n" + html_table(rows) +
         "<p class=\"small\">Share of lags at which the correlation leaves the 99 % band of independence; "
         "1 % by "
         "chance.</p>\n";
}

std::string machine_section(const Trace& trace) {
  std::string rows = html_heads({"parameter", "without effects", "with effects"});
  for (const auto& [name, value] : trace.parameters) {
    const std::string unit = axis_unit(trace.units.at(name), trace.augmented.linear);
    const auto before = trace.base_parameters.find(name);
    rows += html_row(
        html_cell(html_text(name)) +
        html_cell(before == trace.base_parameters.end() ? "" : value_text(before->second, unit), "number") +
        html_cell(value_text(value, unit), "number"));
  }
  return html_tag("h2", "The machine, at the load side of the reduction") + "\n" + html_table(rows);
}

std::string remarks_section(const Trace& trace) {
  std::string text;
  if (trace.unexplained)
    text += html_tag("h2", "Unexplained") + "\n" +
            html_tag("p", html_tag("b", html_text(trace.unexplained->channel)) + ": " +
                              html_text(trace.unexplained->signature)) +
            "\n";
  for (const std::string& note : trace.notes) text += html_tag("p", "Note: " + html_text(note)) + "\n";
  if (trace.warnings.empty()) return text;
  std::string items;
  for (const std::string& warning : trace.warnings) items += html_tag("li", html_text(warning)) + "\n";
  return text + html_tag("h2", "Warnings") + "\n" + html_tag("ul", items) + "\n";
}

}  // namespace

std::string trace_page(const Trace& trace, const TraceInputs& inputs, const std::string& plots,
                       const std::string& provenance) {
  std::string errors;
  for (const auto& [name, channel] : trace.channels) errors += bars(name, channel);
  char cutoff[32];
  std::snprintf(cutoff, sizeof cutoff, "%.4g Hz", trace.cutoff);
  const std::string records = "Rig " + html_text(inputs.rig) + "; trained on " +
                              html_text(joined(inputs.train)) + "; tested on " + html_text(inputs.test) + ".";
  return report_page(
      "What the model of " + trace.augmented.name + " lacks",
      html_tag("p", html_text(verdict_sentence(trace)),
               "class=\"verdict " + to_string(trace.verdict) + "\"") +
          "\n" + html_tag("p", records, "class=\"small\"") + "\n" +
          html_tag("h2", "Before and after, on the test record") + "\n" + html_table(errors, "bars") +
          "<p class=\"small\">Relative error norm(r) / norm(y - mean(y)) of signals low-passed at " + cutoff +
          "; before: the declared model, fitted; after: with all effects, fitted; noise alone: what a "
          "perfect "
          "model would leave.</p>\n" +
          effects_section(trace) + remarks_section(trace) + html_tag("h2", "Plots") + "\n" + plots +
          independence_section(trace) + machine_section(trace) + provenance);
}

}  // namespace backlash
