// SPDX-License-Identifier: BSD-3-Clause
// Stretches of a record of some reversals each, and what the fit of one says of each value of the machine
// against the healthy one.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/changes/change_settings.h"
#include "backlash_diagnosis/diagnosis/waveform_values.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::changes {

/// From where to where, s, in the record's time.
struct Stretch {
  double from = 0, to = 0;
  double middle() const { return (from + to) / 2; }
};

/// Where a record could be cut.
class StretchCutter {
 public:
  explicit StretchCutter(const record::Record& record);

  /// The stretch whose middle is nearest to a time. Throws CannotIdentify where there is none.
  Stretch nearest(double time) const;
  /// At most `count`, spread evenly over the record, none twice.
  std::vector<Stretch> spread(int count) const;
  double longest() const { return longest_; }

 private:
  std::vector<Stretch> all_;
  double longest_ = 0;
};

/// One value of the machine. Coordinate of the score: of the backlash a share of `value`, of a factor the
/// logarithm in spreads, else the value in spreads. Behind them gains that move many values at once.
struct RigValue {
  std::string name, unit;
  bool factor = false;
  double value = 0, spread = 1;  // of the healthy machine, spread as in WaveformQuantity
  // In the coordinate: what a stretch may be off by itself, a record from the next, and what is no change.
  double jitter = 0, day = 0, least = 0;
  double power = 0;        // in the factor of the symmetry of waveform.h
  double scale_error = 0;  // of the logarithm of `value`: what declared values leave open
};

/// A change that can be reported: a value of the machine, or the gain of a sensor that scales many of them.
struct RigEffect {
  std::string name, unit;
  Eigen::VectorXd direction;  // of the coordinates, per unit of its size
  double least = 0;           // of its size, below which it is no change
  double inflation = 1;       // of its gain, >= 1: how healthy stretches scatter
  int value = -1;             // of the machine; -1: a gain, whose size is its logarithm
};

/// The machine as the healthy records show it.
struct HealthyRig {
  diagnosis::WaveformSettings settings;
  double backlash = 0;                             // m; of angles rad
  std::vector<RigValue> values;                    // first the backlash
  double residual[2] = {0, 0}, swing[2] = {0, 0};  // as in WaveformValues; 0: not yet known
  double left_out = 0;                             // share of the reversals
  double least_level = 0, most_level = 0;          // N m, of the torque that drives
  Eigen::VectorXd mean, day;  // of the healthy records about `settings`; variance from record to record
  std::vector<RigEffect> effects;
  double inflation_of_all = 1;  // of the gain of all values together, as of RigEffect
};

struct FittedStretch {
  Stretch at;
  bool judged = false;       // else it could not be, for this reason:
  bool unexplained = false;  // no machine of this kind moves so
  std::string reason;
  double level = 0;  // N m
  double residual[2] = {0, 0}, swing[2] = {0, 0}, left_out = 0;
  Eigen::VectorXd score;  // log likelihood per coordinate at the healthy machine
  Eigen::MatrixXd information;
};

/// Twice the log likelihood ratio of other values, all free.
double gain_of_all(const Eigen::VectorXd& score, const Eigen::MatrixXd& information);

/// Median of the size of the motor's torque, N m.
double drive_level(const record::Record& record);

/// The stretch and some of what is beside it.
record::Record with_context(const record::Record& record, const Stretch& at);

/// Of the coordinates about `rig.settings`. What is not yet known of the healthy machine is not judged.
FittedStretch fit_stretch(const record::Record& record, const Stretch& at, const HealthyRig& rig);

/// Throws CannotIdentify with the reason where a healthy record does not fit the machine.
HealthyRig commission_rig(const std::vector<record::Record>& healthy,
                          const diagnosis::WaveformSettings& machine, const ChangeSettings& settings);

}  // namespace backlash::changes
