// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm_findings/arm_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/report/report_page.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/measured_text.h"
#include "report/html_template.h"
#include "report/json.h"

namespace backlash::arm_findings {
namespace {

report::Json with_unit(const signal::Measured& m, const std::string& unit) {
  return {{"value", report::json_number(m.value)},
          {"unit", unit},
          {"standard_error", report::json_number(m.standard_error)}};
}

std::string torque_channel(const std::string& joint) {
  return joint + "/torque";
}

/// Name, value and unit of all that was fitted.
struct NamedValue {
  std::string name, unit;
  signal::Measured measured;
};

std::vector<NamedValue> drive_values(const arm::ArmFit& fit) {
  std::vector<NamedValue> all;
  for (std::size_t j = 0; j < fit.drives.size(); ++j) {
    const std::string joint = fit.rig.joints[j].name + "/";
    for (const arm::DriveTerm t : fit.rig.terms) {
      const arm::DriveTermSpec& spec = arm::kDriveTermSpecs[std::size_t(t)];
      all.push_back({joint + spec.name, spec.unit, fit.drives[j][std::size_t(t)]});
    }
    if (fit.rig.channel == record::Channel::motor_current)
      all.push_back({joint + "torque_constant", "N m/A", fit.drives[j][arm::kDriveTerms]});
    all.push_back({joint + "delay", "s", fit.drives[j].back()});
  }
  return all;
}

/// Null where the records are of one arm.
report::Json contradictions_json(const std::vector<arm::Contradiction>& all) {
  if (all.empty()) return nullptr;
  report::Json json = {{"joints", report::Json::array()}};
  for (const arm::Contradiction& c : all)
    json["joints"].push_back({{"joint", c.joint},
                              {"alone", report::json_number(c.alone)},
                              {"together", report::json_number(c.together)}});
  return json;
}

report::Json body_json(const arm::BodyParameters& parameters) {
  const arm::Body b = arm::body_of(parameters);
  return {{"mass", b.mass},
          {"centre", {b.centre.x(), b.centre.y(), b.centre.z()}},
          {"inertia",
           {b.inertia(0, 0), b.inertia(0, 1), b.inertia(0, 2), b.inertia(1, 1), b.inertia(1, 2),
            b.inertia(2, 2)}},
          {"consistent", arm::is_consistent(parameters)}};
}

/// A record in which the machine carried something, and what.
struct LoadedRecord {
  std::string record;
  bool known;
  const arm::FittedState* state;
};

std::vector<LoadedRecord> loaded_records(const arm::ArmFit& fit, const std::vector<std::string>& records,
                                         const Carried& carried) {
  std::vector<LoadedRecord> all;
  for (std::size_t r = 0; r < carried.size(); ++r)
    if (carried[r])
      all.push_back({records[r], std::isfinite(carried[r]->mass.standard_error), &fit.states[all.size()]});
  return all;
}

bool has_inexact_constants(const arm::ArmRig& rig) {
  return std::any_of(rig.joints.begin(), rig.joints.end(),
                     [](const arm::JointDrive& drive) { return drive.constant_error > 0; });
}

std::string scale_sentence(const arm::ArmFit& fit) {
  const double percent = 100 * fit.rig.common_error;
  if (fit.weighed)
    return fmt::format(
        "the known weight has measured the torque constants, all together to {:.2g} %; masses and "
        "inertias are as well known",
        percent);
  if (!has_inexact_constants(fit.rig))
    return "of the recorded torque, or of constants that are declared as exact";
  return fmt::format(
      "of the declared torque constants: the records do not show how large all of them are together, "
      "which is known to {:.2g} %; all torques, masses and inertias share that. A record with a "
      "known weight measures it: --payload",
      percent);
}

report::Json payloads_json(const arm::ArmFit& fit, const std::vector<LoadedRecord>& loaded) {
  report::Json all = report::Json::array();
  for (const LoadedRecord& l : loaded) {
    report::Json one = {{"record", l.record},
                        {"link", fit.rig.chain.joints.back().link},
                        {"known", l.known},
                        {"mass", with_unit(l.state->mass, "kg")}};
    static const char* const names[] = {"centre_x", "centre_y", "centre_z"};
    for (int i = 0; i < 3; ++i) one[names[i]] = with_unit(l.state->centre[i], "m");
    one["body"] = body_json(l.state->payload);
    all.push_back(one);
  }
  return all;
}

/// Standard parameters that no motion distinguishes from others, or shows at all: any value would do, the
/// interval is infinite.
report::Json not_identifiable_json(const arm::ArmFit& fit) {
  report::Json all = report::Json::object();
  for (std::size_t i = 0; i < fit.rig.shown.size(); ++i) {
    if (fit.rig.shown[i] == arm::Shown::leads) continue;
    all[arm::standard_name(fit.rig.chain, i)] = {
        {"value", fit.rig.chain.links[i / 10][Eigen::Index(i % 10)]},
        {"interval", nullptr},
        {"reason",
         fit.rig.shown[i] == arm::Shown::not_at_all
             ? "no motion shows it: as declared where a body allows that"
             : "the motions show it in a sum with others only: as near to the declared body as that sum "
               "allows"}};
  }
  return all;
}

}  // namespace

std::string arm_identification_json(const arm::ArmFit& fit, const std::string& rig,
                                    const std::vector<std::string>& records, const Carried& carried) {
  report::Json json = {{"schema_version", 1},
                       {"version", version()},
                       {"procedures", report::Json::array()},
                       {"parameters", report::Json::object()},
                       {"channels", report::Json::object()},
                       {"warnings", fit.warnings}};
  json["procedures"].push_back(
      {{"name", "arm"},
       {"used", true},
       {"records", records},
       {"message",
        fmt::format("links, drives and torque constants together; {} base parameters", fit.base.size())}});
  for (const NamedValue& v : drive_values(fit)) json["parameters"][v.name] = with_unit(v.measured, v.unit);
  for (const arm::BaseParameter& b : fit.base) json["parameters"][b.name] = with_unit(b.measured, b.unit);
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j)
    json["channels"][torque_channel(fit.rig.joints[j].name)] = {{"train", report::json_number(fit.train[j])},
                                                                {"floor", report::json_number(fit.floor[j])}};
  json["several_machines"] = contradictions_json(fit.contradictions);
  json["common_scale"] = {{"uncertainty", fit.rig.common_error},
                          {"from", fit.weighed ? "weight" : "declared"},
                          {"message", scale_sentence(fit)}};
  json["payloads"] = payloads_json(fit, loaded_records(fit, records, carried));
  json["not_identifiable"] = not_identifiable_json(fit);
  for (std::size_t i = 0; i < fit.rig.chain.size(); ++i)
    json["links"][fit.rig.chain.joints[i].link] = body_json(fit.rig.chain.links[i]);
  json["rig"] = rig;
  json["records"] = records;
  return report::dumped(json, 1);
}

