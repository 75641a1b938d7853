// SPDX-License-Identifier: BSD-3-Clause
// All estimators on one record, without ROS.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/baseline.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "backlash_diagnosis/report/diagnosis_page.h"
#include "backlash_diagnosis/report/diagnosis_report.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/for_arm.h"
#include "tools/common/of_file.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

/// What each method looks at, for the help text.
std::string needs_of_methods() {
  std::string text = "Methods and the channels that they need:";
  for (const diagnosis::DiagnosisMethod& method : diagnosis::diagnosis_method_table())
    text += (text.back() == ':' ? " " : "; ") + method.name + " - " + needs_of(method);
  return text + ".";
}

Command command() {
  Command c;
  c.name = "diagnose_record";
  c.summary = "Estimates the backlash in a record by all methods that it can serve and grades it.";
  c.positional = {"RECORD.{csv,bag,mcap,db3,json,npz}"};
  c.options = {
      {"json", "OUT.json",
       "report to write; '-' writes it to standard output instead of the summary; "
       "default: the summary alone"},
      {"report", "OUT.html", "page for people: verdict, estimates, plots, and how it came about"},
      {"rig", "RIG.yaml",
       "rig file: what to look for and which limits hold; without it only what the curve allows"},
      {"curve", "CURVE.yaml",
       "monitoring curve (see build_curve); without it one is built from the rig file at the "
       "record's sampling rate"},
      {"limits", "LIMITS.yaml",
       "limits to grade by, instead of the rig file's: schema_version and the same map as its "
       "diagnosis.limits"},
      {"baseline", "BASELINE.yaml", "the healthy machine: the limits then hold for the growth since"},
      {"save-baseline", "BASELINE.yaml", "keep this diagnosis as that of the healthy machine"},
      {"method", "NAME", "only this method: " + joined(diagnosis::diagnosis_methods())},
      {"joint", "NAME", "joint in a bag; default: the rig file's, else the only one"},
      {"topic", "NAME", "topic to read in a bag, alone or as the last part; default: joint_states"},
      {"periods", "N", "use only the last N whole excitation periods after settling"},
  };
  c.notes =
      std::string(
          "backlash is the total free play along the line of action [m], backlash_angle the same as an "
          "angle on "
          "the axis of motor_position [rad]; intervals hold with 95 %. ") +
      needs_of_methods() +
      " The rig file of an arm (urdf) gives the play of each joint with motor_position and load_position, in "
      "one run; only --rig and --json hold there.";
  c.examples = {
      "diagnose_record run.csv --rig config/sarkar_1997.yaml --json report.json --report report.html",
      "diagnose_record run.bag --joint elbow --curve curve.yaml --json -",
      "diagnose_record new.csv --rig rig.yaml --save-baseline healthy.yaml --json new.json",
      "diagnose_record old.csv --rig rig.yaml --baseline healthy.yaml --json old.json"};
  c.exit_codes =
      "  0   healthy, or ungraded: no limits are given\n"
      "  1   watch\n"
      "  2   fault found: service or stop\n"
      "  3   inconclusive: no estimate has an answer, or none good enough for --save-baseline\n";
  return c;
}

/// What the command was given, read.
struct Inputs {
  std::string method;
  std::optional<rig_file::RigFile> rig;
  std::optional<diagnosis::MonitoringCurve> curve;
  std::string curve_source;
  std::string no_curve;  // why the rig file gives none
  record::Record record;
  std::optional<diagnosis::PeriodWindow> last_periods;  // where only those are asked for
  diagnosis::DiagnosisSettings settings;
  std::optional<diagnosis::Baseline> baseline;
  std::vector<std::string> warnings;  // of the files, not of the record

  bool angular() const { return rig ? rig->rig.mesh.angular() : curve && curve->conditions.angular; }
  std::string rig_name() const { return rig ? rig->rig.name : curve ? curve->conditions.rig : ""; }
  std::string rig_digest() const { return rig ? rig->digest : curve ? curve->conditions.rig_digest : ""; }
};

diagnosis::ApdSettings settings_of(const diagnosis::MonitoringCurve& curve) {
  diagnosis::ApdSettings settings;
  settings.signal = record::channel_from_name(curve.conditions.signal);
  settings.layout = curve.conditions.apd;
  settings.period = curve.conditions.frequency > 0 ? 1 / curve.conditions.frequency : 0;
  settings.settling_periods = curve.conditions.settling_periods;
  return settings;
}

/// The last `count` whole periods, as the diagnoser's service cuts them.
void keep_last_periods(Inputs& in, std::uint64_t count) {
  diagnosis::PeriodWindow window =
      diagnosis::cut_periods(in.record, in.settings.apd, static_cast<long>(count));
  if (!(window.period > 0))
    throw BadData(in.record.name, "--periods needs an excitation that repeats, none was found");
  if (window.count < static_cast<long>(count))
    in.record.warnings.push_back(
        fmt::format("the record is shorter than the {} period(s) asked for: all of it is used", count));
  if (window.record.time.empty()) return;  // too short for one: the estimators say so
  window.record.warnings = in.record.warnings;
  in.record = window.record;
  in.last_periods = std::move(window);
}

