// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/rig_file/known_values.h"

namespace backlash::identification {
namespace {

const char* unit_of_gap(const diagnosis::WaveformSettings& machine) {
  return machine.angular ? "rad" : "m";
}

void put_parameters(Identification& result, const diagnosis::WaveformCommissioning& found) {
  for (const diagnosis::WaveformQuantity& q : diagnosis::waveform_quantities()) {
    if (!q.in(found.machine)) continue;
    const double value = found.machine.*q.at, spread = found.machine.spread.*q.spread;
    const double common = scale_power(q, found.machine) * found.machine.common_scale;
    const double error = q.factor ? value * std::hypot(spread, common) : spread;
    result.parameters[q.name] = {value, error};
    result.units[q.name] = q.unit_in(found.machine);
  }
  const diagnosis::WaveformCommissioning::State& first = found.states.front();
  const char* const gap = found.machine.angular ? "backlash_angle" : "backlash";
  result.parameters[gap] = {first.backlash, first.backlash * first.log_error};
  result.units[gap] = unit_of_gap(found.machine);
}

void warn(Identification& result, const diagnosis::WaveformCommissioning& found) {
  if (!found.untold.empty())
    result.warnings.push_back("the records do not tell " + joined(found.untold) +
                              ": what the rig file says of it is kept");
  for (const diagnosis::WaveformCommissioning::State& state : found.states)
    if (!state.position) {
      result.warnings.push_back(fmt::format(
          "torque alone does not tell the scale of inertias, stiffnesses and play: all are known to "
          "{:.2g} % together; a record with motor_position or a backlash told with its uncertainty "
          "sharpens it",
          100 * found.machine.common_scale));
      break;
    }
}

}  // namespace

Identification commission(const rig_file::RigFile& file, const std::vector<record::Record>& records) {
  const bool told = file.backlash_error.has_value();
  Identification result;
  result.rig = file.rig;
  result.commissioning =
      diagnosis::commission_waveform(records, *file.diagnosis.waveform, told ? file.rig.mesh.backlash : kNaN,
                                     told ? *file.backlash_error : kNaN);
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
  put_parameters(result, found);
  warn(result, found);
  return result;
}

}  // namespace backlash::identification
