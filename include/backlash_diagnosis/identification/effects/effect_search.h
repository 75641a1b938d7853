// SPDX-License-Identifier: BSD-3-Clause
// What the model of a machine lacks: from the residual of records to the effect that explains it.
//
// The declared rig is fitted to the training records; then every term that says how it is sought
// (model/term.h) is tried on what is left, and the best is fitted with all parameters of the machine
// together. An effect is accepted where the prediction improves on blocks of the record that the fit has not
// seen. That is repeated until the residual is at the floor that noise alone leaves, or nothing helps. Then a
// learned map may say what no named effect does.
//
// Three kinds of rig: two inertias with a mesh between them and two encoders (the load is simulated, driven
// by the recorded motor; residuals of torque and deflection), one inertia (mesh: rigid) and a locked link
// (torque over the recorded motion). Errors are norm(r) / norm(y - mean(y)) of low-passed signals on the test
// record.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/identification/fit/output_error.h"
#include "backlash_diagnosis/identification/several_machines.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::identification {

struct TraceSettings {
  double cutoff = 0;         // Hz, low-pass of all residuals; 0: that of the machine (fit_settings.h)
  double least_gain = 0.03;  // smallest relative gain, where the residual comes near its noise floor
  double least_gain_unclear =
      0.1;  // the same, where the residual stays far above its noise floor, as on real machines
  std::size_t most_effects = 6;
  BestSoFar best_so_far;  // effects in the model and what they leave; may be empty
};

/// A parameter of an effect, as found.
struct EffectParameter {
  std::string name, unit;
  signal::Measured measured;
};

/// Why an effect is believed. Gains are relative decreases of the norm of the residual of the channel that
/// gains most.
struct Evidence {
  double gain = 0;           // on the training records
  double gain_held_out = 0;  // on blocks left out of the fit
};

/// Relative decrease of the error of the channel on the unseen record, with its 95 % interval (blocks drawn
/// with replacement).
struct TestGain {
  double value = 0, lower = 0, upper = 0;
};

/// One step: an effect that was added.
struct FoundEffect {
  std::string id;
  std::string channel;                       // that gains most
  std::vector<std::size_t> terms;            // places in the augmented rig's terms
  std::map<std::string, std::string> words;  // choices of the term: body, ...
  std::vector<EffectParameter> parameters;   // of a learned map: range and size of its curve
  std::vector<double> curve_x,
      curve_y;  // of a learned map, in the units of its coordinate and its torque or angle
  std::vector<std::string> nearest;  // of a learned map: ids that explain part of the same
  Evidence evidence;
  double test_error_before = 0, test_error_after = 0;  // of the channel
  TestGain test_gain;                                  // of the same
  std::vector<std::string> equivalent_to;              // ids that reach most of the gain
};

/// Of the square of what is left: how much a flexible regression over the state of the machine, that has not
/// seen the block it predicts, can still say. Its interval from blocks drawn with replacement.
struct Explainable {
  double value = 0, lower = 0, upper = 0;
};

struct TraceChannel {
  double before = 0, after = 0;
  // What noise alone leaves: of the sensors, or more where the motion repeats and what is left differs from
  // one time to the next. All three relative, on the test record.
  double floor = 0;
  double train_before = 0, train_after = 0;
  Explainable explainable;  // of the records where it is more: training or test
  bool repeats = false;     // the motion of the test record repeats itself
};

/// An effect that was tried and is not in the model, and why.
struct RejectedEffect {
  std::string id, reason;
};

/// Share of lags at which the residual of a channel correlates with an input beyond the 99 % band of
/// independence (about 0.01 where nothing is missing), on the test record.
struct Independence {
  std::string channel, input;
  double before = 0, after = 0;
};

/// What no effect explains.
struct Unexplained {
  std::string channel, signature;
  Explainable explainable;
};

/// The test record as both models have it, for plots. Signals of channels are low-passed.
struct TraceSeries {
  std::vector<double> time, motor_position, motor_velocity;  // s, rad, rad/s
  std::vector<double> motor_torque;                          // N m, as recorded
  // rad, rad/s, N m, as the augmented model has them: what its terms depend on
  std::vector<double> load_position, load_velocity, mesh_torque;
  std::vector<char> torque_counts, deflection_counts;
  std::vector<double> torque, torque_before, torque_after;              // measured, predicted
  std::vector<double> deflection, deflection_before, deflection_after;  // empty without load encoder
};

/// effect_found: a named effect, or a learned map that leaves nothing else to explain.
enum class TraceVerdict { effect_found, nothing_missing, unexplained };

struct Trace {
  TraceVerdict verdict = TraceVerdict::nothing_missing;
  bool determined = true;      // false: the records do not determine the machine, and nothing is known
  double cutoff = 0;           // Hz
  model::Rig base, augmented;  // fitted, load side
  std::map<std::string, signal::Measured> base_parameters,
      parameters;  // of the machine, without and with effects
  std::map<std::string, std::string> units;
  std::map<std::string, TraceChannel> channels;
  std::vector<Independence> independence;
  std::vector<FoundEffect> steps;
  std::vector<RejectedEffect> rejected;  // each effect once
  std::optional<Unexplained> unexplained;
  std::optional<SeveralMachines> several;  // where something is unexplained: why
  std::vector<std::string> notes;  // what was added to the model and is too small to be called missing
  std::vector<std::string> warnings;
  TraceSeries series;
};

/// `determined` is false where the records serve and do not determine the declared machine. Throws
/// CannotIdentify for a rig or records that this cannot be done with, BadData, Cancelled.
Trace trace_residual(const model::Rig& declared, const std::vector<record::Record>& train,
                     const record::Record& test, const TraceSettings& settings = {},
                     const Progress& progress = nullptr);

}  // namespace backlash::identification
