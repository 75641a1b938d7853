// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/diagnose.h"

#include <algorithm>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/apd_shape.h"
#include "backlash_diagnosis/diagnosis/declared_lock.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "doubted_declaration.h"

namespace backlash::diagnosis {
namespace {

Estimate not_served(const std::string& reason) {
  Estimate estimate;
  estimate.message = reason;
  return estimate;
}

ApdSettings read_apd(const YamlReader& yaml) {
  ApdSettings apd;
  std::vector<std::string> names;
  names.reserve(record::kChannels.size());
  for (record::Channel channel : record::kChannels) names.push_back(record::channel_name(channel));
  apd.signal = record::channel_from_name(yaml.choice("signal", names));
  apd.period = yaml.number_or("period", 0, Range::positive());
  apd.settling_periods = static_cast<int>(yaml.integer("settling_periods", 0, 1'000'000));
  apd.layout = read_apd_layout(yaml);
  return apd;
}

LostMotionSettings read_lost_motion(const YamlReader& yaml) {
  LostMotionSettings lost_motion;
  lost_motion.torque = yaml.number("torque", Range::positive());
  lost_motion.subtract_elastic_deflection =
      yaml.choice("elastic_deflection", {"included", "subtracted"}) == "subtracted";
  lost_motion.elastic_uncertainty = yaml.number_or("elastic_uncertainty", kNaN, Range::not_negative());
  return lost_motion;
}

Estimate not_locked(const std::string& reason) {
  Estimate estimate;
  estimate.status = Status::out_of_domain;
  estimate.message = reason;
  return estimate;
}

/// What the rig file says of a locked output; checks nothing where the output is free or no limits are given.
DeclaredLock declared_lock(const DiagnosisSettings& settings) {
  DeclaredLock lock;
  const auto& rig = settings.position_difference;
  if (!rig || !rig->output_locked || !settings.limits) return lock;
  lock.elastic_deflection = rig->elastic_deflection;
  lock.play = settings.limits->angular ? settings.limits->stop : settings.limits->stop / rig->base_radius;
  return lock;
}

template <Estimate (*Estimator)(const ApdResult&, const CurveMatch&, const MonitoringCurve*)>
Estimate by_apd(const DiagnosisInput& in) {
  if (!in.settings.apd) return not_served("the rig file declares no diagnosis.apd");
  Estimate estimate = in.lock_contradicted && !in.match.refused ? not_locked(*in.lock_contradicted)
                                                                : Estimator(*in.apd, in.match, in.curve);
  estimate.witness = "distribution";
  return estimate;
}

Estimate by_lost_motion(const DiagnosisInput& in) {
  if (!in.settings.lost_motion) return not_served("the rig file declares no diagnosis.lost_motion");
  if (in.lock_contradicted) return not_locked(*in.lock_contradicted);
  return estimate_lost_motion(in.record, *in.settings.lost_motion);
}

Estimate by_position_difference(const DiagnosisInput& in) {
  if (!in.settings.position_difference) return not_served("the rig has no elastic deflection to go by");
  if (in.lock_contradicted) return not_locked(*in.lock_contradicted);
  return estimate_position_difference(in.record, *in.settings.position_difference);
}

Estimate by_momentum_transfer(const DiagnosisInput& in) {
  if (!in.settings.momentum_transfer) return not_served("the rig file declares no inertia");
  if (in.lock_contradicted) return not_locked(*in.lock_contradicted);
  return estimate_momentum_transfer(in.record, *in.settings.momentum_transfer);
}

Estimate by_waveform(const DiagnosisInput& in) {
  if (!in.settings.waveform) return not_served(in.settings.no_waveform);
  if (in.lock_contradicted) return not_locked(*in.lock_contradicted);
  return estimate_waveform(in.record, *in.settings.waveform);
}

Estimate by_gap_traverse(const DiagnosisInput& in) {
  if (!in.settings.gap_traverse) return not_served(in.settings.no_gap_traverse);
  return estimate_gap_traverse(in.record, *in.settings.gap_traverse);
}

CoherenceSettings read_coherence(const YamlReader& yaml) {
  CoherenceSettings coherence;
  coherence.segment = yaml.number("segment", Range::positive());
  coherence.response = record::channel_from_name(yaml.choice(
      "response", {"motor_velocity", "motor_position", "load_velocity", "load_position", "acceleration"}));
  coherence.lower = yaml.number_or("lower", kNaN, Range::positive());
  coherence.upper = yaml.number_or("upper", kNaN, Range::positive());
  if (const auto healthy = yaml.optional_map("baseline"))
    coherence.baseline = CoherenceBaseline{
        healthy->number("loss", Range::between(0, 1)), healthy->number("deviation", Range::not_negative()),
        healthy->number("lower", Range::positive()), healthy->number("upper", Range::positive())};
  return coherence;
}

}  // namespace

DiagnosisSettings read_diagnosis_settings(const YamlReader& yaml) {
  DiagnosisSettings settings;
  settings.stiffness_uncertainty = yaml.number_or("stiffness_uncertainty", 0, Range::between(0, 0.2));
  if (const auto apd = yaml.optional_map("apd")) settings.apd = read_apd(*apd);
  if (const auto lost_motion = yaml.optional_map("lost_motion"))
    settings.lost_motion = read_lost_motion(*lost_motion);
  if (const auto coherence = yaml.optional_map("coherence")) settings.coherence = read_coherence(*coherence);
  if (const auto limits = yaml.optional_map("limits")) settings.limits = read_limits(*limits);
  return settings;
}

const std::vector<DiagnosisMethod>& diagnosis_method_table() {
  using record::Channel;
  static const std::vector<DiagnosisMethod> methods = {
      {"apd_skewness", {}, "a monitoring curve", true, by_apd<estimate_apd_skewness>},
      {"apd_shape", {}, "a monitoring curve", true, by_apd<estimate_apd_shape>},
      {"lost_motion",
       {{Channel::motor_position}, {Channel::motor_torque, Channel::sensor_torque}},
       "output locked",
       false,
       by_lost_motion},
      {"position_difference",
       {{Channel::motor_position},
        {Channel::load_position},
        {Channel::motor_torque, Channel::sensor_torque, Channel::output_torque}},
       "",
       false,
       by_position_difference},
      {"momentum_transfer",
       {{Channel::motor_velocity, Channel::motor_position}},
       "motor_torque, unless that is a square wave",
       false,
       by_momentum_transfer},
      {"gap_traverse",
       {{Channel::motor_torque}, {Channel::motor_position}},
       "load free, moves that reverse under load",
       false,
       by_gap_traverse},
      {"waveform",
       {{Channel::motor_torque}, {Channel::sensor_torque}},
       "torque that reverses; motor_position sharpens it",
       false,
       by_waveform},
  };
  return methods;
}

namespace {

/// "a, b or c"
std::string any_of(const std::vector<record::Channel>& group) {
  std::string text;
  for (std::size_t i = 0; i < group.size(); ++i)
    text += (i == 0 ? "" : i + 1 == group.size() ? " or " : ", ") + record::channel_name(group[i]);
  return text;
}

}  // namespace

std::string needs_of(const DiagnosisMethod& method) {
  std::string text = method.channels.empty() ? "the signal of diagnosis.apd" : "";
  for (const std::vector<record::Channel>& group : method.channels)
    text += (text.empty() ? "" : group.size() > 1 ? ", and " : ", ") + any_of(group);
  return method.more.empty() ? text : text + "; " + method.more;
}

std::string lacking_channel(const DiagnosisMethod& method, const record::Record& record,
                            const std::optional<ApdSettings>& apd) {
  std::vector<std::vector<record::Channel>> groups = method.channels;
  if (groups.empty()) {
    if (!apd) return "a signal that diagnosis.apd of a rig file names";
    groups = {{apd->signal}};
  }
  for (const std::vector<record::Channel>& group : groups)
    if (std::none_of(group.begin(), group.end(),
                     [&](record::Channel channel) { return record.has(channel); }))
      return any_of(group);
  return "";
}

const std::vector<std::string>& diagnosis_methods() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const DiagnosisMethod& method : diagnosis_method_table()) all.push_back(method.name);
    return all;
  }();
  return names;
}