/// Builds a curve at the sampling rate of the record, where the rig file declares an APD.
void build_own_curve(Inputs& in) {
  const double interval = in.record.sampling_interval();
  if (!in.settings.apd || (!in.method.empty() && !diagnosis::needs_curve(in.method))) return;
  if (!in.record.has(in.settings.apd->signal) || !(interval > 0)) return;
  studies::CurveRequest request;
  request.sampling_rate = studies::nominal_sampling_rate(interval);
  std::cerr << "diagnose_record: no --curve given, building one from " << in.rig->source << " at "
            << to_text(request.sampling_rate) << " Hz (build_curve keeps one)" << std::endl;
  try {
    ProgressBar bar;
    in.curve =
        of_file(in.rig->source, [&] { return studies::build_curve(*in.rig, request, bar.progress()); });
    in.curve_source = "built for this record";
  } catch (const BadData& e) {  // the other methods need no curve
    in.no_curve = e.what();
  }
}

/// Limits and baseline of their own files. The rig or the curve says which machine they must be of.
void read_machine_files(Inputs& in, const Arguments& arguments) {
  if (arguments.has("limits")) {
    const std::string path = arguments.text("limits");
    in.settings.limits = diagnosis::read_limits_file(path);
    diagnosis::check_limits(*in.settings.limits, in.angular(), path);
  }
  if (arguments.has("baseline")) {
    const std::string path = arguments.text("baseline");
    if (!in.rig && !in.curve) throw UsageError("--baseline needs --rig or --curve");
    in.baseline = diagnosis::read_baseline(path);
    const std::string warning = diagnosis::check_baseline(*in.baseline, in.rig_name(), in.rig_digest(), path);
    if (!warning.empty()) in.warnings.push_back(warning);
  }
}

