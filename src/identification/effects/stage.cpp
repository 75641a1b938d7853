// SPDX-License-Identifier: BSD-3-Clause
#include "stage.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash {
namespace {

constexpr double kLargestDelay = 0.5;  // samples, that are calibration; more is an effect
constexpr double kUnheld = 0.25;       // samples earlier than a held torque: it is not held
constexpr int kIterations = 12, kMapIterations = 3;

}  // namespace

Stage fit_stage(const std::vector<ServoData>& data, Machine start, double cutoff, double tolerance) {
  RecordSet records(data, cutoff, kLoadFeedback);
  records.weigh(start);
  MachineFit fit = fit_machine(start, records, fit_options(tolerance, !start.beliefs.empty()));
  const Leftover left = records.leftover(fit.machine);
  return {std::move(fit), std::move(start), std::move(records), left};
}

NonlinearOptions fit_options(double tolerance, bool with_map) {
  NonlinearOptions o;
  o.iterations = with_map ? kMapIterations : kIterations;
  o.tolerance = tolerance;
  o.parallel = true;
  return o;
}

double size(const Leftover& left) {
  return std::hypot(left.torque, left.deflection);
}

void tell_held(Machine& machine) {
  for (Calibration& c : machine.calibrations) {
    if (c.held && c.torque_delay < -kUnheld) {
      c.held = false;
      c.torque_delay += 0.5;
    }
  }
}

void tell_held_again(Machine& machine) {
  for (Calibration& c : machine.calibrations) {
    if (!c.held && c.torque_delay > kUnheld) {
      c.held = true;
      c.torque_delay -= 0.5;
    }
  }
}

void limit_delay(Machine& machine) {
  machine.largest_delay = kLargestDelay;
  for (Calibration& c : machine.calibrations) {
    if (std::fabs(c.torque_delay) > kLargestDelay) machine.largest_delay = 0;
    c.torque_delay = std::clamp(c.torque_delay, -kLargestDelay, kLargestDelay);
  }
}

void without_calibration(Machine& machine) {
  machine.largest_delay = 0;
  for (Calibration& c : machine.calibrations) c.torque_delay = 0;
}

void take_over_calibration(Machine& machine, double interval) {
  double mean = 0;
  for (const Calibration& c : machine.calibrations)
    mean += c.torque_delay / double(machine.calibrations.size());
  std::shared_ptr<const Term>& term = machine.rig.terms.back();
  ParameterValues values = term->values;
  values[term_type(term->id).search->strength] += mean * interval;
  term = make_term(term->id, values);
  without_calibration(machine);
}

}  // namespace backlash
