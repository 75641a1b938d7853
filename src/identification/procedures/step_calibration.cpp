// SPDX-License-Identifier: BSD-3-Clause
// Scale and offset between the sensors of motor and load.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kSuspicious = 3;          // choice: standard errors
constexpr std::size_t kTracePoints = 400;  // choice: of a plot

CalibrationTrace thinned(const record::Record& record) {
  CalibrationTrace trace{record.name, {}, {}};
  const auto &motor = record.column(record::Channel::motor_position),
             &load = record.column(record::Channel::load_position);
  for (std::size_t k = 0; k < motor.size(); k += motor.size() / kTracePoints + 1) {
    trace.motor.push_back(motor[k]);
    trace.difference.push_back(motor[k] - load[k]);
  }
  return trace;
}

/// rad: by how much the teeth of the rig file yield between the largest torques of either sign. A torque that
/// follows the position, as that of an inertia on the way between two poses, makes a scale of it.
double wind_up(const std::vector<record::Record>& records, const model::Rig& rig) {
  double largest = 0;  // N m
  for (const record::Record& record : records)
    for (const double torque : record.column(record::Channel::motor_torque))
      largest = std::max(largest, std::fabs(torque));
  const double lever = rig.mesh.lever();
  return 2 * rig.mesh.contact->static_penetration(largest / lever) / lever;
}

}  // namespace

ProcedureReport run_sensor_calibration(IdentificationCase& c) {
  ProcedureReport report{"sensor_calibration", {}, ""};
  std::vector<record::Record> one_way;
  report.records = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    calibrate_position({r.record});
    one_way.push_back(r.record);
    c.result.calibration_traces.push_back(thinned(r.record));
  });
  const PositionCalibration position = calibrate_position(one_way);
  c.result.position_calibration = position;
  report.message = "load = " + plus_minus(position.scale, "") + "times motor";
  if (std::fabs(position.scale.value - 1) >
      kSuspicious * position.scale.standard_error + wind_up(one_way, c.declared) / position.travel)
    c.result.warnings.push_back(
        "the position sensors differ in scale: load = " + plus_minus(position.scale, "") + "times motor");
  for (const record::Record& record : one_way) {
    if (!record.has(record::Channel::motor_velocity) || !record.has(record::Channel::load_velocity)) continue;
    try {
      c.result.speed_calibration = calibrate_speed(record);
      break;
    } catch (const CannotIdentify&) {  // one of the runs is enough, and none is needed
    }
  }
  return report;
}

}  // namespace backlash::identification
