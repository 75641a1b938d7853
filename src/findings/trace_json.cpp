// SPDX-License-Identifier: BSD-3-Clause
// The JSON part of trace_report.h.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/findings/trace_report.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "report/json.h"
#include "several_json.h"
#include "trace_contributions.h"

namespace backlash::findings {
namespace {

constexpr double kPerCycle = 4;               // samples of a plot per cycle of the low-pass
constexpr std::size_t kMostSamples = 20'000;  // of a plot

report::Json with_unit(const signal::Measured& m, const std::string& unit) {
  return {{"value", report::json_number(m.value)},
          {"unit", unit},
          {"standard_error", report::json_number(m.standard_error)}};
}

report::Json machine_json(const std::map<std::string, signal::Measured>& parameters,
                          const identification::Trace& trace) {
  report::Json json = report::Json::object();
  for (const auto& [name, m] : parameters)
    json[name] = with_unit(m, model::axis_unit(trace.units.at(name), trace.augmented.linear));
  return json;
}

/// What belongs to the sensors and not to the machine.
std::map<std::string, signal::Measured> calibrations(const identification::Trace& trace) {
  std::map<std::string, signal::Measured> of_sensors;
  for (const auto& [name, m] : trace.parameters)
    if (rig_file::servo_parameter(name).part == rig_file::RigPart::sensors) of_sensors[name] = m;
  return of_sensors;
}

/// All values of a term, as the rig file has them.
report::Json term_json(const model::Term& term) {
  report::Json json = {{"id", term.id}};
  for (const ParameterSpec& spec : model::term_type(term.id).parameters) {
    if (!spec.choices.empty())
      json[spec.name] = term.values.choice(spec.name);
    else if (spec.list)
      json[spec.name] = term.values.list(spec.name);
    else
      json[spec.name] = report::json_number(term.values.at(spec.name));
  }
  return json;
}

report::Json step_json(const identification::FoundEffect& e, const identification::Trace& trace) {
  report::Json json = {{"effect", e.id}, {"channel", e.channel}, {"parameters", report::Json::object()}};
  for (const identification::EffectParameter& p : e.parameters)
    json["parameters"][p.name] = with_unit(p.measured, model::axis_unit(p.unit, trace.augmented.linear));
  json["test_error_before"] = report::json_number(e.test_error_before);
  json["test_error_after"] = report::json_number(e.test_error_after);
  json["test_gain"] = {{"value", report::json_number(e.test_gain.value)},
                       {"interval", report::json_interval(e.test_gain.lower, e.test_gain.upper)}};
  const identification::Evidence& v = e.evidence;
  json["evidence"] = {{"gain", report::json_number(v.gain)},
                      {"gain_held_out", report::json_number(v.gain_held_out)}};
  json["equivalent_to"] = e.equivalent_to;
  if (!e.nearest.empty()) json["nearest"] = e.nearest;
  json["choices"] = report::Json::object();
  for (const auto& [name, word] : e.words) json["choices"][name] = word;
  json["terms"] = report::Json::array();
  for (const std::size_t place : e.terms)
    json["terms"].push_back(term_json(*trace.augmented.terms.at(place)));
  return json;
}

/// Every `stride`-th value with seven digits, as many as a plot can show.
report::Json column(const std::vector<double>& values, std::size_t stride,
                    const std::vector<char>* counts = nullptr) {
  report::Json json = report::Json::array();
  for (std::size_t k = 0; k < values.size(); k += stride) {
    const std::string text = fmt::format("{:.7g}", values[k]);
    json.push_back(counts && !(*counts)[k] ? report::Json(nullptr)
                                           : report::json_number(std::strtod(text.c_str(), nullptr)));
  }
  return json;
}

std::size_t stride_of(const identification::TraceSeries& s, double cutoff) {
  if (s.time.size() < 2) return 1;
  const double interval = (s.time.back() - s.time.front()) / double(s.time.size() - 1);
  const double enough = 1 / (kPerCycle * cutoff * interval);
  return std::max({std::size_t{1}, std::size_t(enough), s.time.size() / kMostSamples + 1});
}

report::Json channel_series(const std::string& unit, const std::vector<double>& recorded,
                            const std::vector<double>& before, const std::vector<double>& after,
                            const std::vector<char>& counts, std::size_t stride) {
  return {{"unit", unit},
          {"measured", column(recorded, stride)},
          {"before", column(before, stride, &counts)},
          {"after", column(after, stride, &counts)}};
}

}  // namespace

std::string trace_report_json(const identification::Trace& trace, const TraceInputs& inputs) {
  report::Json json = {{"schema_version", 1},
                       {"version", version()},
                       {"verdict", to_string(trace.verdict)},
                       {"message", verdict_sentence(trace)},
                       {"rig", inputs.rig},
                       {"train", inputs.train},
                       {"test", inputs.test},
                       {"cutoff", {{"value", report::json_number(trace.cutoff)}, {"unit", "Hz"}}},
                       {"channels", report::Json::object()},
                       {"steps", report::Json::array()},
                       {"rejected", report::Json::array()},
                       {"unexplained", nullptr}};
  for (const auto& [name, c] : trace.channels)
    json["channels"][name] = {
        {"before", report::json_number(c.before)},
        {"after", report::json_number(c.after)},
        {"floor", report::json_number(c.floor)},
        {"repeats", c.repeats},
        {"train_before", report::json_number(c.train_before)},
        {"train_after", report::json_number(c.train_after)},
        {"explainable", report::json_number(c.explainable.value)},
        {"explainable_interval", report::json_interval(c.explainable.lower, c.explainable.upper)}};
  for (const identification::FoundEffect& e : trace.steps) json["steps"].push_back(step_json(e, trace));
  for (const identification::RejectedEffect& r : trace.rejected)
    json["rejected"].push_back({{"effect", r.id}, {"reason", r.reason}});
  if (trace.unexplained)
    json["unexplained"] = {{"channel", trace.unexplained->channel},
                           {"signature", trace.unexplained->signature},
                           {"explainable", report::json_number(trace.unexplained->explainable.value)}};
  json["several_machines"] = several_json(trace.several, trace.units, trace.augmented.linear);
  json["independence"] = report::Json::array();
  for (const identification::Independence& i : trace.independence)
    json["independence"].push_back({{"channel", i.channel},
                                    {"input", i.input},
                                    {"before", report::json_number(i.before)},
                                    {"after", report::json_number(i.after)}});
  json["calibrations"] = machine_json(calibrations(trace), trace);
  json["base_parameters"] = machine_json(trace.base_parameters, trace);
  json["parameters"] = machine_json(trace.parameters, trace);
  json["notes"] = trace.notes;
  json["warnings"] = trace.warnings;
  return report::dumped(json, 1);
}

std::string trace_series_json(const identification::Trace& trace) {
  const identification::TraceSeries& s = trace.series;
  const bool linear = trace.augmented.linear;
  const std::string angle = model::axis_unit("rad", linear), torque = model::axis_unit("N m", linear);
  const std::size_t stride = stride_of(s, trace.cutoff);
  report::Json json = {{"schema_version", 1}, {"linear", linear}, {"coordinates", report::Json::object()}};
  const auto coordinate = [&](const char* name, const std::string& unit, const std::vector<double>& values) {
    if (!values.empty()) json["coordinates"][name] = {{"unit", unit}, {"values", column(values, stride)}};
  };
  coordinate("time", "s", s.time);
  coordinate("motor_position", angle, s.motor_position);
  coordinate("motor_velocity", angle + "/s", s.motor_velocity);
  coordinate("motor_torque", torque, s.motor_torque);
  coordinate("load_position", angle, s.load_position);
  coordinate("load_velocity", angle + "/s", s.load_velocity);
  coordinate("mesh_torque", torque, s.mesh_torque);
  json["channels"] = report::Json::object();
  if (!s.torque.empty())
    json["channels"]["torque"] =
        channel_series(torque, s.torque, s.torque_before, s.torque_after, s.torque_counts, stride);
  if (!s.deflection.empty())
    json["channels"]["deflection"] = channel_series(angle, s.deflection, s.deflection_before,
                                                    s.deflection_after, s.deflection_counts, stride);
  json["steps"] = report::Json::array();
  for (const identification::FoundEffect& e : trace.steps) {
    report::Json step = {{"effect", e.id}, {"contributions", report::Json::array()}};
    for (const Contribution& c : contributions(trace.augmented, e.terms, s))
      step["contributions"].push_back(
          {{"quantity", c.quantity}, {"unit", c.unit}, {"values", column(c.values, stride)}});
    json["steps"].push_back(std::move(step));
  }
  return report::dumped(json, -1);
}

}  // namespace backlash::findings