bool needs_curve(const std::string& method) {
  for (const DiagnosisMethod& each : diagnosis_method_table())
    if (each.name == method) return each.by_curve;
  return false;
}

Diagnosis diagnose(const record::Record& record, const DiagnosisSettings& settings,
                   const MonitoringCurve* curve, const std::optional<Baseline>& baseline,
                   const std::string& method) {
  const PeriodWindow window =
      settings.apd ? cut_periods(record, settings.apd) : PeriodWindow{record, 0, 0, {}};
  return diagnose(window, settings, curve, baseline, method);
}

Diagnosis diagnose(const PeriodWindow& window, const DiagnosisSettings& settings,
                   const MonitoringCurve* curve, const std::optional<Baseline>& baseline,
                   const std::string& method) {
  const record::Record& record = window.record;
  const auto& methods = diagnosis_methods();
  if (!method.empty() && std::find(methods.begin(), methods.end(), method) == methods.end())
    throw InvalidParameter("method", method, "must be one of " + joined(methods));
  Diagnosis diagnosis;
  if (settings.apd) diagnosis.apd = analyse_apd(window, *settings.apd);
  CurveMatch match;
  if (settings.apd) match = match_curve(record, *diagnosis.apd, *settings.apd, curve);
  diagnosis.mismatch = match.mismatch;
  diagnosis.lock_contradicted = lock_contradicted(record, declared_lock(settings));
  const DiagnosisInput input{record, settings, curve, diagnosis.apd, match, diagnosis.lock_contradicted};
  for (const DiagnosisMethod& each : diagnosis_method_table()) {
    if (!method.empty() && method != each.name) continue;
    diagnosis.estimates.push_back(
        record.time.empty() ? not_served("no whole excitation period after settling") : each.estimate(input));
    diagnosis.estimates.back().method = each.name;
  }
  doubt_declared_values(diagnosis.estimates);
  if (settings.coherence) diagnosis.coherence = detect_nonlinearity(record, *settings.coherence);
  diagnosis.verdict = combine(diagnosis.estimates, settings.limits, baseline);
  return diagnosis;
}

}  // namespace backlash::diagnosis
