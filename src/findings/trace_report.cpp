// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/findings/trace_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/measured_text.h"

namespace backlash::findings {
namespace {

/// "a, b and c"
std::string listed(const std::vector<std::string>& parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return text;
}

constexpr double kSame = 0.01;  // choice: of an error: a smaller change is none

/// "falls from 3 % to 1 %"
std::string change_text(const identification::TraceChannel& c) {
  if (std::fabs(c.after - c.before) <= kSame * c.before) return "stays at " + percent(c.after);
  return (c.after < c.before ? "falls from " : "rises from ") + percent(c.before) + " to " + percent(c.after);
}

std::string effect_text(const identification::FoundEffect& e, bool linear) {
  std::string text = "  " + e.id;
  for (const auto& [name, word] : e.words) text += " (" + name + ": " + word + ")";
  text += ", " + e.channel + " error " + percent(e.test_error_before) + " -> " + percent(e.test_error_after) +
          "\n";
  for (const identification::EffectParameter& p : e.parameters)
    text += fmt::format("    {:<24} {} {}\n", p.name, signal::with_error(p.measured),
                        model::axis_unit(p.unit, linear));
  const identification::Evidence& v = e.evidence;
  text += "    evidence: residual smaller by " + percent(v.gain) + " on the training records, " +
          percent(v.gain_held_out) + " on blocks left out of the fit;\n    on the unseen record smaller by " +
          percent(e.test_gain.value) + " (95 %: " + percent(e.test_gain.lower) + " to " +
          percent(e.test_gain.upper) + ")\n";
  if (!e.nearest.empty()) text += "    nearest named effects: " + joined(e.nearest) + "\n";
  if (!e.equivalent_to.empty()) text += "    would explain the same: " + joined(e.equivalent_to) + "\n";
  return text;
}

std::string remarks(const identification::Trace& trace) {
  std::string text;
  for (const std::string& note : trace.notes) text += "note: " + note + "\n";
  for (const std::string& warning : trace.warnings) text += "warning: " + warning + "\n";
  return text;
}

}  // namespace

std::string effect_name(const identification::FoundEffect& e) {
  const model::TermType& type = model::term_type(e.id);
  if (!type.map) return e.id;
  const auto coordinate = e.words.find(type.map->coordinate);
  if (coordinate == e.words.end()) return e.id;
  return "a function of " + coordinate->second + " that is not one of the named effects";
}

std::string percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.3g} %", 100 * share) : "unknown";
}

std::string to_string(identification::TraceVerdict verdict) {
  switch (verdict) {
    case identification::TraceVerdict::effect_found:
      return "effect_found";
    case identification::TraceVerdict::nothing_missing:
      return "nothing_missing";
    case identification::TraceVerdict::unexplained:
      break;
  }
  return "unexplained";
}

std::string verdict_sentence(const identification::Trace& trace) {
  if (!trace.determined) return "Cannot tell what is missing: " + trace.unexplained->signature + ".";
  std::vector<std::string> effects, errors;
  for (const identification::FoundEffect& e : trace.steps) effects.push_back(effect_name(e));
  for (const auto& [name, c] : trace.channels)
    errors.push_back(
        (effects.empty() ? name + " " + percent(c.after) : "that of " + name + " " + change_text(c)) +
        " (noise alone: " + percent(c.floor) + ")");
  std::string text;
  if (!effects.empty())
    text = "The declared model lacks " + listed(effects) + ". With " + (effects.size() == 1 ? "it" : "them") +
           " the error on the test record changes: " + listed(errors) + ".";
  if (trace.verdict == identification::TraceVerdict::nothing_missing)
    text = "Nothing is missing: the declared model, fitted, has these errors on the test record: " +
           listed(errors) + ".";
  if (trace.verdict == identification::TraceVerdict::unexplained || trace.unexplained) {
    if (trace.several)
      text = identification::description(*trace.several, trace.units, trace.augmented.linear) + ". " + text;
    text += effects.empty() ? "Something is missing" : " Something more is missing";
    text += " that no effect explains";
    if (trace.unexplained) text += ", in " + trace.unexplained->channel + ": " + trace.unexplained->signature;
    text += effects.empty() ? ". Errors on the test record: " + listed(errors) + "." : ".";
  }
  return text;
}

std::string trace_summary(const identification::Trace& trace) {
  if (!trace.determined) return verdict_sentence(trace) + "\n" + remarks(trace);
  const bool linear = trace.augmented.linear;
  std::string text = verdict_sentence(trace) + "\n\nrelative error on the test record, low-passed at " +
                     to_text(std::round(trace.cutoff * 1000) / 1000) + " Hz\n";
  const char* columns = "  {:<12} {:>10} {:>10} {:>14}\n";
  text += fmt::format(columns, "channel", "before", "after", "noise alone");
  for (const auto& [name, c] : trace.channels)
    text += fmt::format(columns, name, percent(c.before), percent(c.after), percent(c.floor));
  const char* inputs = "  {:<12} {:<18} {:>10} {:>10}\n";
  if (!trace.independence.empty())
    text += "\nshare of lags at which the residual still follows an input (0.01 by chance)\n" +
            fmt::format(inputs, "channel", "input", "before", "after");
  for (const identification::Independence& i : trace.independence)
    text += fmt::format(inputs, i.channel, i.input, percent(i.before), percent(i.after));
  if (!trace.steps.empty()) text += "\neffects that were added\n";
  for (const identification::FoundEffect& e : trace.steps) text += effect_text(e, linear);
  if (trace.unexplained)
    text += "\nunexplained\n  " + trace.unexplained->channel + ": " + trace.unexplained->signature + "\n";
  text += "\nmachine (load side of the reduction)\n";
  const char* machine = "  {:<24} {:<24} {:<24} {}\n";
  text += fmt::format(machine, "parameter", "without effects", "with effects", "unit");
  for (const auto& [name, value] : trace.parameters) {
    const auto before = trace.base_parameters.find(name);
    text += fmt::format(machine, name,
                        before == trace.base_parameters.end() ? "-" : signal::with_error(before->second),
                        signal::with_error(value), model::axis_unit(trace.units.at(name), linear));
  }
  return text + remarks(trace);
}

}  // namespace backlash::findings
