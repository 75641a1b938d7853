// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/findings/identification_report.h"

#include <fmt/format.h>

#include <cmath>
#include <ostream>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "report/json.h"
#include "several_json.h"

namespace backlash::findings {
namespace {

constexpr std::size_t kMostPoints = 3000;  // of a trace, which a plot shows
constexpr double kZoom = 2;                // s, at full resolution

report::Json line_json(const identification::FrictionLine& line) {
  return {{"coulomb", report::measured(line.coulomb)},
          {"viscous", report::measured(line.viscous)},
          {"speed", line.speed},
          {"torque", line.torque},
          {"residual", line.residual},
          {"rms", line.rms},
          {"quadratic_t", line.quadratic_t}};
}

report::Json split_json(const identification::StiffnessSplit& s) {
  return {{"motor_inertia", report::measured(s.motor_inertia)},
          {"load_inertia", report::measured(s.load_inertia)},
          {"reduced_inertia", report::measured(s.reduced_inertia)},
          {"stiffness_anti_resonance", report::measured(s.stiffness_anti_resonance)},
          {"stiffness_resonance", report::measured(s.stiffness_resonance)},
          {"resonance", report::measured(s.resonance)},
          {"anti_resonance", report::measured(s.anti_resonance)}};
}

report::Json response_json(const identification::ResponseDetail& d) {
  report::Json json = {{"held", d.held},
                       {"resonance", report::measured(d.resonances.resonance)},
                       {"anti_resonance", report::measured(d.resonances.anti_resonance)},
                       {"total_inertia", report::measured(d.plateaus.total)},
                       {"motor_inertia", report::measured(d.plateaus.motor)}};
  for (const auto& [letter, split] : d.alternatives) json["alternatives"][letter] = split_json(split);
  json["fit"] = {{"motor_inertia", report::measured(d.fit.motor_inertia)},
                 {"load_inertia", report::measured(d.fit.load_inertia)},
                 {"stiffness", report::measured(d.fit.stiffness)},
                 {"damping", report::measured(d.fit.damping)},
                 {"damping_ratio", report::measured(d.fit.damping_ratio)},
                 {"resonance", report::measured(d.fit.resonance)},
                 {"anti_resonance", report::measured(d.fit.anti_resonance)},
                 {"delay", report::measured(d.fit.delay)}};
  const identification::TwoMass model = d.fit.model();
  for (const identification::ResponsePoint& p : d.response.points) {
    const std::complex<double> fitted = model.motor_response(p.frequency);
    json["points"].push_back({p.frequency, std::abs(p.response), std::arg(p.response), p.coherence,
                              std::abs(fitted), std::arg(fitted)});
  }
  json["point_columns"] = {"frequency", "magnitude",        "phase",
                           "coherence", "fitted_magnitude", "fitted_phase"};
  return json;
}

report::Json decay_json(const identification::DecayIdentification& d) {
  report::Json json = {{"damping", report::measured(d.damping)},
                       {"damping_by_rate", report::measured(d.damping_by_rate)},
                       {"damping_ratio", report::measured(d.damping_ratio)},
                       {"peak_damping_ratio", report::measured(d.peak_damping_ratio)},
                       {"natural_frequency", report::measured(d.natural_frequency)},
                       {"engagements", d.ringings.size()}};
  for (std::size_t i = 0; i < std::min<std::size_t>(4, d.ringings.size()); ++i) {
    const identification::Ringing& r = d.ringings[i];
    json["ringings"].push_back({{"time", r.time}, {"measured", r.measured}, {"fitted", r.fitted}});
  }
  return json;
}

report::Json clearance_json(const identification::Clearance& c) {
  report::Json json = {{"gap", report::measured(c.gap)}, {"travel", report::measured(c.travel)}};
  for (std::size_t i = 0; i < std::min<std::size_t>(4, c.passages.size()); ++i) {
    const identification::GapPassage& p = c.passages[i];
    json["passages"].push_back({{"time", p.time},
                                {"measured", p.measured},
                                {"fitted", p.fitted},
                                {"lower", p.lower},
                                {"upper", p.upper}});
  }
  return json;
}

report::Json gap_map_json(const identification::GapMap& map) {
  report::Json json = {{"mean_gap", report::measured(map.mean_gap)},
                       {"mean_separation", report::measured(map.mean_separation)},
                       {"wind_up", report::measured(map.wind_up)},
                       {"varies", map.varies},
                       {"confidence", report::json_number(map.confidence)},
                       {"statement", map.statement}};
  for (const identification::Harmonic& h : map.harmonics)
    json["harmonics"].push_back({{"order", h.order},
                                 {"amplitude", report::measured(h.amplitude)},
                                 {"phase", report::measured(h.phase)}});
  for (const identification::GapBin& bin : map.bins)
    json["bins"].push_back({bin.position, bin.separation.value,
                            report::json_number(bin.separation.standard_error), bin.centre.value});
  json["bin_columns"] = {"position", "separation", "standard_error", "centre"};
  return json;
}

/// Thinned over the whole record, and two seconds of its middle at full resolution.
report::Json trace_json(const identification::ChannelTrace& trace) {
  const std::size_t n = trace.measured.size(), stride = n / kMostPoints + 1;
  const auto part = [&](std::size_t from, std::size_t to, std::size_t step) {
    report::Json json = {{"start", double(from) * trace.interval},
                         {"interval", double(step) * trace.interval}};
    for (std::size_t k = from; k < to; k += step) {
      const bool counts = trace.counts.empty() || trace.counts[k];  // else a gap in the plot
      json["measured"].push_back(counts ? report::Json(trace.measured[k]) : report::Json(nullptr));
      json["predicted"].push_back(counts ? report::Json(trace.predicted[k]) : report::Json(nullptr));
    }
    return json;
  };
  const std::size_t zoom = std::min(n, static_cast<std::size_t>(kZoom / trace.interval)),
                    from = (n - zoom) / 2;
  return {{"record", trace.record}, {"whole", part(0, n, stride)}, {"zoom", part(from, from + zoom, 1)}};
}

report::Json details_json(const identification::Identification& found) {
  report::Json json = report::Json::object();
  for (const identification::FrictionDetail& d : found.friction)
    for (const identification::FrictionLine& line : d.lines)
      json["friction_lines"][d.subject].push_back(line_json(line));
  for (const identification::InertiaDetail& d : found.inertia) {
    json["line_inertia"][d.subject] = report::measured(d.combined);
    for (const identification::LineInertia& run : d.runs)
      json["line_inertia"][d.subject]["runs"].push_back({{"frequency", run.frequency},
                                                         {"torque", run.torque},
                                                         {"speed", run.speed},
                                                         {"inertia", report::measured(run.inertia)}});
  }
  if (found.response) json["frequency_response"] = response_json(*found.response);
  if (found.decay) json["decay"] = decay_json(*found.decay);
  if (found.clearance) json["clearance"] = clearance_json(*found.clearance);
  if (found.gap_map) json["gap_map"] = gap_map_json(*found.gap_map);
  for (const identification::ChannelTrace& trace : found.torque) json["torque"].push_back(trace_json(trace));
  for (const identification::ChannelTrace& trace : found.deflection)
    json["deflection"].push_back(trace_json(trace));
  return json;
}

}  // namespace

std::string identification_json(const identification::Identification& found, const std::string& rig,
                                const std::vector<std::string>& records) {
  report::Json json = {{"schema_version", 1},
                       {"version", version()},
                       {"procedures", report::Json::array()},
                       {"parameters", report::Json::object()},
                       {"channels", report::Json::object()},
                       {"warnings", found.warnings}};
  for (const identification::ProcedureReport& p : found.procedures)
    json["procedures"].push_back(
        {{"name", p.name}, {"used", !p.records.empty()}, {"records", p.records}, {"message", p.message}});
  for (const auto& [name, m] : found.parameters)
    json["parameters"][name] = {{"value", report::json_number(m.value)},
                                {"unit", found.units.at(name)},
                                {"standard_error", report::json_number(m.standard_error)}};
  for (const auto& [name, channel] : found.channels)
    json["channels"][name] = {{"train", report::json_number(channel.error)},
                              {"floor", report::json_number(channel.floor)}};
  json["several_machines"] = several_json(found.several, found.units, false);  // units are those of the axis
  if (found.delay)
    json["torque_delay"] = {{"value", report::json_number(found.delay->value)},
                            {"unit", "s"},
                            {"standard_error", report::json_number(found.delay->standard_error)}};
  for (const identification::Finding& f : found.findings) {
    report::Json entry = {{"procedure", f.procedure}, {"combination", report::Json::object()}};
    for (const auto& [name, factor] : f.combination) entry["combination"][name] = factor;
    entry.update(report::measured(f.measured));
    json["findings"].push_back(std::move(entry));
  }
  if (found.commissioning) {
    json["common_scale"] = {{"uncertainty", found.commissioning->machine.common_scale}};
    json["not_told"] = found.commissioning->undetermined;
    for (std::size_t i = 0; i < found.commissioning->states.size(); ++i) {
      const auto& state = found.commissioning->states[i];
      const double half = 2 * state.log_error;
      json["backlash"].push_back(
          {{"record", found.procedures.front().records.at(i)},
           {"backlash", state.backlash},
           {"interval", {state.backlash * std::exp(-half), state.backlash * std::exp(half)}},
           {"reversals", state.windows - state.left_out}});
    }
  }
  json["details"] = details_json(found);
  json["rig"] = rig;
  json["records"] = records;
  return report::dumped(json, 1);
}

void print_summary(const identification::Identification& found, std::ostream& out) {
  out << "procedures\n";
  for (const identification::ProcedureReport& p : found.procedures)
    out << fmt::format("  {:<20}{}{}\n", p.name, p.records.empty() ? "not used: " : "", p.message);
  out << "\nparameters (load side of the reduction)\n";
  for (const auto& [name, m] : found.parameters)
    out << (std::isinf(m.standard_error) ? fmt::format("  {:<26} not determined by these records\n", name)
                                         : fmt::format("  {:<26} {:12.6g}  +- {:<9.2g} {}\n", name, m.value,
                                                       m.standard_error, found.units.at(name)));
  out << "\nrelative error of the fitted model (what noise alone would leave)\n";
  for (const auto& [name, channel] : found.channels)
    out << (std::isfinite(channel.error) ? fmt::format("  {:<26} {:.3g} % ({:.3g} %)\n", name,
                                                       100 * channel.error, 100 * channel.floor)
                                         : fmt::format("  {:<26} does not vary\n", name));
  for (const std::string& warning : found.warnings) out << "warning: " << warning << '\n';
}

}  // namespace backlash::findings
