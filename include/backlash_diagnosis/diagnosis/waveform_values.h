// SPDX-License-Identifier: BSD-3-Clause
// All values of a machine as one stretch of a record gives them, by the fit of waveform.h: for who compares
// stretches and asks which value has changed. No value is refused for being far from the declared one.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/diagnosis/waveform.h"

namespace backlash::diagnosis {

struct WaveformValues {
  Status status = Status::ok;  ///< else there is nothing but the reason
  std::string reason;
  std::string doubt;                    ///< why `waveform` would not believe this fit; empty: it would
  double backlash = kNaN;               ///< m; of a mesh of angles rad
  double log_error = kNaN;              ///< standard error of its logarithm
  std::vector<std::size_t> quantities;  ///< of the machine, by their places in waveform_quantities()
  /// In spreads from what was declared: first the logarithm of the backlash, then the quantities.
  Eigen::VectorXd z;
  /// What the samples say of z, without what was declared of it. What belongs to the stretch (bias of the
  /// sensor, offset of the drive, place) is free.
  Eigen::MatrixXd information;
  /// Of the log likelihood of the samples at z: there what was declared pulls as much the other way.
  Eigen::VectorXd slope;
  std::vector<double> spread;         ///< of each of z, as in WaveformQuantity; of the backlash a factor
  double residual[2] = {kNaN, kNaN};  ///< rms, N m of the torque, rad of the position; NaN: not measured
  double swing[2] = {kNaN, kNaN};     ///< half of the range of the same
  int windows = 0, left_out = 0;      ///< reversals, and those that the fit does not catch
};

/// Of the samples from `from` to `to` [s]. Those beside them only show more finely where a square wave
/// reverses: a record a few times as long is best. `backlash` > 0 [m], from where the search starts, with the
/// spread of its logarithm > 0; NaN: nothing is known of it, which takes longer. Throws InvalidParameter for
/// settings out of range.
WaveformValues waveform_values(const record::Record& record, double from, double to,
                               const WaveformSettings& settings, double backlash = kNaN,
                               double spread = kNaN);

}  // namespace backlash::diagnosis
