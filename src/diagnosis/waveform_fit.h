// SPDX-License-Identifier: BSD-3-Clause
// Fits the values of a gear train to windows of its record: least squares with priors,
//
//   sum over samples ((measured - moved) / noise)^2 + sum over values ((value - declared) / spread)^2,
//
// over the values that all windows share and the start values of each window, by Levenberg and Marquardt's
// method. The start values are eliminated (Schur complement), so that a step costs one small system per
// window.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "waveform_motion.h"

namespace backlash::diagnosis {

/// What is known of a value before the record: normal about `value`, or its logarithm is (`factor`).
struct WaveformPrior {
  double value = 0, spread = 1;
  bool factor = false;
  bool fitted = true;
  double power = 0;  // in the factor of the symmetry of waveform.h
};
using WaveformPriors = std::array<WaveformPrior, kGlobalValues>;

/// Of the fit, in the order of waveform_quantities().
constexpr int kQuantityPlaces[] = {kMotorDamping,    kDryFriction,   kFrictionSpeed,    kSensorStiffness,
                                   kSensorDamping,   kMotorInertia,  kPinionInertia,    kGearInertia,
                                   kOutputStiffness, kOutputDamping, kContactStiffness, kContactLoss,
                                   kContactDamping,  kLinkInertia,   kLinkDamping,      kLinkFriction,
                                   kSensorGain,      kSensorLag,     kSensorTime};

using WaveformStart = Eigen::Matrix<double, kStartValues, 1>;

enum WaveformChannel { kTorqueChannel, kPositionChannel, kWaveformChannels };

/// What is known of how a window starts, before the fit.
struct WaveformStartGuess {
  WaveformStart value, spread, step;  ///< the step is that of differences
};

/// What is fitted to.
struct WaveformData {
  std::vector<double> torque, position;  // N m, rad; no position: torque alone
  std::vector<bool> lost;                // of each row: it was not recorded and does not count
  std::vector<WaveformWindow> windows;
  std::vector<WaveformStartGuess> guesses;  // one per window
  int starts = kStartValues;                // how many of the start values are fitted, the first ones
  WaveformGrid grid;
  int unseen =
      0;  // first samples of a window whose torque does not count: what a late sensor shows is before
  double level = 0;  // N m, of the torque of the motor: scale of the start values
};

/// A machine, and how each window starts.
struct WaveformPoint {
  Eigen::VectorXd z;  // shared values, in spreads from the declared ones
  std::vector<WaveformStart> starts;
};

Eigen::MatrixXd waveform_precision(const WaveformPriors& priors, double common);

class WaveformFit {
 public:
  /// `common`: standard deviation of a factor's logarithm, that each value has to its power.
  WaveformFit(const WaveformData& data, const WaveformPriors& priors, double common);

  /// How far the fit looks, and what it believes.
  struct Stage {
    std::vector<int> lengths;         // samples per window; 0: left out
    double noise[kWaveformChannels];  // standard deviations
    int iterations;
    bool central;              // differences
    bool coarse = false;       // half of the steps of the integration
    bool starts_only = false;  // the shared values stay
  };

  /// Improves the point until it stops to improve; the cost.
  double run(const Stage& stage);

  /// Covariance of the shared values that are fitted, in spreads, in the order of fitted().
  Eigen::MatrixXd covariance() const;
  /// Its inverse, which is better told where some values are known a thousand times better than others.
  const Eigen::MatrixXd& information() const { return information_; }
  const std::vector<int>& fitted() const { return fitted_; }

  /// Measured minus moved, of one window that the last stage used, and of one channel.
  std::vector<double> residual(std::size_t window, WaveformChannel channel) const;

  /// Value in its unit.
  double value(int which) const { return value(which, point.z[which]); }
  double value(int which, double z) const;
  double cost() const { return cost_; }
  /// How far the shared values are from what was known of them, chi^2.
  double prior_cost(const Eigen::VectorXd& z) const;
  int iterations() const { return iterations_; }

  WaveformPoint point;

 private:
  struct Part;
  struct Trial;

  bool used(std::size_t window) const { return stage_.lengths[window] > 0; }
  int rows(std::size_t window) const;
  WaveformGrid grid() const;
  void put(const Eigen::VectorXd& z, const WaveformStart& start, std::size_t set, WaveformSets& sets) const;
  void residuals(std::size_t window, const WaveformMotion& motion, std::size_t set, double* to) const;
  double start_cost(std::size_t window, const WaveformStart& start) const;
  Part linearise(std::size_t window) const;
  Trial trial(const std::vector<Part>& parts, double damping) const;
  std::vector<double> settle(std::size_t window, std::vector<Trial>& trials) const;
  std::vector<double> costs(std::vector<Trial>& trials) const;
  bool iterate();

  const WaveformData& data_;
  WaveformPriors priors_;
  Eigen::MatrixXd precision_;  // of what was known, in spreads, all values
  std::vector<int> fitted_, moving_;
  Eigen::VectorXd steps_;  // of the differences, in spreads
  Stage stage_;
  Eigen::MatrixXd information_;
  double damping_ = 0, cost_ = 0, gain_ = 0;
  int iterations_ = 0;
};

}  // namespace backlash::diagnosis
