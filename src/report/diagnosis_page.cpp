// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/diagnosis_page.h"

#include <cctype>
#include <cmath>
#include <cstdio>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/report/diagnosis_series.h"
#include "backlash_diagnosis/report/html.h"

namespace backlash::tools {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kMicrometre = 1e-6;

std::string number_text(double value) {
  if (!std::isfinite(value)) return "?";
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// "80.0<br>[78.2, 81.9]"; an end that is not known is "?".
std::string value_cell(double value, double lower, double upper, double unit) {
  if (!std::isfinite(value) && !std::isfinite(lower) && !std::isfinite(upper))
    return html_cell("&ndash;", "number");
  std::string text = number_text(value / unit);
  if (std::isfinite(lower) || std::isfinite(upper))
    text += "<br>[" + number_text(lower / unit) + ", " + number_text(upper / unit) + "]";
  return html_cell(text, "number");
}

/// Of one estimate or of all together: lengths, and angles, which a linear axis does not have.
template <typename Answer>
std::string value_cells(const Answer& a, bool linear) {
  std::string cells = linear ? value_cell(a.backlash_angle, a.angle_lower, a.angle_upper, kMicrometre)
                             : value_cell(a.backlash, a.lower, a.upper, kMicrometre);
  if (!linear)
    cells += value_cell(a.backlash_angle, a.angle_lower, a.angle_upper, 1) +
             value_cell(a.backlash_angle, a.angle_lower, a.angle_upper, kDegree);
  return cells;
}

std::string parts_text(const PlayComponents& parts) {
  std::vector<std::string> known;
  const auto add = [&known](const char* name, double value, const char* unit) {
    if (std::isfinite(value)) known.push_back(std::string(name) + " " + number_text(value) + " " + unit);
  };
  add("gap", parts.gap, "rad");
  add("compliance", parts.compliance, "rad/(N m)");
  add("Coulomb friction", parts.coulomb, "N m");
  add("at torque", parts.at_torque, "N m");
  return joined(known);
}

/// "Good: 79.98 um of backlash, 95 % interval 77.93 to 82.17 um." where that is known, and the verdict's own
/// words.
std::string verdict_section(const Verdict& v, bool linear) {
  const bool angle = linear || (!std::isfinite(v.backlash) && !std::isfinite(v.lower));
  const double value = angle ? v.backlash_angle : v.backlash;
  const double lower = angle ? v.angle_lower : v.lower, upper = angle ? v.angle_upper : v.upper;
  const double scale = angle && !linear ? kDegree : kMicrometre;
  const std::string unit = angle && !linear ? " deg" : " &micro;m";
  std::string text = to_string(v.grade);
  text[0] = char(std::toupper(text[0]));
  if (std::isfinite(value))
    text += ": " + number_text(value / scale) + unit + " of backlash, 95 % interval " +
            number_text(lower / scale) + " to " + number_text(upper / scale) + unit + ".";
  return html_tag("p", (std::isfinite(value) ? html_tag("b", text) + "<br>" : "") + html_text(v.message),
                  "class=\"verdict " + std::string(to_string(v.grade)) + "\"") +
         "\n";
}

std::string estimates_section(const Diagnosis& diagnosis, bool linear) {
  const std::string um = "backlash [&micro;m]";
  std::string rows =
      linear ? html_heads({"method", "status", um, "how, or why not"})
             : html_heads({"method", "status", um, "angle [rad]", "angle [deg]", "how, or why not"});
  for (const Estimate& e : diagnosis.estimates) {
    std::string message = html_text(e.message);
    if (std::isfinite(e.skewness) && e.message.find("skewness") == std::string::npos)
      message = "skewness " + number_text(e.skewness) + (message.empty() ? "" : "; ") + message;
    if (e.components) message += (message.empty() ? "" : "<br>") + html_text(parts_text(*e.components));
    rows += html_row(html_cell(html_text(e.method)) + html_cell(to_string(e.status)) +
                     value_cells(e, linear) + html_cell(message, "text"));
  }
  const Verdict& v = diagnosis.verdict;
  if (!v.members.empty())
    rows += html_tag("tr",
                     html_cell("together") + html_cell(to_string(v.grade)) + value_cells(v, linear) +
                         html_cell(html_text(v.agreement), "text"),
                     "class=\"together\"") +
            "\n";
  return html_tag("h2", "Estimates") + "\n" + html_table(rows, "estimates") +
         "<p class=\"small\">Backlash is the total free play along the line of action, the angle is the same "
         "on the axis "
         "of motor_position; in brackets the 95 % interval. ? is not known, a ? at an end leaves it "
         "open.</p>\n";
}

std::string record_section(const DiagnosisReport& report) {
  const Record& record = *report.record;
  const double interval = record.sampling_interval();
  std::vector<std::string> channels;
  for (const Channel channel : kChannels)
    if (record.has(channel)) channels.push_back(channel_name(channel));
  std::string rows;
  const auto row = [&rows](const char* name, const std::string& value) {
    rows += html_row(html_tag("th", name) + html_cell(html_text(value), "text"));
  };
  row("record", record.name);
  row("samples", std::to_string(record.size()));
  row("duration", number_text(record.time.back() - record.time.front()) + " s");
  row("rate", interval > 0 ? number_text(1 / interval) + " Hz" : "?");
  row("channels", joined(channels));
  if (report.diagnosis.apd && report.apd_settings) {
    const ApdResult& apd = *report.diagnosis.apd;
    row("excitation periods", std::to_string(apd.periods.size()) + " used, of " + number_text(apd.period) +
                                  " s, " + std::to_string(apd.incomplete) + " left out");
  }
  if (report.curve)
    row("monitoring curve", report.curve_source + ": " + report.curve->conditions.rig + ", " +
                                std::to_string(report.curve->points.size()) + " points, made by version " +
                                report.curve->conditions.version);
  if (report.diagnosis.coherence) row("coherence", report.diagnosis.coherence->message);
  std::string items;
  for (const std::string& warning : report.warnings) items += html_tag("li", html_text(warning)) + "\n";
  return html_tag("h2", "Record") + "\n" + html_table(rows, "facts") +
         (items.empty() ? html_tag("p", "No warnings.")
                        : html_tag("h3", "Warnings") + "\n" + html_tag("ul", items)) +
         "\n";
}

std::string plots_of(const DiagnosisReport& report, const RigFile* rig) {
  try {
    const ScratchFolder scratch;
    write_file(scratch.path("series.json"), diagnosis_series(report, rig));
    return drawn_figures("diagnosis_report.py", {"--", scratch.path("series.json")});
  } catch (const CannotWrite& error) {
    return "<p>No plots were drawn: " + html_text(error.what()) + ".</p>\n";
  }
}

}  // namespace

std::string diagnosis_page(const DiagnosisReport& report, const RigFile* rig, const Provenance& provenance) {
  const bool linear = rig && rig->rig.linear;
  const std::string of = report.rig.empty() ? report.record->name : report.rig + ", " + report.record->name;
  return report_page("Backlash of " + of, verdict_section(report.diagnosis.verdict, linear) +
                                              estimates_section(report.diagnosis, linear) +
                                              html_tag("h2", "Plots") + "\n" + plots_of(report, rig) +
                                              record_section(report) + provenance_sections(provenance));
}

}  // namespace backlash::tools