Inputs read_inputs(const Arguments& arguments, RecordDoor& door) {
  Inputs in;
  in.method = arguments.text("method");
  const auto& methods = diagnosis::diagnosis_methods();
  if (arguments.has("method") && std::find(methods.begin(), methods.end(), in.method) == methods.end())
    throw UsageError("--method = '" + printable(in.method) + "': must be one of " + joined(methods));
  const std::uint64_t periods = arguments.integer("periods", 0, 1, 1'000'000'000);
  check_record_path(arguments.positional(0));
  BagPlace place;
  if (arguments.has("topic")) place.topic = arguments.text("topic");
  if (arguments.has("rig")) {
    in.rig = rig_file::load_rig_file(arguments.text("rig"));
    in.settings = in.rig->diagnosis;
    place = place_of(*in.rig);
  }
  if (arguments.has("joint")) {
    place.joint = arguments.text("joint");
    place.channels.declared = false;
  }
  if (arguments.has("curve")) {
    in.curve_source = arguments.text("curve");
    in.curve = diagnosis::read_curve(in.curve_source);
    if (!in.rig)
      in.settings.apd = settings_of(*in.curve);
    else if (const std::string warning = studies::check_curve(*in.curve, *in.rig, in.curve_source);
             !warning.empty())
      in.warnings.push_back(warning);
  }
  read_machine_files(in, arguments);
  in.record = door.admit(read_record(arguments.positional(0), place),
                         in.rig ? rig_file::declared_motion(in.rig->rig) : record::DeclaredMotion{},
                         arguments.positional(0));
  if (arguments.has("periods")) keep_last_periods(in, periods);
  return in;
}

constexpr double kCrossed = 0.004;  // s; choice: a gap is crossed in some ms, and needs several samples

/// Of one inertia nothing can have play, and its one encoder would not show any.
std::string no_play_seen(const Inputs& in) {
  const double interval = in.record.sampling_interval();
  std::string text =
      "the rig file is of one inertia (mesh: rigid) with one encoder: the play of a gear before or behind "
      "that encoder "
      "cannot be seen from there";
  if (interval > kCrossed)
    text += fmt::format(", nor at {:.3g} Hz, in whose intervals of {:.3g} ms a gap is crossed", 1 / interval,
                        1e3 * interval);
  return text + "; an encoder on the motor and one on the load would show it" +
         (interval > kCrossed ? fmt::format(", at {:.3g} Hz or more", 1 / kCrossed) : "");
}

/// Says what is missing in the words of this command.
void explain(diagnosis::Diagnosis& diagnosis, const Inputs& in) {
  for (diagnosis::Estimate& e : diagnosis.estimates) {
    if (e.status != diagnosis::Status::insufficient_data) continue;
    const bool by_curve = diagnosis::needs_curve(e.method);
    if (!in.rig && by_curve && !in.curve) e.message = "needs --rig or --curve";
    if (!in.rig && !by_curve) e.message = "needs --rig";
    if (by_curve && !in.no_curve.empty()) e.message = "no monitoring curve: " + in.no_curve;
    if (in.rig && in.rig->rig.mesh.rigid) e.message = no_play_seen(in);
  }
  diagnosis.verdict = diagnosis::combine(diagnosis.estimates, in.settings.limits, in.baseline);
  if (in.rig && in.rig->rig.mesh.rigid && diagnosis.verdict.estimate < 0)
    diagnosis.verdict.message = "cannot tell: " + no_play_seen(in);
}

void check_outputs(const Arguments& arguments) {
  std::vector<std::string> inputs = {arguments.positional(0)};
  for (const char* option : {"rig", "curve", "limits"})
    if (arguments.has(option)) inputs.push_back(arguments.text(option));
  const std::string out = arguments.text("json"), saved = arguments.text("save-baseline");
  if (!saved.empty()) check_output(saved, inputs);  // a baseline may be renewed
  if (!saved.empty() && saved == out) throw UsageError("--json and --save-baseline name the same file");
  if (arguments.has("baseline")) inputs.push_back(arguments.text("baseline"));
  if (!out.empty() && out != kStandardOutput) check_output(out, inputs);
  if (!arguments.has("report")) return;
  const std::string page = arguments.text("report");
  check_output(page, inputs);
  if (page == out || page == saved) throw UsageError("--report names the same file as another output");
}

report::Provenance provenance_of(const Arguments& arguments, const Inputs& in) {
  report::Provenance p;
  p.command = {"diagnose_record"};
  p.command.insert(p.command.end(), arguments.words().begin(), arguments.words().end());
  p.files = {{"record", arguments.positional(0)}};
  for (const char* option : {"rig", "curve", "limits", "baseline"})
    if (arguments.has(option)) p.files.push_back({option, arguments.text(option)});
  if (in.rig) {
    p.rig_source = in.rig->source;
    p.rig_text = in.rig->text;
  }
  if (in.curve)
    p.seeds = "Drawn at random: only the runs of the monitoring curve, " +
              std::to_string(in.curve->conditions.seeds) +
              " per backlash with fixed seeds; the same rig file gives the same curve.";
  return p;
}

/// False where this diagnosis is no baseline; the reason is printed.
bool save_baseline(const diagnosis::Diagnosis& diagnosis, const Inputs& in, const std::string& path) {
  diagnosis::Baseline baseline;
  try {
    baseline = diagnosis::baseline_of(diagnosis, in.rig_name(), in.rig_digest());
  } catch (const BadData& error) {
    std::cerr << "diagnose_record: " << path << " not written: " << error.what() << '\n';
    return false;
  }
  write_text(path, diagnosis::to_yaml(baseline));
  return true;
}

int diagnose_record(const Arguments& arguments) {
  RecordDoor door("diagnose_record");
  if (arguments.has("rig") && rig_file::is_arm_rig(arguments.text("rig")))
    return run_for_arm(arguments, door);
  Inputs in = read_inputs(arguments, door);
  check_outputs(arguments);
  const std::string out = arguments.text("json");
  if (in.rig && !in.curve) build_own_curve(in);
  report::DiagnosisReport report;
  report.record = &in.record;
  report.warnings = in.record.warnings;
  report.warnings.insert(report.warnings.end(), in.warnings.begin(), in.warnings.end());
  report.apd_settings = in.settings.apd;
  report.limits = in.settings.limits;
  if (in.rig) {
    report.rig = in.rig->rig.name;
    report.rig_digest = in.rig->digest;
  }
  if (in.curve) {
    report.curve = &*in.curve;
    report.curve_source = in.curve_source;
  }
  report.diagnosis =
      in.last_periods
          ? diagnosis::diagnose(*in.last_periods, in.settings, report.curve, in.baseline, in.method)
          : diagnosis::diagnose(in.record, in.settings, report.curve, in.baseline, in.method);
  explain(report.diagnosis, in);
  const std::string json = door.with_findings(report::diagnosis_json(report));
  if (out == kStandardOutput) {
    std::cout << json;
  } else {
    if (!out.empty()) write_text(out, json);
    report::print_summary(report, std::cout);
  }
  if (arguments.has("report"))
    write_text(arguments.text("report"),
               report::diagnosis_page(report, in.rig ? &*in.rig : nullptr, provenance_of(arguments, in)));
  if (arguments.has("save-baseline") && !save_baseline(report.diagnosis, in, arguments.text("save-baseline")))
    return kInconclusive;
  return exit_code(report.diagnosis.verdict.grade);
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, diagnose_record);
}
