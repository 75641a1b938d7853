// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/diagnosis_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/diagnosis_series.h"
#include "backlash_diagnosis/rig_file/declared_values.h"
#include "diagnosis_data.h"
#include "html_template.h"

namespace backlash::report {
namespace {

constexpr double kMicrometre = 1e-6, kMilliradian = 1e-3;
constexpr double kMostLeft = 0.9;  // of the spread known before, above which a record adds nothing: choice

/// "80.0" and "[78.2, 81.9]"; an end that is not known is "?". Both empty where nothing is known.
Json cell(double value, double lower, double upper, double unit) {
  const bool open = !std::isfinite(lower) && !std::isfinite(upper);
  if (open && !std::isfinite(value)) return {{"value", ""}, {"interval", ""}};
  return {{"value", four_digits(value / unit)},
          {"interval",
           open ? "" : fmt::format("[{}, {}]", four_digits(lower / unit), four_digits(upper / unit))}};
}

/// What all plays of a page are in: a length along the line of action (on a linear axis, of it), or an angle
/// of the axis of motor_position where the rig gives no base radius.
struct PageUnit {
  bool linear = false, angle = false;

  double scale() const { return angle ? kMilliradian : kMicrometre; }
  const char* name() const { return angle ? "mrad" : "\u00b5m"; }
};

PageUnit unit_of(const diagnosis::Diagnosis& diagnosis, bool linear) {
  const auto length = [](const auto& a) { return std::isfinite(a.backlash) || std::isfinite(a.upper); };
  bool any = length(diagnosis.verdict);
  for (const diagnosis::Estimate& e : diagnosis.estimates) any = any || length(e);
  return {linear, !linear && !any};
}

/// Of one estimate or of all together.
template <typename Answer>
Json play(const Answer& a, const PageUnit& unit) {
  return unit.linear || unit.angle ? cell(a.backlash_angle, a.angle_lower, a.angle_upper, unit.scale())
                                   : cell(a.backlash, a.lower, a.upper, unit.scale());
}

/// In the unit of the page, where the estimate relates angles to lengths.
std::string parts_text(const diagnosis::PlayComponents& parts, const diagnosis::Estimate& of,
                       const PageUnit& unit) {
  const double length = unit.linear || unit.angle ? 1 : of.backlash / of.backlash_angle;  // per rad
  const bool known_length = std::isfinite(length);
  const double scale = known_length ? length / unit.scale() : 1 / kMilliradian;
  const std::string name = known_length ? unit.name() : "mrad";
  std::vector<std::string> known;
  const auto add = [&known](const char* what, double value, const std::string& in) {
    if (std::isfinite(value)) known.push_back(std::string(what) + " " + four_digits(value) + " " + in);
  };
  const std::string torque = unit.linear ? "N" : "N m";
  add("gap", scale * parts.gap, name);
  add("compliance", scale * parts.compliance, name + (unit.linear ? "/N" : "/(N m)"));
  add("Coulomb friction", parts.coulomb, torque);
  add("at torque", parts.at_torque, torque);
  return joined(known);
}

/// "Good: 79.98 um of backlash, 95 % interval 77.93 to 82.17 um."; empty where that is not known.
std::string headline(const diagnosis::Verdict& v, const PageUnit& unit) {
  const bool angle = unit.linear || unit.angle;
  const double value = angle ? v.backlash_angle : v.backlash;
  if (!std::isfinite(value)) return "";
  const double lower = angle ? v.angle_lower : v.lower, upper = angle ? v.angle_upper : v.upper;
  std::string grade;
  if (v.grade != diagnosis::Grade::ungraded) {
    grade = std::string(diagnosis::to_string(v.grade)) + ": ";
    grade[0] = char(std::toupper(grade[0]));
  }
  return fmt::format("{}{} {unit} of backlash, 95 % interval {} to {} {unit}{}.", grade,
                     four_digits(value / unit.scale()), four_digits(lower / unit.scale()),
                     four_digits(upper / unit.scale()), grade.empty() ? "; no limits are stated" : "",
                     fmt::arg("unit", unit.name()));
}

/// What the methods that looked at the record saw, if it shows no play; what the others lack stands in the
/// table.
Json why_not(const diagnosis::Diagnosis& diagnosis) {
  Json reasons = Json::array();
  for (const diagnosis::Estimate& e : diagnosis.estimates)
    if (e.status != diagnosis::Status::insufficient_data) reasons.push_back(e.method + ": " + e.message);
  if (reasons.empty())
    reasons.push_back("no method can use this record; what each of them lacks stands below");
  return reasons;
}

/// What the headline does not say: by which methods, and what contradicts them.
std::string beside_headline(const std::string& message) {
  const std::size_t by = message.find(" by ");
  return by == std::string::npos ? message : "B" + message.substr(by + 2);
}

/// "insufficient data"
std::string in_words(std::string id) {
  std::replace(id.begin(), id.end(), '_', ' ');
  return id;
}

Json estimates(const diagnosis::Diagnosis& diagnosis, const PageUnit& unit) {
  Json rows = Json::array();
  for (const diagnosis::Estimate& e : diagnosis.estimates) {
    std::string how = e.message;
    if (std::isfinite(e.skewness) && e.message.find("skewness") == std::string::npos)
      how = "skewness " + four_digits(e.skewness) + (how.empty() ? "" : "; ") + how;
    rows.push_back({{"method", e.method},
                    {"status", in_words(diagnosis::to_string(e.status))},
                    {"together", false},
                    {"play", play(e, unit)},
                    {"how", how},
                    {"parts", e.components ? parts_text(*e.components, e, unit) : ""}});
  }
  const diagnosis::Verdict& v = diagnosis.verdict;
  if (!v.members.empty())
    rows.push_back({{"method", "together"},
                    {"status", in_words(diagnosis::to_string(v.grade))},
                    {"together", true},
                    {"play", play(v, unit)},
                    {"how", v.agreement == "agree"    ? "the methods agree"
                            : v.agreement == "single" ? "one method answers"
                                                      : v.agreement},
                    {"parts", ""}});
  return rows;
}

Json facts(const DiagnosisReport& report) {
  const record::Record& record = *report.record;
  const double interval = record.sampling_interval();
  std::vector<std::string> channels;
  for (const record::Channel channel : record::kChannels)
    if (record.has(channel)) channels.push_back(record::channel_name(channel));
  Json rows = Json::array();
  const auto row = [&rows](const char* name, const std::string& value) {
    rows.push_back({{"name", name}, {"value", value}});
  };
  row("record", record.name);
  row("samples", std::to_string(record.size()));
  row("duration", four_digits(record.time.back() - record.time.front()) + " s");
  row("rate", interval > 0 ? four_digits(1 / interval) + " Hz" : "?");
  row("channels", joined(channels));
  if (report.diagnosis.apd && report.apd_settings) {
    const diagnosis::ApdResult& apd = *report.diagnosis.apd;
    row("excitation periods", fmt::format("{} used, of {} s, {} left out", apd.periods.size(),
                                          four_digits(apd.period), apd.incomplete));
  }
  if (report.curve)
    row("monitoring curve", fmt::format("{}: {}, {} points, made by version {}", report.curve_source,
                                        report.curve->conditions.rig, report.curve->points.size(),
                                        report.curve->conditions.version));
  if (report.diagnosis.coherence) row("coherence", report.diagnosis.coherence->message);
  return rows;
}

/// What the record says of a value; empty where it was not asked.
std::string found_text(const rig_file::DeclaredValue& v, const diagnosis::WaveformEvidence* evidence) {
  if (!evidence || v.quantity < 0) return "";
  const auto place = static_cast<std::size_t>(v.quantity);
  const diagnosis::WaveformEvidence::Value& e = evidence->values[place];
  const double before = e.spread * (diagnosis::waveform_quantities()[place].factor ? e.found : 1);
  if (!(e.standard_error < kMostLeft * before)) return "not determined by it";
  return fmt::format("{} \u00b1 {:.1g}", four_digits(e.found - v.share), e.standard_error);
}

/// The machine as its rig file declares it, and beside it as a trusted fit found it.
Json machine(const DiagnosisReport& report, const rig_file::RigFile* rig) {
  Json rows = Json::array();
  if (!rig) return rows;
  const diagnosis::WaveformEvidence* evidence = nullptr;
  for (const diagnosis::Estimate& e : report.diagnosis.estimates)
    if (e.status == diagnosis::Status::ok || e.status == diagnosis::Status::below_range)
      if (e.waveform) evidence = e.waveform.get();
  for (const rig_file::DeclaredValue& v : rig_file::declared_values(*rig))
    rows.push_back({{"name", v.name},
                    {"value", four_digits(v.value) + (v.unit.empty() || v.unit == "-" ? "" : " " + v.unit)},
                    {"uncertainty", v.uncertainty},
                    {"found", found_text(v, evidence)},
                    {"source", v.source}});
  return rows;
}

std::string plots_of(const DiagnosisReport& report, const rig_file::RigFile* rig) {
  try {
    const ScratchFolder scratch;
    write_file(scratch.path("series.json"), diagnosis_series(report, rig));
    return drawn_figures("diagnosis_report.py", {"--", scratch.path("series.json")});
  } catch (const CannotWrite& error) {
    return no_figures(error.what());
  }
}

}  // namespace

std::string diagnosis_page(const DiagnosisReport& report, const rig_file::RigFile* rig,
                           const Provenance& provenance) {
  const PageUnit unit = unit_of(report.diagnosis, rig && rig->rig.linear);
  const std::string of = report.rig.empty() ? report.record->name : report.rig + ", " + report.record->name;
  const diagnosis::Verdict& verdict = report.diagnosis.verdict;
  const bool silent = verdict.members.empty() && verdict.dissenters.empty();
  const bool unknown = verdict.grade == diagnosis::Grade::cannot_tell;
  const std::string first =
      unknown ? "Cannot tell how much backlash the joint has." : headline(verdict, unit);
  const Json values = machine(report, rig);
  const auto any = [&values](const char* column) {
    return std::any_of(values.begin(), values.end(), [&](const Json& row) { return row.at(column) != ""; });
  };
  const Json data = {
      {"grade", diagnosis::to_string(verdict.grade)},
      {"headline", first},
      {"reasons",
       silent ? why_not(report.diagnosis)
              : Json::array({unknown || first.empty() ? verdict.message : beside_headline(verdict.message)})},
      {"unit", unit.name()},
      {"estimates", estimates(report.diagnosis, unit)},
      {"plots", plots_of(report, rig)},
      {"has_machine", rig != nullptr},
      {"machine", values},
      {"has_uncertainty", any("uncertainty")},
      {"has_found", any("found")},
      {"has_source", any("source")},
      {"facts", facts(report)},
      {"warnings", warnings_section(report.warnings)},
      {"provenance", provenance_sections(provenance)}};
  return report_page("Backlash of " + of, filled(kDiagnosisTemplate, data));
}

}  // namespace backlash::report
