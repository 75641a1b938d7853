// SPDX-License-Identifier: BSD-3-Clause
// Mesh damping from the ringing after engagements.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kDecayModel = 0.01;  // simulation: the contact's own damping at the start of a ringing

double relative(const signal::Measured& m) {
  return m.standard_error / m.value;
}

/// Torque that jumps by half of its range several times.
bool is_square(const record::Record& record) {
  const std::vector<double>& torque = record.column(record::Channel::motor_torque);
  const double half = 0.5 * signal::peak_to_peak(torque);
  int jumps = 0;
  for (std::size_t k = 1; k < torque.size(); ++k) jumps += std::fabs(torque[k] - torque[k - 1]) > half;
  return jumps >= 3;
}

}  // namespace

ProcedureReport run_decay(IdentificationCase& c) {
  ProcedureReport report{"decay", {}, ""};
  const model::Rig& rig = c.result.rig;
  const double motor = rig.motor.inertia, load = rig.link.inertia;
  DecaySettings settings;
  settings.stiffness = known(c, "mesh_stiffness");
  const double reduced = motor * load / (motor + load);
  settings.reduced_inertia = {
      reduced, reduced * std::hypot(load / (motor + load) * relative(known(c, "motor_inertia")),
                                    motor / (motor + load) * relative(known(c, "load_inertia")))};
  settings.bearing_damping =
      reduced * reduced *
      (rig.motor.viscous_damping / (motor * motor) + rig.link.viscous_damping / (load * load));
  std::vector<DecayIdentification> all;
  report.records = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    if (!is_square(r.record)) throw CannotIdentify("no square wave of torque");
    all.push_back(identify_decay(r.record, settings));
  });
  for (const DecayIdentification& d : all)
    add_finding(c, report.name, {{"mesh_damping", 1}}, with_model_error(d.damping, kDecayModel));
  report.message = "damping " + plus_minus(all.front().damping, "N m s/rad") + " from " +
                   std::to_string(all.front().ringings.size()) + " engagements";
  c.result.decay = std::move(all.front());
  return report;
}

}  // namespace backlash::identification
