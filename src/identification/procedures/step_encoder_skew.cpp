// SPDX-License-Identifier: BSD-3-Clause
// The first step of an identification: the load encoder's delay, taken out of the records that all other
// steps read. What is left of it the last step fits.
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/encoder_skew.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

void take_out(IdentificationCase& c, double skew) {
  for (CaseRecord& r : c.records)
    if (r.has_load) r.record = record::without_encoder_skew(std::move(r.record), skew);
  c.skew.value += skew;
}

}  // namespace

ProcedureReport run_encoder_skew(IdentificationCase& c) {
  ProcedureReport report{"encoder_skew", {}, ""};
  take_out(c, c.declared.encoder_skew);
  c.declared.encoder_skew = c.result.rig.encoder_skew = 0;
  double weights = 0, sum = 0;
  report.records = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    if (!r.has_load || !r.record.has(record::Channel::motor_torque))
      throw CannotIdentify("no motor_torque and load_position");
    const signal::Measured skew = record::encoder_skew(
        {r.record.sampling_interval(), r.record.column(record::Channel::motor_torque),
         r.record.column(record::Channel::motor_position), r.record.column(record::Channel::load_position),
         c.declared.motor.inertia + c.declared.pinion.inertia});
    const double weight = 1 / std::pow(skew.standard_error, 2);
    weights += weight;
    sum += weight * skew.value;
  });
  const signal::Measured left{sum / weights, 1 / std::sqrt(weights)};
  if (record::is_clear(left)) take_out(c, left.value);
  c.skew.standard_error = left.standard_error;
  report.message = "the load encoder is late by " +
                   plus_minus({1e3 * (record::is_clear(left) ? c.skew.value : c.skew.value + left.value),
                               1e3 * left.standard_error},
                              "ms");
  return report;
}

}  // namespace backlash::identification
