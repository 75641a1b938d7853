// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/serves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "tools/common/exit_codes.h"
#include "tools/common/plot.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using record::Channel;
using report::Serves;

const char* const kAskWithRig = "its channels are there; --rig says the rest";
constexpr double kOfRange = 0.1;  // choice: of its range, by which a signal must come back to count as a turn

/// How often a signal turns round, without what is small beside its range.
std::size_t reversals_of(const std::vector<double>& x) {
  if (x.empty()) return 0;
  const double least = kOfRange * signal::peak_to_peak(x);
  double low = x[0], high = x[0];
  int direction = 0;
  std::size_t count = 0;
  for (const double v : x) {
    low = std::min(low, v), high = std::max(high, v);
    if (direction >= 0 && v < high - least) {
      count += direction > 0;
      direction = -1, low = v, high = v;
    } else if (direction <= 0 && v > low + least) {
      count += direction < 0;
      direction = 1, low = v, high = v;
    }
    if (direction > 0) low = v > low ? low : v;
  }
  return count;
}

/// How often a torque goes from one sign to the other, without what is small beside it.
std::size_t crossings_of(const std::vector<double>& x) {
  if (x.empty()) return 0;
  const double least = kOfRange * std::max(-signal::extent(x).low, signal::extent(x).high);
  int sign = 0;
  std::size_t count = 0;
  for (const double v : x) {
    if (std::fabs(v) < least) continue;
    const int now = v > 0 ? 1 : -1;
    count += sign == -now;
    sign = now;
  }
  return count;
}

std::string first_refusal(const report::CheckedFile& file) {
  for (const record::Finding& finding : file.findings())
    if (finding.consequence == record::Consequence::refused) return finding.message;
  return "";
}

bool is_estimate(const diagnosis::Estimate& estimate) {
  return estimate.status == diagnosis::Status::ok || estimate.status == diagnosis::Status::below_range ||
         estimate.status == diagnosis::Status::above_range;
}

/// A monitoring curve comes later; the periods must be there.
Serves by_curve(const std::string& name, const record::Record& record, const diagnosis::ApdSettings& apd) {
  const diagnosis::PeriodWindow window = diagnosis::cut_periods(record, apd);
  if (window.record.time.empty()) return {name, false, "no whole excitation period after settling"};
  return {
      name, true,
      fmt::format("{} whole periods; needs a monitoring curve, which diagnose_record builds", window.count)};
}

Serves method_of(const diagnosis::DiagnosisMethod& method, const record::Record& record,
                 const std::optional<rig_file::RigFile>& rig) {
  const std::string lacking =
      diagnosis::lacking_channel(method, record, rig ? rig->diagnosis.apd : std::nullopt);
  if (!lacking.empty()) return {method.name, false, "needs " + lacking};
  const std::size_t crossings = crossings_of(record.column(Channel::motor_torque));
  if (!rig) {
    const bool moves = crossings >= 2 || reversals_of(record.column(Channel::motor_position)) >= 2;
    return {method.name, moves, moves ? kAskWithRig : "neither torque nor motion reverses twice"};
  }
  if (method.by_curve) return by_curve(method.name, record, *rig->diagnosis.apd);
  if (method.name == "waveform") {
    if (!rig->diagnosis.waveform) return {method.name, false, rig->diagnosis.no_waveform};
    return {method.name, crossings >= 2, fmt::format("the torque reverses {} times", crossings)};
  }
  diagnosis::DiagnosisSettings settings = rig->diagnosis;
  settings.coherence.reset();
  const diagnosis::Estimate estimate =
      diagnosis::diagnose(record, settings, nullptr, std::nullopt, method.name).estimates.front();
  return {method.name, is_estimate(estimate), estimate.message};
}

/// Channels, and motion that the fit of a machine cannot do without.
Serves fit_of(const std::string& command, const record::Record& record,
              const std::optional<rig_file::RigFile>& rig) {
  std::vector<Channel> needed = {Channel::motor_torque, Channel::motor_position};
  const bool with_sensor = rig && rig->diagnosis.waveform;
  if (with_sensor)
    needed = {Channel::motor_torque, Channel::sensor_torque};
  else if (rig && !rig->rig.mesh.rigid && !rig->rig.link_locked && command != "detect_changes")
    needed.push_back(Channel::load_position);
  if (with_sensor && command == "trace_residual")
    return {command, false,
            "a rig with a torque sensor is fitted by identify, and its changes found by detect_changes"};
  for (const Channel channel : needed)
    if (!record.has(channel)) return {command, false, "needs " + record::channel_name(channel)};
  const std::size_t turns =
      reversals_of(record.column(with_sensor ? Channel::motor_torque : Channel::motor_position));
  const std::string seen =
      fmt::format("{} reverses {} times", with_sensor ? "the torque" : "the motion", turns);
  return {command, turns >= 2, turns >= 2 ? seen : seen + ": friction and inertia need motion both ways"};
}

