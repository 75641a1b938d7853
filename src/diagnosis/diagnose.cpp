#include "backlash_diagnosis/diagnosis/diagnose.h"

#include <algorithm>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash {
namespace {

Estimate not_served(const std::string& method, const std::string& reason) {
  Estimate estimate;
  estimate.method = method;
  estimate.message = reason;
  return estimate;
}

ApdSettings read_apd(const YamlReader& yaml) {
  ApdSettings apd;
  std::vector<std::string> names;
  for (Channel channel : kChannels) names.push_back(channel_name(channel));
  apd.signal = channel_from_name(yaml.choice("signal", names));
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
  return lost_motion;
}

}  // namespace

DiagnosisSettings read_diagnosis_settings(const YamlReader& yaml) {
  DiagnosisSettings settings;
  if (const auto apd = yaml.optional_map("apd")) settings.apd = read_apd(*apd);
  if (const auto lost_motion = yaml.optional_map("lost_motion"))
    settings.lost_motion = read_lost_motion(*lost_motion);
  if (const auto limits = yaml.optional_map("limits")) settings.limits = read_limits(*limits);
  return settings;
}

DiagnosisSettings without_settling(DiagnosisSettings settings) {
  if (settings.apd) settings.apd->settling_periods = 0;
  return settings;
}

const std::vector<std::string>& diagnosis_methods() {
  static const std::vector<std::string> methods = {"apd_skewness", "lost_motion"};
  return methods;
}

Diagnosis diagnose(const Record& record, const DiagnosisSettings& settings, const MonitoringCurve* curve,
                   const std::optional<Baseline>& baseline, const std::string& method) {
  const DiagnosisSettings settled = without_settling(settings);
  if (!settings.apd || !(run_period(record, *settings.apd) > 0))
    return diagnose_settled(record, settled, curve, baseline, method);
  return diagnose_settled(whole_periods(record, *settings.apd).value_or(Record()), settled, curve, baseline,
                          method);
}

Diagnosis diagnose_settled(const Record& record, const DiagnosisSettings& settings,
                           const MonitoringCurve* curve, const std::optional<Baseline>& baseline,
                           const std::string& method) {
  const auto& methods = diagnosis_methods();
  if (!method.empty() && std::find(methods.begin(), methods.end(), method) == methods.end())
    throw InvalidParameter("method", method, "must be one of " + joined(methods));
  const auto wanted = [&method](const std::string& name) { return method.empty() || method == name; };
  Diagnosis diagnosis;
  if (settings.apd) diagnosis.apd = analyse_apd(record, *settings.apd);
  if (record.time.empty()) {
    for (const std::string& name : methods)
      if (wanted(name))
        diagnosis.estimates.push_back(not_served(name, "no whole excitation period after settling"));
    diagnosis.verdict = combine(diagnosis.estimates, settings.limits, baseline);
    return diagnosis;
  }
  if (wanted("apd_skewness"))
    diagnosis.estimates.push_back(settings.apd
                                      ? estimate_apd_skewness(record, *diagnosis.apd, *settings.apd, curve)
                                      : not_served("apd_skewness", "the rig file declares no diagnosis.apd"));
  if (wanted("lost_motion"))
    diagnosis.estimates.push_back(
        settings.lost_motion ? estimate_lost_motion(record, *settings.lost_motion)
                             : not_served("lost_motion", "the rig file declares no diagnosis.lost_motion"));
  diagnosis.verdict = combine(diagnosis.estimates, settings.limits, baseline);
  return diagnosis;
}

}  // namespace backlash
