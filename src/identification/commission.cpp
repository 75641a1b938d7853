// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/rig_file/known_values.h"

namespace backlash::identification {
namespace {

constexpr double kNormal95 = 1.96;                   // theory: standard deviations of 95 %, both ends
constexpr double kGainSpreads = 1, kGainErrors = 3;  // choice, as the verdict of `waveform` names values

const char* unit_of_gap(const diagnosis::WaveformSettings& machine) {
  return machine.angular ? "rad" : "m";
}

/// By which share of the torque the sensor's gain is off; 0 where that is within its declared uncertainty.
double torque_in_doubt(const diagnosis::WaveformSettings& declared,
                       const diagnosis::WaveformCommissioning& found) {
  const double off = std::abs(std::log(found.machine.sensor_gain / declared.sensor_gain));
  const bool clear = off > kGainSpreads * declared.spread.sensor_gain &&
                     off > kGainErrors * found.machine.spread.sensor_gain;
  return clear ? off : 0;
}

/// Of what a torque over a motion determines.
bool is_torque(const std::string& unit) {
  return unit.find('N') != std::string::npos || unit.find("kg") != std::string::npos;
}

void put_parameters(Identification& result, const diagnosis::WaveformCommissioning& found, double doubt) {
  for (const diagnosis::WaveformQuantity& q : diagnosis::waveform_quantities()) {
    if (!q.in(found.machine)) continue;
    const double value = found.machine.*q.at, spread = found.machine.spread.*q.spread;
    const double common = scale_power(q, found.machine) * found.machine.common_scale;
    const double error = q.factor ? value * std::hypot(spread, common) : spread;
    const std::string unit = q.unit_in(found.machine);
    result.parameters[q.name] = {value, is_torque(unit) ? std::hypot(error, doubt * value) : error};
    result.units[q.name] = unit;
  }
  const diagnosis::WaveformCommissioning::State& first = found.states.front();
  const char* const gap = found.machine.angular ? "backlash_angle" : "backlash";
  result.parameters[gap] = {first.backlash,
                            std::hypot(first.backlash * first.log_error, found.machine.finest() / kNormal95)};
  result.units[gap] = unit_of_gap(found.machine);
}

void warn(Identification& result, const diagnosis::WaveformCommissioning& found, double doubt) {
  if (doubt > 0)
    result.warnings.push_back(fmt::format(
        "the torque sensor reads {:.3g} times what it should by motor_torque: if the sensor is right, "
        "inertias, stiffnesses, damping and friction are wrong by {:.2g} %, which is part of their errors",
        found.machine.sensor_gain, 100 * doubt));
  if (!found.undetermined.empty())
    result.warnings.push_back("the records do not determine " + joined(found.undetermined) +
                              ": what the rig file says of it is kept");
  for (const diagnosis::WaveformCommissioning::State& state : found.states)
    if (!state.position) {
      result.warnings.push_back(fmt::format(
          "torque alone does not give the scale of inertias, stiffnesses and play: all are known to "
          "{:.2g} % together; a record with motor_position or a backlash declared with its uncertainty "
          "sharpens it",
          100 * found.machine.common_scale));
      break;
    }
}

}  // namespace

Identification commission(const rig_file::RigFile& file, const std::vector<record::Record>& records) {
  const bool known = file.backlash_error.has_value();
  Identification result;
  result.rig = file.rig;
  result.commissioning =
      diagnosis::commission_waveform(records, *file.diagnosis.waveform, known ? file.rig.mesh.backlash : kNaN,
                                     known ? *file.backlash_error : kNaN);
  const diagnosis::WaveformCommissioning& found = *result.commissioning;
  ProcedureReport report{"waveform", {}, ""};
  static const char* const kNames[] = {"torque", "position"};
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto& state = found.states[i];
    report.records.push_back(records[i].name);
    report.message += fmt::format("{}{}: backlash {:.4g} {}", i > 0 ? "; " : "", records[i].name,
                                  state.backlash, unit_of_gap(found.machine));
    for (std::size_t c = 0; c < (state.position ? 2U : 1U); ++c)
      result.channels[kNames[c]] = {state.residual[c], state.noise[c]};
  }
  result.procedures.push_back(report);
  const double doubt = torque_in_doubt(*file.diagnosis.waveform, found);
  put_parameters(result, found, doubt);
  warn(result, found, doubt);
  return result;
}

}  // namespace backlash::identification
