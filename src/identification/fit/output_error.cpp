// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/output_error.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "calibration.h"
#include "missing_effects.h"
#include "multi_start.h"
#include "valley.h"

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

constexpr double kFewestPasses = 3;  // theory: in a single one to and fro a drift looks like play
constexpr double kLockDelay =
    0.5;  // theory: samples, between a torque that is held and one of the moment; more is an effect
constexpr double kLockTolerance = 1e-5;  // theory: of 10^3 squares, that of a tenth of a standard error

/// Beside what is asked of a machine with a locked link: damping of the teeth, which is declared and shows
/// like a delay, offset of the torque, which a preloaded mesh feels, and drift of the encoder.
void know_lock(Machine& machine, const std::vector<ServoData>& data) {
  start_in_travel(machine, data);
  machine.largest_delay = kLockDelay;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    const bool damps =
        p.kind == rig_file::ParameterKind::damping || p.kind == rig_file::ParameterKind::damping_factor;
    const double value = p.get(machine.rig);
    if (!damps || !p.known_to(machine.rig) || !(value > 0)) continue;
    machine.parameters.push_back(machine_parameter(p.name, machine.rig));
    machine.priors.emplace_back([get = p.get, value](const model::Rig& rig) {
      return std::log(get(rig) / value) / kDeclaredUncertainty;
    });
  }
  for (const ServoData& d : data) {
    const double duration = double(d.size()) * d.interval;
    machine.torque_offset = std::max(machine.torque_offset, model::usual_torque(d.torque));
    if (duration > kFewestPasses * time_between_reversals(d))
      machine.encoder_drift = std::max(machine.encoder_drift, signal::extent(d.motor).size() / duration);
  }
}

Machine start_machine(const model::Rig& rig, const std::vector<ServoData>& records,
                      const OutputErrorSettings& settings, bool locked) {
  Machine machine;
  machine.rig = rig;
  machine.calibrations.resize(records.size());
  if (locked) know_lock(machine, records);
  if (simulation::load_moves_freely(rig))  // zeros of encoders may lie many gaps apart
    for (std::size_t i = 0; i < records.size(); ++i)
      machine.calibrations[i].encoder_offset = middle_offset(records[i]);
  for (const std::string& name : settings.parameters)
    machine.parameters.push_back(machine_parameter(name, machine.rig));
  if (rig.coupled) machine.priors = rows_as_declared(rig);
  for (const Finding& finding : settings.findings) machine.priors.push_back(prior_row(finding));
  return machine;
}

constexpr double kVanishes = 2;  // choice: standard errors, below which a play may be none

bool is_play(const FitParameter& p) {
  return p.name == rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::backlash).name;
}

/// Teeth without play differ from those with a little: no force jumps when they change flanks.
/// So where the play vanishes it is compared with the fit that has some. Nothing where that leaves less.
std::optional<BandFit> without_play(const BandFit& fitted, const std::vector<ServoData>& records,
                                    const FitSettings& settings) {
  Machine machine = fitted.start;
  const auto play = std::find_if(machine.parameters.begin(), machine.parameters.end(), is_play);
  if (play == machine.parameters.end()) return std::nullopt;
  const signal::Measured found =
      Unknowns(fitted.start).parameter(fitted.fit, std::size_t(play - machine.parameters.begin()));
  if (!(found.value < kVanishes * found.standard_error)) return std::nullopt;
  play->set(machine.rig, 0);
  machine.parameters.erase(play);
  BandFit other = fit_to_records(records, machine, settings);
  const auto left = [&](const MachineFit& fit) {
    return fitted.records.rows(fit.machine.rig, fit.machine.calibrations).norm();
  };
  if (!(left(other.fit) <= left(fitted.fit))) return std::nullopt;
  judge_errors(other.fit, other.start, other.records);
  return other;
}

}  // namespace

OutputError fit_output_error(const model::Rig& start, const std::vector<ServoData>& records,
                             const OutputErrorSettings& asked) {
  FitSettings settings = with_bands(asked.fit, start, records);
  const bool locked = start.link_locked && !asked.parameters.empty();
  if (locked) {
    settings.tolerance = kLockTolerance;
    settings.calibration_delay = kLockDelay;
  }
  BandFit fitted = fit_to_records(records, start_machine(start, records, asked, locked), settings);
  const std::map<std::string, double> valley = search_valley(fitted, settings);
  judge_errors(fitted.fit, fitted.start, fitted.records);
  OutputError result;
  if (auto other = without_play(fitted, records, settings)) {
    const auto play = std::find_if(fitted.start.parameters.begin(), fitted.start.parameters.end(), is_play);
    const signal::Measured least = Unknowns(fitted.start).parameters(fitted.fit).at(play->name);
    result.parameters[play->name] = {0, least.value + least.standard_error};
    fitted = std::move(*other);
  }
  if (locked) {
    correct_for_noise_of_motion(fitted.fit, fitted.start, fitted.records);
    allow_for_hold(fitted.fit, fitted.start);
    result.lacking = allow_for_effects(fitted.fit, fitted.start, fitted.records);
  }
  allow_for_misfit(fitted.fit, fitted.records);
  const Machine& machine = fitted.fit.machine;
  result.rig = machine.rig;
  for (const auto& [name, value] : Unknowns(fitted.start).parameters(fitted.fit))
    result.parameters[name] = value;
  for (const auto& [name, error] : valley)
    result.parameters.at(name).standard_error = std::hypot(result.parameters.at(name).standard_error, error);
  for (std::size_t r = 0; r < records.size() && locked; ++r)
    result.torque_offsets.push_back(Unknowns(fitted.start).torque_offset(fitted.fit, r));
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