void print_arm_summary(const arm::ArmFit& fit, const std::vector<std::string>& records,
                       const Carried& carried, std::ostream& out) {
  out << "parameters (at the joints)\n";
  for (const NamedValue& v : drive_values(fit))
    out << fmt::format("  {:<36} {:12.6g}  +- {:<9.2g} {}\n", v.name, v.measured.value,
                       v.measured.standard_error, v.unit);
  out << fmt::format(
      "\nlinks (one body of many that move alike; {} base parameters are known, see the JSON)\n",
      fit.base.size());
  for (std::size_t i = 0; i < fit.rig.chain.size(); ++i) {
    const arm::Body b = arm::body_of(fit.rig.chain.links[i]);
    out << fmt::format("  {:<24} {:8.4g} kg at {:8.4f} {:8.4f} {:8.4f} m\n", fit.rig.chain.joints[i].link,
                       b.mass, b.centre.x(), b.centre.y(), b.centre.z());
  }
  const auto hidden = std::count(fit.rig.shown.begin(), fit.rig.shown.end(), arm::Shown::not_at_all),
             mixed = std::count(fit.rig.shown.begin(), fit.rig.shown.end(), arm::Shown::in_others);
  out << fmt::format(
      "  {} of their {} values no motion shows, {} only in a sum with others (not_identifiable)\n", hidden,
      fit.rig.shown.size(), mixed);
  for (const LoadedRecord& l : loaded_records(fit, records, carried))
    out << fmt::format("\ncarried in {}: {} kg, {}\n", l.record, signal::with_error(l.state->mass),
                       l.known ? "known" : "found");
  out << "\nscale: " << scale_sentence(fit) << '\n';
  out << "\nrelative error of the fitted model (what noise alone would leave)\n";
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j)
    out << fmt::format("  {:<36} {:.3g} % ({:.3g} %)\n", torque_channel(fit.rig.joints[j].name),
                       100 * fit.train[j], 100 * fit.floor[j]);
  for (const std::string& warning : fit.warnings) out << "warning: " << warning << '\n';
}

