// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/output_error.h"

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "multi_start.h"

namespace backlash::identification {
namespace {

/// The row of a finding: its distance from what the rig says, in standard errors.
std::function<double(const model::Rig&)> prior_row(const Finding& finding) {
  return [finding](const model::Rig& rig) {
    double value = 0;
    for (const auto& [name, factor] : finding.combination)
      value += factor * rig_file::servo_parameter(name).get(rig);
    return (finding.measured.value - value) / finding.measured.standard_error;
  };
}

Machine start_machine(const model::Rig& rig, std::size_t records, const OutputErrorSettings& settings) {
  Machine machine;
  machine.rig = rig;
  machine.calibrations.resize(records);
  for (const std::string& name : settings.parameters)
    machine.parameters.push_back(machine_parameter(name, rig));
  if (rig.coupled) machine.priors = rows_as_declared(rig);
  for (const Finding& finding : settings.findings) machine.priors.push_back(prior_row(finding));
  return machine;
}

}  // namespace

OutputError fit_output_error(const model::Rig& start, const std::vector<ServoData>& records,
                             const OutputErrorSettings& asked) {
  const FitSettings settings = with_bands(asked.fit, start, records);
  BandFit fitted = fit_to_records(records, start_machine(start, records.size(), asked), settings);
  judge_errors(fitted.fit, fitted.start, fitted.records);
  allow_for_misfit(fitted.fit, fitted.records);
  const Machine& machine = fitted.fit.machine;
  OutputError result;
  result.rig = machine.rig;
  result.parameters = Unknowns(fitted.start).parameters(fitted.fit.fit);
  result.calibrations = machine.calibrations;
  for (std::size_t r = 0; r < records.size(); ++r)
    result.predictions.push_back(predict_servo(machine.rig, records[r], settings, machine.calibrations[r]));
  return result;
}

ServoPrediction predict_calibrated(const model::Rig& rig, const ServoData& data, const FitSettings& asked,
                                   Calibration& calibration) {
  OutputErrorSettings alone;
  alone.fit = with_bands(asked, rig, {data});
  OutputError fit = fit_output_error(rig, {data}, alone);
  calibration = fit.calibrations.front();
  return std::move(fit.predictions.front());
}

}  // namespace backlash::identification
