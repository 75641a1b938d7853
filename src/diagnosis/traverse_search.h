// SPDX-License-Identifier: BSD-3-Clause
// Fits of a machine to windows of a record for gap_traverse: begun from several plays, as a fit stops where
// it is cheapest nearby.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "traverse_windows.h"

namespace backlash::diagnosis {

constexpr int kTraverseWindows = 60;  ///< beyond which the errors do not shrink

/// At most that many, spread evenly over the record.
std::vector<TraverseWindow> spread_evenly(const std::vector<TraverseWindow>& all, int most);

/// A machine fitted to some windows of a record.
struct TraverseFit {
  std::unique_ptr<TraverseWindows> windows;
  fit::WindowedFit fit;

  TraverseFit(const TraverseData& data, const GapTraverseSettings& settings, std::vector<TraverseWindow> some,
              const Eigen::VectorXd& shared, double of_noise, double part = 1)
      : windows(std::make_unique<TraverseWindows>(data, settings, std::move(some), part)), fit(*windows) {
    windows->noise = of_noise;
    fit.shared = shared;
  }

  /// Of another fit of the same windows.
  void begin_with_own_of(const TraverseFit& other) {
    for (std::size_t w = 0; w < fit.own.size(); ++w)
      for (int k = 0; k < kTraverseOwn; ++k)
        if (const double spread = windows->own()[std::size_t(k)].spread; spread > 0)
          fit.own[w][k] = other.fit.own[w][k] * other.windows->own()[std::size_t(k)].spread / spread;
  }

  double noise() const { return windows->noise; }
  /// Times a sample's, as which what is left would count for what it is.
  double noise_left() const { return noise() * std::sqrt(fit.mean_square()); }
  double gap() const { return fit.value(kTraverseGap); }
  /// Root mean square over the windows of what is left, in noises.
  double misfit() const {
    double squares = 0, expected = 0;
    for (int w = 0; w < windows->count(); ++w) {
      squares += fit.weight(w) * fit.residual(w).squaredNorm();
      expected += fit.weight(w) * windows->squares_of_noise(w);
    }
    return std::sqrt(squares / expected);
  }
  /// Root mean square over the windows of a value of their own.
  double rms_of_own(int which) const {
    double squares = 0;
    for (int w = 0; w < windows->count(); ++w)
      squares += std::pow(windows->own()[std::size_t(which)].value(fit.own[std::size_t(w)][which]), 2);
    return std::sqrt(squares / windows->count());
  }
};

using Fits = std::vector<TraverseFit>;

/// Standard error of the logarithm of the gap: of the fit, and by windows as clusters.
struct TraverseErrors {
  double of_fit, clustered;
  explicit TraverseErrors(const TraverseFit& f);
  double larger() const { return std::max(of_fit, clustered); }
  /// Of a difference of the cost, as many times as the windows scatter more than the noise has it.
  double scale() const { return std::pow(std::max(1.0, clustered / of_fit), 2); }
};

/// Factors of a declared gap, from which fits begin.
constexpr double kGapFactors[] = {0.3, 0.55, 1, 1.8, 3.3};

/// Some steps of fits to some of the windows from each of these gaps [rad] and, with the load's encoder, from
/// teeth that let the load bounce and that do not. Cheapest first, without those that came to the same.
Fits traverse_guesses(const TraverseData& data, const GapTraverseSettings& settings,
                      const std::vector<TraverseWindow>& windows, const Eigen::VectorXd& from,
                      const std::vector<double>& gaps, double noise);

/// The cheapest of those that have begun from afar, with a noise in which all of them saw where to go: on
/// with what the best leaves.
Fits nearer(Fits guesses);

/// The cheapest fit to the windows first, then those that the record does not distinguish from it. Throws a
/// Refusal where no fit is finite.
Fits solve_traverse(TraverseData& data, const GapTraverseSettings& settings,
                    const std::vector<TraverseWindow>& windows, const Fits& guesses);

}  // namespace backlash::diagnosis