std::string fitted_arm_text(const arm::ArmFit& fit, const std::vector<std::string>& records) {
  std::vector<std::string> comments = {"Fitted by identify to:"};
  for (const std::string& record : records) comments.push_back("  " + printable(record, 4096));
  if (fit.weighed) comments.emplace_back("Torque constants: measured by a known weight (--payload).");
  comments.emplace_back(
      "Standard errors are in the JSON beside it. Links: one physical body each, of many that move alike.");
  comments.emplace_back("SPDX-License-Identifier: BSD-3-Clause");
  return arm::arm_rig_text(fit.rig, comments);
}

namespace {

const char* verdict_word(const arm::ArmTrace& trace) {
  if (trace.unexplained || trace.cannot_tell) return "unexplained";
  return trace.steps.empty() ? "nothing_missing" : "effect_found";
}

report::Json step_json(const arm::ArmStep& step, const std::vector<std::string>& joints) {
  report::Json json = {{"effect", step.effect}, {"channel", step.channel}};
  if (!step.joint.empty()) json["joint"] = step.joint;
  if (!step.link.empty()) json["link"] = step.link;
  if (!step.other_joint.empty()) json["other_joint"] = step.other_joint;
  for (const arm::ArmParameter& p : step.parameters) {
    json["parameters"][p.name] = with_unit(p.measured, p.unit);
    const double half = signal::kNormalQuantile975 * p.measured.standard_error;
    json["parameters"][p.name]["interval"] =
        report::json_interval(p.measured.value - half, p.measured.value + half);
  }
  if (step.push) {
    json["begin"] = {{"value", step.push->begin}, {"unit", "s"}};
    json["end"] = {{"value", step.push->end}, {"unit", "s"}};
    json["released"] = step.push->released;
    json["level_left"] = {{"value", step.push->left}, {"unit", "N m"}};
  }
  const auto joint = std::find(joints.begin(), joints.end(), step.channel.substr(0, step.channel.find('/'))) -
                     joints.begin();
  const bool judged = !step.before.empty();
  json["test_error_before"] = judged ? report::json_number(step.before[std::size_t(joint)]) : report::Json();
  json["test_error_after"] = judged ? report::json_number(step.after[std::size_t(joint)]) : report::Json();
  if (judged)
    json["evidence"] = {{"gain", step.gain},
                        {"interval", report::json_interval(step.gain_lower, step.gain_upper)}};
  json["equivalent_to"] = step.equivalent_to;
  return json;
}

}  // namespace