void refuse_all(std::vector<Serves>& all, const std::string& reason) {
  if (reason.empty()) return;
  for (Serves& each : all) each = {each.name, false, reason};
}

std::vector<Serves> serves_of(const report::CheckedFile& file, const std::vector<record::JointRecord>& joints,
                              const std::optional<Channel>& drive) {
  std::string lacks, lacks_load, still;
  for (const record::JointRecord& joint : joints) {
    const record::Record& r = joint.record;
    const bool torque = drive ? r.has(*drive) : r.has(Channel::motor_current) || r.has(Channel::motor_torque);
    if (!r.has(Channel::motor_position)) lacks = "needs " + joint.joint + "/motor_position";
    if (!torque)
      lacks = "needs " + joint.joint + "/" +
              (drive ? record::channel_name(*drive) : "motor_torque or motor_current");
    if (!r.has(Channel::load_position))
      lacks_load = "needs " + joint.joint + "/load_position for the play of that joint";
    if (r.has(Channel::motor_position) && reversals_of(r.column(Channel::motor_position)) < 2)
      still += (still.empty() ? "" : ", ") + joint.joint;
  }
  const std::string hardly = still.empty() ? "all joints move both ways"
                                           : "hardly identifiable, as they do not move both ways: " + still;
  std::vector<Serves> all = {
      {"diagnose_record", lacks.empty(),
       !lacks.empty()       ? lacks
       : lacks_load.empty() ? hardly
                            : lacks_load + "; from the motors alone where the rig file has gears"},
      {"identify", lacks.empty(), lacks.empty() ? hardly : lacks},
      {"trace_residual", lacks.empty(), lacks.empty() ? hardly : lacks},
      {"detect_changes", lacks.empty(), lacks.empty() ? hardly : lacks}};
  for (const diagnosis::DiagnosisMethod& method : diagnosis::diagnosis_method_table())
    all.push_back(
        {method.name, false, "is of one joint alone; the joints of an arm are read by diagnose_record"});
  refuse_all(all, first_refusal(file));
  return all;
}

}  // namespace

std::vector<Serves> serves_of(const report::CheckedFile& file, const record::Record& record,
                              const std::optional<rig_file::RigFile>& rig) {
  std::vector<Serves> methods, all;
  const std::string refusal = first_refusal(file);
  for (const diagnosis::DiagnosisMethod& method : diagnosis::diagnosis_method_table())
    methods.push_back(refusal.empty() ? method_of(method, record, rig) : Serves{method.name, false, refusal});
  std::vector<std::string> able;
  for (const Serves& method : methods)
    if (method.ok) able.push_back(method.name);
  all.push_back(
      {"diagnose_record", !able.empty(), able.empty() ? "no method can use it" : "by " + joined(able)});
  for (const char* command : {"identify", "trace_residual", "detect_changes"})
    all.push_back(fit_of(command, record, rig));
  refuse_all(all, refusal);
  all.insert(all.end(), methods.begin(), methods.end());
  return all;
}

Looked look_at_joints(std::vector<record::JointRecord> joints, const std::string& path,
                      const std::optional<Channel>& drive, bool for_plot) {
  std::vector<record::JointRecord> recorded;
  if (for_plot) recorded = joints;
  Looked looked{checked_joints(joints, path), {}};
  looked.serves = serves_of(looked.file, joints, drive);
  looked.recorded = std::move(recorded);
  return looked;
}

int report_of(const Looked& looked, const Arguments& arguments) {
  if (arguments.has("json"))
    write_text(arguments.text("json"), report::record_check_json(looked.file, looked.serves));
  std::cout << report::record_check_text(looked.file, looked.serves) << std::flush;
  if (arguments.has("plot"))
    plot_check(report::record_check_series(looked.file, looked.recorded, looked.linear),
               arguments.text("plot"));
  int code = kHealthy;
  for (const record::Finding& finding : looked.file.findings()) {
    if (finding.consequence == record::Consequence::refused) return kInconclusive;
    if (finding.consequence == record::Consequence::cut) code = kWatch;
  }
  return code;
}

}  // namespace backlash::tools
