// SPDX-License-Identifier: BSD-3-Clause
// The unknowns of a machine fitted to several records together (output_error.h says what counts).
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/identification/fit/output_error.h"
#include "fit_parameter.h"
#include "servo_prediction.h"

namespace backlash::identification {

/// Samples, theory: half a sample, by which a held torque acts later than one of the moment. A later delay of
/// the record hides this difference; it is part of the standard error of a delay.
constexpr double kUnsureOfHold = 0.3;

/// A rig, what is unknown of it, and what belongs to each record.
struct Machine {
  model::Rig rig;
  std::vector<FitParameter> parameters;
  std::vector<Calibration> calibrations;
  /// What is known of the rig beside the records: one more row each, in standard deviations.
  std::vector<std::function<double(const model::Rig&)>> priors = {};
  double largest_delay = 3;  // samples; approached, never reached; 0: delays are not fitted
  // N m, rad/s: standard deviations of each record's offset of torque and drift of encoder; 0: none is fitted
  double torque_offset = 0, encoder_drift = 0;
  bool deflection_only = false;  // the torque of the records does not count
  bool encoders_known = false;   // encoder offsets are not fitted
  bool has_map = false;          // a learned map with its many values is among the parameters
};

/// Standard deviation of either residual of one record [N m, rad].
struct Weights {
  double torque = 1, deflection = 1;
};

/// The residuals of the channels over all records: root mean square in units of the noise floor, or of a
/// negligible part of the signal if that is larger.
struct Misfit {
  double torque = 0, deflection = 0;
  double torque_share = 0, deflection_share = 0;  // of the signal's standard deviation instead
};

/// Of both channels together.
double size(const Misfit& misfit);

/// Records made ready at one bandwidth, with the weights of their channels. One row per channel and as many
/// samples as a signal of this bandwidth has independent values: of each record torque and deflection in
/// turn.
class RecordSet {
 public:
  RecordSet(const std::vector<ServoData>& data, double cutoff, double feedback);

  /// The larger of noise floor and actual residual, so that a record with a misfit does not outweigh records
  /// that fit well.
  void weigh(const Machine& machine);
  /// The largest relative difference between a weight of these and of the others, of as many records.
  double difference_of_weights(const RecordSet& other) const;
  Misfit misfit(const Machine& machine) const;
  /// Other records of the same lengths with the weights of these. `data` must outlive it.
  RecordSet of_others(const std::vector<ServoData>& data) const;

  Eigen::VectorXd rows(const model::Rig& rig, const std::vector<Calibration>& calibrations) const;
  /// What a torque [N m] at each sample, beside the motor's, makes of the rows.
  Eigen::VectorXd rows_of_torque(const std::vector<std::vector<double>>& torque) const;
  /// Simulates them together, which saves time where their rows are asked for next.
  void prepare(const std::vector<Machine>& machines) const;

  struct Row {
    std::size_t record;
    bool deflection;
    std::size_t sample;
    double time;  // s from the start of the record
  };
  const std::vector<Row>& layout() const { return layout_; }
  const std::vector<PreparedServo>& records() const { return records_; }
  const std::vector<Weights>& weights() const { return weights_; }
  /// s, between the samples of one channel that make rows
  double row_interval() const;

 private:
  std::vector<PreparedServo> records_;
  std::vector<RecordNoise> noises_;
  std::vector<Weights> weights_, spreads_;
  std::vector<Row> layout_;
};

struct MachineFit {
  Machine machine;
  signal::LeastSquaresFit fit;  // of the values of Unknowns(start)
  Eigen::VectorXd reach;        // of the errors of small values (reach.h); empty before judge_errors()
};

/// The ratio of a positive value to its start at which its bound counts as reached, to a hundredth.
double farthest_logarithm();

/// The numbers that a fit changes: parameters (of those that are positive the logarithm, relative to the
/// start), then delay and encoder offset of each record, as far as they are unknown.
class Unknowns {
 public:
  explicit Unknowns(const Machine& start);
  Eigen::Index size() const { return Eigen::Index(start_.parameters.size() + of_record_.size() * records()); }
  Eigen::VectorXd values() const;
  Eigen::VectorXd scale() const;
  /// Throws InvalidParameter for values that the rig refuses.
  model::Rig rig(const Eigen::VectorXd& values) const;
  std::vector<Calibration> calibrations(const Eigen::VectorXd& values) const;
  /// One row per value: a wide prior about its start, so that values that the records do not determine stay
  /// there.
  Eigen::VectorXd prior(const Eigen::VectorXd& values) const;
  Machine machine(const Eigen::VectorXd& values) const;
  std::map<std::string, signal::Measured> parameters(const MachineFit& fit) const;
  signal::Measured parameter(const MachineFit& fit, std::size_t i) const;
  signal::Measured torque_offset(const MachineFit& fit, std::size_t record) const;
  /// Place of the delay of a record's torque among the values; nothing where it is not fitted.
  std::optional<Eigen::Index> delay(std::size_t record) const;

 private:
  std::size_t records() const { return start_.calibrations.size(); }
  Eigen::Index first_of(std::size_t record) const {
    return Eigen::Index(start_.parameters.size() + of_record_.size() * record);
  }
  Machine start_;
  /// What belongs to each record.
  struct OfRecord {
    double Calibration::*at;
    double scale, deviation;  // typical size, standard deviation of the prior
    double most = INFINITY;   // approached, never reached
  };
  std::vector<OfRecord> of_record_;
};

/// Rows of the records, then of priors.
Eigen::VectorXd all_rows(const Unknowns& unknowns, const RecordSet& records, const Eigen::VectorXd& values);

MachineFit fit_machine(const Machine& start, const RecordSet& records, fit::NonlinearOptions options);

/// Subtracts the bias of the values by sampling (sampling.h), part of which counts as an error. The
/// covariance is the larger of that from the wide steps of the last fit and that from blocks of the records.
/// Blocks are as long as the time between two reversals of the motor, as the residual of friction and play
/// keeps its sign until the next reversal. On a machine that is coupled to other axes the residual also
/// counts as if it followed each value.
void judge_errors(MachineFit& fit, const Machine& start, const RecordSet& records);

/// White noise of a motor's position makes its inertia and its viscous friction too small, which the noise
/// of speed and acceleration says (Fuller 1987, Measurement Error Models, Section 2.2): takes that off, and
/// counts a part of it as an error. Of a machine with a locked link, whose low-pass leaves little else.
void correct_for_noise_of_motion(MachineFit& fit, const Machine& start, const RecordSet& records);

/// The values along the delay of the torque by half a sample, by which it is unknown how the torque acts
/// between its samples.
void allow_for_hold(MachineFit& fit, const Machine& start);

/// A missing effect (kShowsMissingEffect) may have the same shape as the change of the records by one value;
/// it then shifts that value and leaves no trace in the residual. So the error of a value is at least the
/// change that would alter the records as much as the whole residual of such channels, or, with all other
/// values fitted, three tenths of it. Not for a coupled machine: judge_errors() has allowed for it.
void allow_for_misfit(MachineFit& fit, const RecordSet& records);

}  // namespace backlash::identification