std::string arm_verdict_sentence(const arm::ArmTrace& trace) {
  std::string text;
  for (const arm::ArmStep& step : trace.steps) {
    if (!text.empty()) text += " ";
    text += step.effect + (step.link.empty() ? "" : " at " + step.link) +
            (step.joint.empty() ? "" : " of " + step.joint) +
            (step.other_joint.empty() ? "" : " with " + step.other_joint);
    if (step.push)
      text += fmt::format(" from {:.2f} s, {} {:.2f} s, {:.3g} N m.", step.push->begin,
                          step.push->released ? "released at" : "not released by the end,", step.push->end,
                          step.parameters.front().measured.value);
    else
      text += fmt::format(": {} = {} {}.", step.parameters.front().name,
                          signal::with_error(step.parameters.front().measured),
                          step.parameters.front().unit == "-" ? "" : step.parameters.front().unit);
  }
  if (trace.cannot_tell) return "Cannot tell: " + trace.judged;
  if (text.empty())
    text = trace.unexplained ? "No effect was found." : "Nothing is missing that the records show.";
  if (trace.unexplained)
    text += " Unexplained: " + trace.unexplained->channel + ", " + trace.unexplained->signature + ".";
  return text;
}

std::string arm_trace_json(const arm::ArmTrace& trace, const findings::TraceInputs& inputs) {
  report::Json json = {{"schema_version", 1},
                       {"version", version()},
                       {"verdict", verdict_word(trace)},
                       {"message", arm_verdict_sentence(trace)},
                       {"judged", trace.judged},
                       {"rig", inputs.rig},
                       {"train", inputs.train},
                       {"test", inputs.test},
                       {"channels", report::Json::object()},
                       {"steps", report::Json::array()},
                       {"rejected", report::Json::array()},
                       {"unexplained", nullptr}};
  for (std::size_t j = 0; j < trace.joints.size(); ++j)
    json["channels"][torque_channel(trace.joints[j])] = {{"before", report::json_number(trace.before[j])},
                                                         {"after", report::json_number(trace.after[j])},
                                                         {"floor", report::json_number(trace.floor[j])},
                                                         {"train", report::json_number(trace.train[j])}};
  for (const arm::ArmStep& step : trace.steps) json["steps"].push_back(step_json(step, trace.joints));
  for (const arm::ArmTrace::Rejected& r : trace.rejected) {
    json["rejected"].push_back({{"effect", r.effect}, {"reason", r.reason}});
    if (!r.joint.empty()) json["rejected"].back()["joint"] = r.joint;
  }
  if (trace.unexplained)
    json["unexplained"] = {{"channel", trace.unexplained->channel},
                           {"signature", trace.unexplained->signature},
                           {"explainable", nullptr}};
  json["notes"] = trace.notes;
  json["warnings"] = trace.warnings;
  return report::dumped(json, 1);
}

std::string arm_series_json(const arm::ArmTrace& trace) {
  const auto column = [](const std::vector<double>& values) {
    report::Json json = report::Json::array();
    for (const double v : values)
      json.push_back(std::isfinite(v) ? report::Json(std::round(1e5 * v) / 1e5) : report::Json());
    return json;
  };
  const bool current = trace.augmented.channel == record::Channel::motor_current;
  report::Json json = {
      {"schema_version", 1}, {"unit", current ? "A" : "N m"}, {"time", column(trace.series.time)}};
  json["joints"] = report::Json::array();
  for (std::size_t j = 0; j < trace.series.measured.size(); ++j)
    json["joints"].push_back({{"name", trace.joints[j]},
                              {"measured", column(trace.series.measured[j])},
                              {"before", column(trace.series.before[j])},
                              {"after", column(trace.series.after[j])}});
  json["events"] = report::Json::array();
  for (const arm::ArmStep& step : trace.steps)
    if (step.push)
      json["events"].push_back({{"joint", step.joint}, {"begin", step.push->begin}, {"end", step.push->end}});
  return report::dumped(json, -1);
}

