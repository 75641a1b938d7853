// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "../fit/calibration.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/record/encoder_skew.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// All that the rig declares, of the bodies and the mesh that it has.
bool can_be_fitted(const rig_file::RigParameter& p, const model::Rig& rig) {
  if (p.kind == rig_file::ParameterKind::start_in_gap || !p.known_to(rig)) return false;
  if (rig.coupled && !rig_file::shown_by_deflection(p)) return false;
  if (p.part == rig_file::RigPart::link && !simulation::load_moves_freely(rig)) return false;
  return p.get(rig) != 0 || p.kind == rig_file::ParameterKind::encoder_skew;
}

/// The skew of the encoders as the records show it at once, where that is clear: a start for the fit.
void start_with_skew(Machine& machine, const std::vector<ServoData>& data) {
  if (!simulation::load_moves_freely(machine.rig)) return;
  double weights = 0, sum = 0;
  for (const ServoData& d : data) {
    const auto skew = attempted([&] {
      return record::encoder_skew(
          {d.interval, d.torque, d.motor, d.load, model::GearTrain(machine.rig).motor_inertia()});
    });
    if (!skew) continue;
    weights += 1 / std::pow(skew->standard_error, 2);
    sum += skew->value / std::pow(skew->standard_error, 2);
  }
  if (weights == 0) return;
  const signal::Measured skew{sum / weights, 1 / std::sqrt(weights)};
  if (record::is_clear(skew)) machine.rig.encoder_skew = skew.value;
}

}  // namespace

std::vector<FitParameter> declared_parameters(const model::Rig& rig) {
  std::vector<FitParameter> all;
  for (const rig_file::RigParameter& declared : rig_file::servo_parameters()) {
    if (!can_be_fitted(declared, rig)) continue;
    FitParameter p = machine_parameter(declared.name, rig);
    // Without an effect that it lacks a machine may want friction below 0; a logarithm would not come back.
    // With a locked link damping is hardly identifiable and stays where it is.
    if (p.positive && declared.is_friction() && !rig.link_locked && !rig.coupled) {
      p.positive = false;
      p.scale = p.get(rig);
    }
    all.push_back(p);
  }
  return all;
}

Hypothesis fit_declared(const model::Rig& declared, const SearchContext& context) {
  Machine machine;
  machine.rig = declared;
  machine.calibrations.resize(context.data.size());
  if (declared.link_locked) start_in_travel(machine, context.data);
  if (simulation::load_moves_freely(declared))
    for (std::size_t i = 0; i < context.data.size(); ++i)
      machine.calibrations[i].encoder_offset = middle_offset(context.data[i]);
  start_with_skew(machine, context.data);
  machine.parameters = declared_parameters(machine.rig);
  if (declared.coupled) machine.priors = rows_as_declared(declared);
  Hypothesis h;
  h.base = std::make_shared<const BandFit>(fit_to_records(
      context.data, machine, context.settings.fit, [&] { context.report("fit of the declared machine"); }));
  h.declared = std::make_shared<const Machine>(std::move(machine));
  h.fitted = h.base;
  context.report_hypothesis(h);
  return h;
}

}  // namespace backlash::identification
