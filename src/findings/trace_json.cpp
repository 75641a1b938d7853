// SPDX-License-Identifier: BSD-3-Clause
// The JSON part of trace_report.h.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/findings/trace_report.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "report/json.h"
#include "trace_contributions.h"

namespace backlash {
namespace {

constexpr double kPerCycle = 4;               // samples of a plot per cycle of the low-pass
constexpr std::size_t kMostSamples = 20'000;  // of a plot

Json with_unit(const Measured& m, const std::string& unit) {
  return {{"value", json_number(m.value)}, {"unit", unit}, {"standard_error", json_number(m.standard_error)}};
}

Json machine_json(const std::map<std::string, Measured>& parameters, const Trace& trace) {
  Json json = Json::object();
  for (const auto& [name, m] : parameters)
    json[name] = with_unit(m, axis_unit(trace.units.at(name), trace.augmented.linear));
  return json;
}

/// All values of a term, as the rig file has them.
Json term_json(const Term& term) {
  Json json = {{"id", term.id}};
  for (const ParameterSpec& spec : term_type(term.id).parameters) {
    if (!spec.choices.empty())
      json[spec.name] = term.values.choice(spec.name);
    else if (spec.list)
      json[spec.name] = term.values.list(spec.name);
    else
      json[spec.name] = json_number(term.values.at(spec.name));
  }
  return json;
}

Json step_json(const FoundEffect& e, const Trace& trace) {
  Json json = {{"effect", e.id}, {"channel", e.channel}, {"parameters", Json::object()}};
  for (const EffectParameter& p : e.parameters)
    json["parameters"][p.name] = with_unit(p.measured, axis_unit(p.unit, trace.augmented.linear));
  json["test_error_before"] = json_number(e.test_error_before);
  json["test_error_after"] = json_number(e.test_error_after);
  const Evidence& v = e.evidence;
  json["evidence"] = {{"gain", json_number(v.gain)},
                      {"gain_held_out", json_number(v.gain_held_out)},
                      {"gain_forward", json_number(v.gain_forward)},
                      {"blocks_better", v.blocks_better},
                      {"blocks", v.blocks}};
  json["equivalent_to"] = e.equivalent_to;
  if (!e.nearest.empty()) json["nearest"] = e.nearest;
  json["choices"] = Json::object();
  for (const auto& [name, word] : e.words) json["choices"][name] = word;
  json["terms"] = Json::array();
  for (const std::size_t place : e.terms)
    json["terms"].push_back(term_json(*trace.augmented.terms.at(place)));
  return json;
}

/// Every `stride`-th value with seven digits, as many as a plot can show.
Json column(const std::vector<double>& values, std::size_t stride,
            const std::vector<char>* counts = nullptr) {
  Json json = Json::array();
  for (std::size_t k = 0; k < values.size(); k += stride) {
    const std::string text = fmt::format("{:.7g}", values[k]);
    json.push_back(counts && !(*counts)[k] ? Json(nullptr) : json_number(std::strtod(text.c_str(), nullptr)));
  }
  return json;
}

std::size_t stride_of(const TraceSeries& s, double cutoff) {
  if (s.time.size() < 2) return 1;
  const double interval = (s.time.back() - s.time.front()) / double(s.time.size() - 1);
  const double enough = 1 / (kPerCycle * cutoff * interval);
  return std::max({std::size_t{1}, std::size_t(enough), s.time.size() / kMostSamples + 1});
}

Json channel_series(const std::string& unit, const std::vector<double>& recorded,
                    const std::vector<double>& before, const std::vector<double>& after,
                    const std::vector<char>& counts, std::size_t stride) {
  return {{"unit", unit},
          {"measured", column(recorded, stride)},
          {"before", column(before, stride, &counts)},
          {"after", column(after, stride, &counts)}};
}

}  // namespace

std::string trace_report_json(const Trace& trace, const TraceInputs& inputs) {
  Json json = {{"schema_version", 1},
               {"version", version()},
               {"verdict", to_string(trace.verdict)},
               {"message", verdict_sentence(trace)},
               {"rig", inputs.rig},
               {"train", inputs.train},
               {"test", inputs.test},
               {"cutoff", {{"value", json_number(trace.cutoff)}, {"unit", "Hz"}}},
               {"channels", Json::object()},
               {"steps", Json::array()},
               {"rejected", Json::array()},
               {"unexplained", nullptr}};
  for (const auto& [name, c] : trace.channels)
    json["channels"][name] = {{"before", json_number(c.before)},
                              {"after", json_number(c.after)},
                              {"floor", json_number(c.floor)},
                              {"train_before", json_number(c.train_before)},
                              {"train_after", json_number(c.train_after)}};
  for (const FoundEffect& e : trace.steps) json["steps"].push_back(step_json(e, trace));
  for (const RejectedEffect& r : trace.rejected)
    json["rejected"].push_back({{"effect", r.id}, {"reason", r.reason}});
  if (trace.unexplained)
    json["unexplained"] = {{"channel", trace.unexplained->channel},
                           {"signature", trace.unexplained->signature}};
  json["independence"] = Json::array();
  for (const Independence& i : trace.independence)
    json["independence"].push_back({{"channel", i.channel},
                                    {"input", i.input},
                                    {"before", json_number(i.before)},
                                    {"after", json_number(i.after)}});
  json["base_parameters"] = machine_json(trace.base_parameters, trace);
  json["parameters"] = machine_json(trace.parameters, trace);
  json["notes"] = trace.notes;
  json["warnings"] = trace.warnings;
  return dumped(json, 1);
}

std::string trace_series_json(const Trace& trace) {
  const TraceSeries& s = trace.series;
  const bool linear = trace.augmented.linear;
  const std::string angle = axis_unit("rad", linear), torque = axis_unit("N m", linear);
  const std::size_t stride = stride_of(s, trace.cutoff);
  Json json = {{"schema_version", 1}, {"linear", linear}, {"coordinates", Json::object()}};
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
  json["channels"] = Json::object();
  if (!s.torque.empty())
    json["channels"]["torque"] =
        channel_series(torque, s.torque, s.torque_before, s.torque_after, s.torque_counts, stride);
  if (!s.deflection.empty())
    json["channels"]["deflection"] = channel_series(angle, s.deflection, s.deflection_before,
                                                    s.deflection_after, s.deflection_counts, stride);
  json["steps"] = Json::array();
  for (const FoundEffect& e : trace.steps) {
    Json step = {{"effect", e.id}, {"contributions", Json::array()}};
    for (const Contribution& c : contributions(trace.augmented, e.terms, s))
      step["contributions"].push_back(
          {{"quantity", c.quantity}, {"unit", c.unit}, {"values", column(c.values, stride)}});
    json["steps"].push_back(std::move(step));
  }
  return dumped(json, -1);
}

}  // namespace backlash