void print_arm_trace(const arm::ArmTrace& trace, std::ostream& out) {
  out << arm_verdict_sentence(trace) << '\n' << trace.judged << "\n\n";
  out << fmt::format("{:<32} {:>9} {:>9} {:>9} {:>9}\n", "relative error", "training", "before", "after",
                     "noise");
  const auto number = [](double x) {
    return std::isfinite(x) ? fmt::format("{:.2f} %", 100 * x) : std::string("-");
  };
  for (std::size_t j = 0; j < trace.joints.size(); ++j)
    out << fmt::format("{:<32} {:>9} {:>9} {:>9} {:>9}\n", torque_channel(trace.joints[j]),
                       number(trace.train[j]), number(trace.before[j]), number(trace.after[j]),
                       number(trace.floor[j]));
  for (const arm::ArmStep& step : trace.steps) {
    out << fmt::format("\n{} {}{}\n", step.effect, step.link, step.joint);
    for (const arm::ArmParameter& p : step.parameters)
      out << fmt::format("  {:<12} {} {}\n", p.name, signal::with_error(p.measured), p.unit);
  }
  for (const std::string& warning : trace.warnings) out << "warning: " << warning << '\n';
}

namespace {

report::Json page_step(const arm::ArmStep& step) {
  report::Json json = {
      {"id", step.effect},
      {"where", step.link + step.joint + (step.other_joint.empty() ? "" : " with " + step.other_joint)},
      {"parameters", report::Json::array()}};
  for (const arm::ArmParameter& p : step.parameters) {
    const signal::ValueText text = signal::value_text(p.measured);
    json["parameters"].push_back({{"name", p.name},
                                  {"value", text.value},
                                  {"error", text.error},
                                  {"unit", p.unit == "-" ? "" : p.unit}});
  }
  json["when"] = step.push ? fmt::format("{:.2f} s to {:.2f} s{}", step.push->begin, step.push->end,
                                         step.push->released ? ", released" : ", not released by the end")
                           : "";
  json["gain"] =
      step.push
          ? ""
          : fmt::format("{} of the squared error of {} (95 %: {} to {})", findings::percent(step.gain),
                        step.channel, findings::percent(step.gain_lower), findings::percent(step.gain_upper));
  return json;
}

}  // namespace

std::string arm_trace_page(const arm::ArmTrace& trace, const findings::TraceInputs& inputs,
                           const std::string& plots, const std::string& provenance) {
  report::Json data = {{"verdict", verdict_word(trace)},
                       {"message", arm_verdict_sentence(trace)},
                       {"judged", trace.judged},
                       {"rig", inputs.rig},
                       {"train", joined(inputs.train)},
                       {"test", inputs.test},
                       {"rows", report::Json::array()},
                       {"has_effects", !trace.steps.empty()},
                       {"effects", report::Json::array()},
                       {"has_rejected", !trace.rejected.empty()},
                       {"rejected", report::Json::array()},
                       {"notes", trace.notes},
                       {"warnings", report::warnings_section(trace.warnings)},
                       {"plots", plots},
                       {"provenance", provenance}};
  const auto number = [](double x) {
    return std::isfinite(x) ? findings::percent(x) : std::string("not judged");
  };
  for (std::size_t j = 0; j < trace.joints.size(); ++j)
    data["rows"].push_back({{"joint", trace.joints[j]},
                            {"train", number(trace.train[j])},
                            {"before", number(trace.before[j])},
                            {"after", number(trace.after[j])},
                            {"floor", number(trace.floor[j])}});
  for (const arm::ArmStep& step : trace.steps) data["effects"].push_back(page_step(step));
  for (const arm::ArmTrace::Rejected& r : trace.rejected)
    data["rejected"].push_back({{"id", r.effect}, {"reason", r.reason}});
  return report::report_page("What the model of " + trace.augmented.name + " lacks",
                             report::filled(report::kArmTraceTemplate, data));
}

}  // namespace backlash::arm_findings
