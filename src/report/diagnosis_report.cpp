// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/diagnosis_report.h"

#include <fmt/format.h>

#include <cmath>
#include <ostream>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "diagnosis_data.h"

namespace backlash::report {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

Json estimate_json(const diagnosis::Estimate& e) {
  Json json;
  json["method"] = e.method;
  json["status"] = diagnosis::to_string(e.status);
  json["backlash"] = json_number(e.backlash);
  json["backlash_angle"] = json_number(e.backlash_angle);
  json["interval"] = json_interval(e.lower, e.upper);
  json["interval_angle"] = json_interval(e.angle_lower, e.angle_upper);
  json["skewness"] = json_number(e.skewness);
  json["message"] = e.message;
  if (e.components) {
    Json& parts = json["components"];
    parts["gap"] = json_number(e.components->gap);
    parts["compliance"] = json_number(e.components->compliance);
    parts["coulomb"] = json_number(e.components->coulomb);
    parts["at_torque"] = json_number(e.components->at_torque);
  }
  return json;
}

Json methods_json(const std::vector<diagnosis::Estimate>& estimates, const std::vector<int>& chosen) {
  Json names = Json::array();
  for (const int i : chosen) names.push_back(estimates[i].method);
  return names;
}

Json coherence_json(const diagnosis::CoherenceDetection& d) {
  Json json;
  json["detector"] = "coherence";
  json["status"] = diagnosis::to_string(d.status);
  json["nonlinear"] = d.nonlinear ? Json(*d.nonlinear) : Json(nullptr);
  json["loss"] = json_number(d.loss);
  json["deviation"] = json_number(d.deviation);
  json["index"] = json_number(d.index);
  json["index_interval"] = json_interval(d.index_lower, d.index_upper);
  json["band"] = json_interval(d.lower, d.upper);
  json["message"] = d.message;
  return json;
}

Json verdict_json(const diagnosis::Verdict& verdict, const std::vector<diagnosis::Estimate>& estimates) {
  Json json;
  json["grade"] = diagnosis::to_string(verdict.grade);
  json["estimate"] = verdict.estimate < 0 ? Json(nullptr) : Json(verdict.estimate);
  json["agreement"] = verdict.agreement;
  json["members"] = methods_json(estimates, verdict.members);
  json["dissenters"] = methods_json(estimates, verdict.dissenters);
  json["backlash"] = json_number(verdict.backlash);
  json["interval"] = json_interval(verdict.lower, verdict.upper);
  json["backlash_angle"] = json_number(verdict.backlash_angle);
  json["angle_interval"] = json_interval(verdict.angle_lower, verdict.angle_upper);
  json["growth"] = json_number(verdict.growth);
  json["growth_interval"] = json_interval(verdict.growth_lower, verdict.growth_upper);
  json["message"] = verdict.message;
  return json;
}

Json contradicted_json(const std::vector<diagnosis::ContradictedValue>& contradicted) {
  Json list = Json::array();
  for (const diagnosis::ContradictedValue& v : contradicted)
    list.push_back({{"name", v.name},
                    {"declared", json_number(v.declared)},
                    {"found", json_number(v.found)},
                    {"standard_error", json_number(v.standard_error)},
                    {"unit", v.unit}});
  return list;
}

Json apd_json(const diagnosis::ApdResult& apd, const diagnosis::ApdSettings& settings) {
  Json json;
  json["signal"] = record::channel_name(settings.signal);
  json["classes"] = settings.layout.classes;
  json["lower"] = settings.layout.lower;
  json["upper"] = settings.layout.upper;
  json["percentages"] = apd.total.percentages();
  json["samples"] = apd.total.samples();
  json["below"] = apd.total.below();
  json["above"] = apd.total.above();
  json["periods"] = apd.periods.size();
  json["incomplete"] = apd.incomplete;
  json["settling_periods"] = settings.settling_periods;
  json["period"] = apd.period > 0 ? Json(apd.period) : Json(nullptr);
  json["skewness"] = json_number(apd.skewness);
  json["kurtosis"] = json_number(apd.total.kurtosis());
  json["noise"] = json_number(apd.noise);
  Json& each = json["skewness_of_periods"] = Json::array();
  for (const diagnosis::PeriodResult& period : apd.periods)
    each.push_back(json_number(period.apd.skewness()));
  return json;
}

Json curve_json(const diagnosis::MonitoringCurve& curve, const std::string& source) {
  const diagnosis::CurveConditions& c = curve.conditions;
  Json json;
  json["source"] = source;
  json["rig"] = c.rig;
  json["rig_digest"] = c.rig_digest;
  json["version"] = c.version;
  json["signal"] = c.signal;
  json["excitation"] = c.excitation;
  json["amplitude"] = c.amplitude;
  json["frequency"] = c.frequency;
  json["sampling_rate"] = c.sampling_rate;
  json["periods"] = c.periods;
  json["settling_periods"] = c.settling_periods;
  json["seeds"] = c.seeds;
  json["noise"] = c.noise;
  json["angular"] = c.angular;
  json["points"] = curve.points.size();
  json["largest_backlash"] = curve.points.back().backlash;
  return json;
}

/// Stamps of the first and the last sample: s since 1970, of a CSV as in its column.
Json time_json(const record::Record& record) {
  if (record.time.empty()) return nullptr;
  return Json::array({record.origin + record.time.front(), record.origin + record.time.back()});
}

std::string with_interval(double value, double lower, double upper, double unit) {
  std::string text = four_digits(value / unit);
  if (std::isfinite(lower) || std::isfinite(upper))
    text += " [" + four_digits(lower / unit) + ", " + four_digits(upper / unit) + "]";
  return text;
}

void print_estimate(const diagnosis::Estimate& e, std::ostream& out) {
  out << e.method << ": " << diagnosis::to_string(e.status) << '\n';
  if (std::isfinite(e.backlash) || std::isfinite(e.lower))
    out << "  backlash        " << with_interval(e.backlash, e.lower, e.upper, 1) << " m\n";
  if (std::isfinite(e.backlash_angle) || std::isfinite(e.angle_lower))
    out << "  backlash angle  " << with_interval(e.backlash_angle, e.angle_lower, e.angle_upper, 1)
        << " rad = " << with_interval(e.backlash_angle, e.angle_lower, e.angle_upper, kDegree) << " deg\n";
  if (std::isfinite(e.skewness)) out << "  skewness        " << four_digits(e.skewness) << '\n';
  if (e.components)
    out << "  gap " << four_digits(e.components->gap) << " rad = " << four_digits(e.components->gap / kDegree)
        << " deg, compliance " << four_digits(e.components->compliance) << " rad/(N m), Coulomb friction "
        << four_digits(e.components->coulomb) << " N m, at torque " << four_digits(e.components->at_torque)
        << " N m\n";
  if (!e.message.empty()) out << "  " << e.message << '\n';
}

}  // namespace

