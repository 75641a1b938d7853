// SPDX-License-Identifier: BSD-3-Clause
#include "trace_contributions.h"

#include <algorithm>

#include "backlash_diagnosis/model/axis_unit.h"

namespace backlash::findings {
namespace {

/// Torque of dry friction at this speed.
double friction(const model::FrictionLimits& limits, double speed) {
  if (speed == 0) return 0;
  return speed > 0 ? -limits.forward : limits.backward;
}

double opening(const model::Term& term, const model::Motion& m, double half_gap, int side) {
  model::FlankShift shift;
  term.shape({m.motor_position, m.load_position, half_gap, m.mesh_torque, side}, shift);
  return shift.opening;
}

model::Motion motion(const identification::TraceSeries& s, std::size_t k) {
  return {s.time[k],          s.motor_position[k], s.motor_velocity[k],
          s.load_position[k], s.load_velocity[k],  s.mesh_torque[k]};
}

bool changes(const Contribution& c) {
  return std::any_of(c.values.begin(), c.values.end(), [&](double v) { return v != c.values.front(); });
}

}  // namespace

std::vector<Contribution> contributions(const model::Rig& augmented, const std::vector<std::size_t>& terms,
                                        const identification::TraceSeries& series) {
  const bool linear = augmented.linear;
  const std::string torque = linear ? "force" : "torque", unit = model::axis_unit("N m", linear),
                    angle = model::axis_unit("rad", linear);
  std::vector<Contribution> all = {{torque + " on the motor", unit, {}},
                                   {torque + " on the load", unit, {}},
                                   {"opening of the forward flank", angle, {}},
                                   {"opening of the backward flank", angle, {}}};
  if (series.load_position.empty() || series.load_velocity.empty() || series.mesh_torque.empty()) return {};
  const double half_gap = augmented.mesh.rigid ? 0 : 0.5 * augmented.mesh.backlash / augmented.mesh.lever();
  for (std::size_t k = 0; k < series.time.size(); ++k) {
    const model::Motion m = motion(series, k);
    double sum[4] = {};
    for (const std::size_t place : terms) {
      const model::Term& term = *augmented.terms.at(place);
      model::EndTorques ends;
      model::EndFriction dry;
      term.add(m, ends);
      term.add_friction(m, dry);
      sum[0] += ends.motor + friction(dry.motor, m.motor_velocity);
      sum[1] += ends.load + friction(dry.load, m.load_velocity);
      if (!term.shapes_flanks()) continue;
      sum[2] += opening(term, m, half_gap, 1);
      sum[3] += opening(term, m, half_gap, -1);
    }
    for (int i = 0; i < 4; ++i) all[std::size_t(i)].values.push_back(sum[i]);
  }
  all.erase(std::remove_if(all.begin(), all.end(), [](const Contribution& c) { return !changes(c); }),
            all.end());
  return all;
}

}  // namespace backlash::findings
