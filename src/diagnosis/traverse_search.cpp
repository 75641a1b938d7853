// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/parallel.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

// Choices, tried on joints of test/campaigns/robot_joints and tests, but where another origin is given.
constexpr int kSearched = 16;  // windows of a first guess
constexpr int kSearch = 20;    // steps of one
// Spreads: whether the load bounces, and whether its weight keeps it on one flank, decides where fits end.
constexpr double kBounces[] = {-1.5, 0, 1.5}, kMoreWeight = 1.5;
// Of a window, by the motor alone: its later touches decide where a fit ends that begins far away. Choice.
constexpr double kBrief = 0.7;
// Theory: of a cost of some thousand, a hundredth of a standard error.
constexpr double kConverged = 1e-7;
constexpr std::size_t kNearer = 3;   // guesses that are looked at with less noise
constexpr std::size_t kGoneOn = 2;   // guesses that go on, the cheapest that differ
constexpr double kOtherNoise = 0.1;  // by which the noise must differ for another fit
constexpr double kAlike = 0.2;       // of the play, between fits that are the same
constexpr double kRivalCost = 9;     // theory: three standard errors

bool alike(const TraverseFit& a, const TraverseFit& b) {
  return std::fabs(std::log(a.gap() / b.gap())) < kAlike;
}

/// Some steps of each, side by side. Returns them cheapest first, without those that came to the same.
Fits run_some(Fits fits) {
  fit::FitOptions options;
  options.iterations = kSearch;
  for_each_in_parallel(int(fits.size()), [&](int i) { fits[std::size_t(i)].fit.run(options); });
  std::stable_sort(fits.begin(), fits.end(),
                   [](const auto& a, const auto& b) { return a.fit.cost() < b.fit.cost(); });
  Fits kept;
  for (TraverseFit& fit : fits)
    if (std::isfinite(fit.fit.cost()) &&
        std::none_of(kept.begin(), kept.end(), [&](const auto& other) { return alike(fit, other); }))
      kept.push_back(std::move(fit));
  return kept;
}

/// Another fit's machine on these windows.
TraverseFit continued(const TraverseData& data, const GapTraverseSettings& settings,
                      const std::vector<TraverseWindow>& windows, const TraverseFit& from, double noise,
                      const fit::FitOptions& options = {}) {
  TraverseFit fit(data, settings, windows, from.fit.shared, noise);
  if (from.fit.own.size() == windows.size()) fit.begin_with_own_of(from);
  fit.fit.run(options);
  return fit;
}

bool sure(const TraverseFit& fit) {
  return 2 * TraverseErrors(fit).larger() < kAlike;
}

/// Of half a record, on from the fit of the whole; where that leads nowhere, from other gaps.
TraverseFit half_of(const TraverseData& data, const GapTraverseSettings& settings,
                    const std::vector<TraverseWindow>& half, const TraverseFit& whole) {
  TraverseFit fit = continued(data, settings, half, whole, whole.noise());
  if (sure(fit)) return fit;
  std::vector<double> gaps;
  for (const double factor : kGapFactors) gaps.push_back(factor * whole.gap());
  const Fits others = traverse_guesses(data, settings, half, whole.fit.shared, gaps, whole.noise());
  return others.empty() ? std::move(fit) : continued(data, settings, half, others[0], whole.noise());
}

/// Adds those of either half of the record, where they are sure of another play: one that steps or grows.
void add_halves(Fits& fits, const TraverseData& data, const GapTraverseSettings& settings,
                std::vector<TraverseWindow> windows) {
  std::sort(windows.begin(), windows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto middle = windows.begin() + std::ptrdiff_t(windows.size() / 2);
  for (const std::vector<TraverseWindow>& half : {std::vector<TraverseWindow>(windows.begin(), middle),
                                                  std::vector<TraverseWindow>(middle, windows.end())}) {
    TraverseFit fit = half_of(data, settings, half, fits[0]);
    if (std::fabs(std::log(fit.gap() / fits[0].gap())) > kAlike + 3 * TraverseErrors(fit).larger() &&
        sure(fit))
      fits.push_back(std::move(fit));
  }
}

}  // namespace

TraverseErrors::TraverseErrors(const TraverseFit& f) {
  const double spread = f.windows->shared()[kTraverseGap].spread;
  of_fit = spread * std::sqrt(f.fit.covariance()(kTraverseGap, kTraverseGap));
  clustered = spread * std::sqrt(f.fit.clustered_covariance()(kTraverseGap, kTraverseGap));
}

