// SPDX-License-Identifier: BSD-3-Clause
#include "calibration.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {
namespace {

constexpr double kHold =
    0.5;  // samples, theory: mean delay of a torque that is held from its sample to the next
constexpr double kBetween = 0.25;  // samples, theory: half way between held and of the moment

}  // namespace

void release_hold(Machine& machine) {
  for (Calibration& c : machine.calibrations) {
    if (!c.held || c.torque_delay >= -kBetween) continue;
    c.held = false;
    c.torque_delay += kHold;
  }
}

void restore_hold(Machine& machine) {
  for (Calibration& c : machine.calibrations) {
    if (c.held || c.torque_delay <= kBetween) continue;
    c.held = true;
    c.torque_delay -= kHold;
  }
}

void limit_delay(Machine& machine, double longest) {
  machine.largest_delay = longest;
  for (Calibration& c : machine.calibrations) {
    if (std::fabs(c.torque_delay) > longest) machine.largest_delay = 0;
    c.torque_delay = std::clamp(c.torque_delay, -longest, longest);
  }
}

double middle_offset(const ServoData& record) {
  std::vector<double> offsets(record.size());
  for (std::size_t k = 0; k < record.size(); ++k) offsets[k] = record.load[k] - record.motor[k];
  return signal::median(std::move(offsets));
}

void without_calibration(Machine& machine) {
  machine.largest_delay = 0;
  for (Calibration& c : machine.calibrations) c.torque_delay = 0;
}

void move_delay_to_term(Machine& machine, double interval) {
  double mean = 0;
  for (const Calibration& c : machine.calibrations)
    mean += c.torque_delay / double(machine.calibrations.size());
  std::shared_ptr<const model::Term>& term = machine.rig.terms.back();
  ParameterValues values = term->values;
  values[model::term_type(term->id).search->strength] += mean * interval;
  term = model::make_term(term->id, values);
  without_calibration(machine);
}

void start_in_travel(Machine& machine, const std::vector<ServoData>& data) {
  double& gap = machine.rig.mesh.backlash;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const auto [low, high] = signal::extent(data[i].motor);
    machine.calibrations[i].encoder_offset = -0.5 * (low + high);
    gap = std::min(gap, 0.5 * (high - low) * machine.rig.mesh.lever());
  }
}

}  // namespace backlash::identification
