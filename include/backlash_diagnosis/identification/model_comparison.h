// SPDX-License-Identifier: BSD-3-Clause
// How well several models predict a record, as in Chapter 6 of Yumrukcal (2013): speed difference and
// position difference between motor and load, for a mesh without gap, with a constant one, with one that
// varies with the load position.
//
// Two ways of driving a model:
//   followed   its load is driven by the recorded motor position through the whole record (output_error.h):
//   the
//              model never leaves the record, and what differs is what it says of load and torque. Torque and
//              deflection are low-passed.
//   free       the whole machine is driven by the recorded torque alone, as the thesis does, through one
//              engagement after the other: from just before the teeth leave a flank to the end of the ringing
//              on the other one. Each begins at the recorded motor and at the load that followed it in this
//              model, so that differences do not pile up. Raw samples.
// What belongs to the record and not to the machine is fitted to the record: the offset of the encoders for
// each model, as the thesis shifts its limits; delay and hold of the torque as the model has them that
// predicts the torque best, for all.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/identification/fit/output_error.h"

namespace backlash::identification {

struct ComparisonSettings {
  double cutoff = 60;    // Hz, low-pass of torque and deflection of the followed model
  double before = 0.02;  // s, from the start of an engagement to where the teeth are between the flanks
  double after = 0.15;   // s, from there to its end; sooner where the next one begins
};

struct ChannelComparison {
  std::string unit;
  double error = 0, floor = 0;  // -, relative as ChannelError; floor: what noise alone leaves
  double rms = 0, peak = 0;     // of measured minus predicted, in the unit
};

/// Where the teeth change flanks.
struct Engagement {
  double time = 0;                           // s of the record, deflection in the middle of its range
  double load_position = 0;                  // rad
  int direction = 0;                         // +1: to the flank that drives forward
  std::size_t from = 0, middle = 0, to = 0;  // samples: [from, to)
};

/// One engagement in one model: first peak of the speed difference motor - load, then its ringing.
struct EngagementPeak {
  double measured = 0, predicted = 0;  // rad/s, > 0 towards the flank
  // Ringing between the teeth after that peak; NaN where no damped sine fits.
  double measured_frequency, predicted_frequency;          // Hz
  double measured_damping_ratio, predicted_damping_ratio;  // -
};

/// For plots. Deflection and speed difference as followed are whole records; the free ones NaN between
/// engagements.
struct ComparisonTraces {
  std::vector<double> deflection;             // rad, low-passed, followed
  std::vector<double> free_deflection;        // rad
  std::vector<double> free_speed_difference;  // rad/s
};

struct ModelComparison {
  Calibration calibration;
  std::map<std::string, ChannelComparison> followed;  // torque, deflection, speed_difference
  std::map<std::string, ChannelComparison> free;      // motor_speed, deflection, speed_difference
  std::vector<EngagementPeak> peaks;                  // one per engagement
  double peak_ratio;                                  // predicted over measured first peak, median
  double frequency_ratio, damping_ratio;              // the same of the ringing
  ComparisonTraces traces;
};

/// The record as all models are compared with; load side.
struct ComparedRecord {
  ServoData data;
  std::vector<double> time;            // s
  std::vector<double> deflection;      // rad, low-passed
  std::vector<double> raw_deflection;  // rad
  std::vector<double> motor_speed, load_speed,
      speed_difference;  // rad/s; as recorded, else from the positions
  std::vector<Engagement> engagements;
};

/// The record needs motor_torque and both positions. Throws CannotIdentify, BadData; the rig says which side
/// of the reduction the record is from.
ComparedRecord compared_record(const record::Record& record, const model::Rig& rig,
                               const ComparisonSettings& settings = {});

/// One result per rig, in their order. Throws InvalidParameter for a rig that is not one of two inertias or
/// has no contact stiffness, IntegrationError, CannotIdentify; Cancelled.
std::vector<ModelComparison> compare_models(const std::vector<model::Rig>& rigs, const ComparedRecord& record,
                                            const ComparisonSettings& settings = {},
                                            const Progress& progress = nullptr);

}  // namespace backlash::identification