std::vector<TraverseWindow> spread_evenly(const std::vector<TraverseWindow>& all, int most) {
  if (int(all.size()) <= most) return all;
  std::vector<TraverseWindow> chosen;
  for (int i = 0; i < most; ++i)
    chosen.push_back(all[static_cast<std::size_t>(i) * all.size() / static_cast<std::size_t>(most)]);
  return chosen;
}

Fits traverse_guesses(const TraverseData& data, const GapTraverseSettings& settings,
                      const std::vector<TraverseWindow>& windows, const Eigen::VectorXd& from,
                      const std::vector<double>& gaps, double noise) {
  std::vector<double> dampings = {0}, terms = {0};
  if (!data.load.empty()) dampings.assign(std::begin(kBounces), std::end(kBounces));
  if (settings.load_torque) terms.push_back(kMoreWeight);
  const std::vector<TraverseWindow> few = spread_evenly(windows, kSearched);
  Fits fits;
  for (const double gap : gaps)
    for (const double damping : dampings)
      for (const double term : terms) {
        fits.emplace_back(data, settings, few, from, noise, data.load.empty() ? kBrief : 1);
        const fit::Prior& prior = fits.back().windows->shared()[kTraverseGap];
        fits.back().fit.shared[kTraverseGap] = std::log(gap / prior.centre) / prior.spread;
        fits.back().fit.shared[kTraverseDamping] += damping;
        fits.back().fit.shared[kTraverseLoadTerms] += term;
      }
  fits = run_some(std::move(fits));
  if (!data.load.empty()) return fits;
  Fits whole;
  for (const TraverseFit& fit : fits) {
    whole.emplace_back(data, settings, few, fit.fit.shared, noise);
    whole.back().begin_with_own_of(fit);
  }
  return run_some(std::move(whole));
}

Fits nearer(Fits fits) {
  while (fits.size() > kNearer) fits.pop_back();
  double noise = std::numeric_limits<double>::infinity();
  for (const TraverseFit& fit : fits) noise = std::min(noise, fit.noise_left());
  for (TraverseFit& fit : fits) fit.windows->noise = std::max(1.0, noise);
  return run_some(std::move(fits));
}

Fits solve_traverse(TraverseData& data, const GapTraverseSettings& settings,
                    const std::vector<TraverseWindow>& windows, const Fits& guesses) {
  const std::vector<TraverseWindow> all = spread_evenly(windows, kTraverseWindows);
  Fits fits;
  fits.push_back(continued(data, settings, all, guesses[0], guesses[0].noise()));
  double noise = fits[0].noise_left();
  if (data.load.empty()) noise = std::max(1.0, noise);
  if (std::fabs(noise / fits[0].noise() - 1) > kOtherNoise) {  // once more, with what it has shown of itself
    if (!data.load.empty()) {
      data.shown_spread = std::max(2 * data.load_noise, fits[0].rms_of_own(kOwnShown));
      data.load_torque_spread = std::max(data.load_torque_spread, fits[0].rms_of_own(kOwnLoadTorque));
    }
    fits[0] = continued(data, settings, all, fits[0], noise);
  }
  noise = fits[0].noise();
  // A fit stops where it is cheapest nearby, and takes all values there: others begin at the declared ones
  // once more, with the noise that is known now. One that comes to the same play may still be much cheaper.
  std::vector<double> gaps;
  for (const double factor : kGapFactors) gaps.push_back(factor * fits[0].gap());
  const Fits others =
      traverse_guesses(data, settings, windows, Eigen::VectorXd::Zero(kTraverseValues), gaps, noise);
  for (std::size_t i = 0; i < others.size() && i < kGoneOn; ++i)
    fits.push_back(continued(data, settings, all, others[i], noise));
  for (std::size_t i = 1; i < guesses.size() && i < kGoneOn; ++i)
    fits.push_back(continued(data, settings, all, guesses[i], noise));
  std::stable_sort(fits.begin(), fits.end(),
                   [](const auto& a, const auto& b) { return a.fit.cost() < b.fit.cost(); });
  const double most = fits[0].fit.cost() + kRivalCost * TraverseErrors(fits[0]).scale();
  if (!std::isfinite(most))
    throw Refusal{Status::out_of_domain, "no machine like that of the rig file follows the record"};
  while (!(fits.back().fit.cost() <= most)) fits.pop_back();
  fit::FitOptions to_the_end;
  to_the_end.tolerance = kConverged;
  fits[0] = continued(data, settings, all, fits[0], noise, to_the_end);
  add_halves(fits, data, settings, all);
  return fits;
}

}  // namespace backlash::diagnosis
