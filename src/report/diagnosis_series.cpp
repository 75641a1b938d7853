// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/diagnosis_series.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "backlash_diagnosis/model/axis_unit.h"
#include "diagnosis_data.h"

namespace backlash::report {
namespace {

constexpr int kPeriods = 3;
constexpr std::size_t kMostSamples = 20'000;  // of a plot

Json column(const std::vector<double>& values, std::size_t stride) {
  Json json = Json::array();
  for (std::size_t k = 0; k < values.size(); k += stride) json.push_back(json_number(values[k]));
  return json;
}

/// Of the excitation; 0 where it does not repeat.
double period_of(const DiagnosisReport& report) {
  if (report.diagnosis.apd && report.diagnosis.apd->period > 0) return report.diagnosis.apd->period;
  return diagnosis::excitation_period(*report.record, record::Channel::motor_torque);
}

Json record_json(const record::Record& record, double period, bool linear) {
  const double end = record.time.back(), from = period > 0 ? end - kPeriods * period : record.time.front();
  const record::Record part = record.slice(from, std::nextafter(end, end + 1));
  const std::size_t stride = part.size() / kMostSamples + 1;
  Json json = {{"period", period > 0 ? Json(period) : Json(nullptr)}, {"time", column(part.time, stride)}};
  json["channels"] = Json::object();
  for (const record::Channel channel : record::kChannels)
    if (part.has(channel))
      json["channels"][record::channel_name(channel)] = {
          {"unit", model::axis_unit(record::channel_unit(channel), linear)},
          {"values", column(part.column(channel), stride)}};
  return json;
}

/// The curve at its declared noise, with the 95 % scatter of a single period.
Json curve_json(const diagnosis::MonitoringCurve& curve) {
  Json json = {{"angular", curve.conditions.angular},
               {"backlash_to_angle", json_number(curve.backlash_to_angle)}};
  for (const diagnosis::CurvePoint& point : curve.points) {
    const diagnosis::SkewnessCell& cell = curve.nominal(point);
    json["backlash"].push_back(point.backlash);
    json["skewness"].push_back(json_number(cell.mean));
    json["scatter"].push_back(
        json_number(curve.coverage_factor * diagnosis::MonitoringCurve::deviation(cell, 1)));
  }
  return json;
}

/// Null where there are none, or where they hold for the growth.
Json limits_json(const DiagnosisReport& report) {
  if (!report.limits || std::isfinite(report.diagnosis.verdict.growth)) return nullptr;
  const diagnosis::Limits& limits = *report.limits;
  return {{"angular", limits.angular},
          {"watch", limits.watch},
          {"service", limits.service},
          {"stop", limits.stop}};
}

Json trace_json(const diagnosis::WaveformEvidence::Trace& trace) {
  if (trace.measured.empty()) return nullptr;
  return {{"measured", column(trace.measured, 1)}, {"model", column(trace.model, 1)}};
}

/// The first window of the fit, that with the median misfit and that with the largest; in order of time.
std::vector<std::size_t> shown_windows(const diagnosis::WaveformEvidence& evidence) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < evidence.windows.size(); ++i) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return evidence.windows[a].misfit < evidence.windows[b].misfit;
  });
  const std::set<std::size_t> chosen = {0, order[(order.size() - 1) / 2], order.back()};
  return {chosen.begin(), chosen.end()};
}

/// Null where no machine was fitted.
Json waveform_json(const DiagnosisReport& report) {
  const diagnosis::WaveformEvidence* evidence = waveform_evidence(report.diagnosis);
  if (!evidence || evidence->windows.empty()) return nullptr;
  Json json = {{"interval", evidence->interval},
               {"torque_noise", json_number(evidence->torque_noise)},
               {"position_noise", json_number(evidence->position_noise)},
               {"fitted", evidence->windows.size()},
               {"left_out", evidence->left_out},
               {"windows", Json::array()}};
  for (const std::size_t i : shown_windows(*evidence)) {
    const diagnosis::WaveformEvidence::Window& window = evidence->windows[i];
    json["windows"].push_back({{"start", window.start},
                               {"times", column(window.times, 1)},
                               {"misfit", json_number(window.misfit)},
                               {"torque", trace_json(window.torque)},
                               {"position", trace_json(window.position)}});
  }
  return json;
}

}  // namespace

std::string diagnosis_series(const DiagnosisReport& report, const rig_file::RigFile* rig) {
  const bool linear = rig && rig->rig.linear;
  const bool locked = rig ? rig->rig.link_locked : report.curve && report.curve->conditions.output_locked;
  const Json json = {{"schema_version", 1},
                     {"report", diagnosis_data(report)},
                     {"linear", linear},
                     {"locked", locked},
                     {"rigid", rig && rig->rig.mesh.rigid},
                     {"record", record_json(*report.record, period_of(report), linear)},
                     {"curve", report.curve ? curve_json(*report.curve) : Json(nullptr)},
                     {"limits", limits_json(report)},
                     {"waveform", waveform_json(report)}};
  return dumped(json, -1);
}

}  // namespace backlash::report