Json diagnosis_data(const DiagnosisReport& report) {
  Json json;
  json["schema_version"] = 1;
  json["record"] = report.record->name;
  json["time"] = time_json(*report.record);
  json["estimates"] = Json::array();
  for (const diagnosis::Estimate& e : report.diagnosis.estimates)
    json["estimates"].push_back(estimate_json(e));
  if (report.diagnosis.coherence)
    json["detectors"] = Json::array({coherence_json(*report.diagnosis.coherence)});
  json["verdict"] = verdict_json(report.diagnosis.verdict, report.diagnosis.estimates);
  json["declared_wrong"] = contradicted_json(report.diagnosis.verdict.declared_wrong);
  const bool has_apd = report.diagnosis.apd && report.apd_settings;
  json["apd"] = has_apd ? apd_json(*report.diagnosis.apd, *report.apd_settings) : Json(nullptr);
  json["warnings"] = report.warnings;
  json["rig"] = report.rig.empty() ? Json(nullptr) : Json(report.rig);
  json["rig_digest"] = report.rig_digest.empty() ? Json(nullptr) : Json(report.rig_digest);
  json["curve"] = report.curve ? curve_json(*report.curve, report.curve_source) : Json(nullptr);
  json["version"] = version();
  return json;
}

std::string diagnosis_json(const DiagnosisReport& report) {
  return dumped(diagnosis_data(report), 2);
}

const diagnosis::WaveformEvidence* waveform_evidence(const diagnosis::Diagnosis& diagnosis) {
  for (const diagnosis::Estimate& e : diagnosis.estimates)
    if (e.waveform) return e.waveform.get();
  return nullptr;
}

std::string four_digits(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "?";
}

void print_summary(const DiagnosisReport& report, std::ostream& out) {
  const record::Record& record = *report.record;
  const double interval = record.sampling_interval();
  out << record.name << ": " << record.size() << " samples, "
      << four_digits(record.time.back() - record.time.front()) << " s";
  if (interval > 0) out << ", " << four_digits(1 / interval) << " Hz";
  out << '\n';
  for (const std::string& warning : report.warnings) out << "warning: " << warning << '\n';
  for (const diagnosis::Estimate& e : report.diagnosis.estimates) print_estimate(e, out);
  out << "verdict: " << report.diagnosis.verdict.message << '\n';
}

}  // namespace backlash::report
