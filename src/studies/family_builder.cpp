// SPDX-License-Identifier: BSD-3-Clause
#include "family_builder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::studies {
namespace {

constexpr int kTrials = 16;       // records per segment and noise level
constexpr int kNeighbours = 2;    // segments on each side that share their trials
constexpr double kShare = 0.95;   // of the records accept their own backlash
constexpr int kMostPeriods = 20;  // of a trial's record

/// Seven digits: finer than any torque sensor, and a file of half the size.
double rounded(double value) {
  return std::strtod(fmt::format("{:.6e}", value).c_str(), nullptr);
}

/// Samples of the first `periods` periods after settling.
std::vector<double> settled(const CurvePlan& plan, const std::vector<double>& samples, long periods) {
  const double per_period = plan.apd.period * plan.request.sampling_rate;
  const auto at = [&](long period) {
    const auto index = static_cast<std::size_t>(std::lround(static_cast<double>(period) * per_period));
    return samples.begin() + static_cast<std::ptrdiff_t>(std::min(index, samples.size()));
  };
  return {at(plan.apd.settling_periods), at(plan.apd.settling_periods + periods)};
}

/// What one simulated record shows: its smallest distance and that at its own backlash.
struct Trial {
  double smallest, own;
};

using Trials = std::vector<Trial>;

Trials run_trials(const CurvePlan& plan, const FineRun& run, const diagnosis::NoisyFamily& members,
                  std::size_t segment, double noise) {
  const long all = std::min(plan.request.periods, kMostPeriods);
  const long lengths[] = {std::max(1L, all / 5), std::max(1L, all / 2), all, all};
  Trials trials;
  for (int k = 0; k < kTrials; ++k) {
    const int seed = plan.request.seeds + static_cast<int>(segment) * kTrials + k;  // not those of the curve
    Random random(static_cast<std::uint64_t>(seed));
    const int phase = static_cast<int>(random.below(static_cast<std::size_t>(plan.phases)));
    const auto samples = settled(plan, sample(plan, run, phase, seed, noise), lengths[k % 4]);
    const diagnosis::FamilyDistance distance(members, diagnosis::quantiles_of(samples));
    trials.push_back({distance.smallest().distance, distance.at(segment, 0.5)});
  }
  return trials;
}

/// Trials of a segment and its neighbours together.
template <typename Get>
std::vector<double> pooled(const std::vector<Trials>& trials, std::size_t segment, Get get) {
  std::vector<double> values;
  const std::size_t end = std::min(trials.size(), segment + kNeighbours + 1);
  for (std::size_t i = segment < kNeighbours ? 0 : segment - kNeighbours; i < end; ++i)
    for (const Trial& trial : trials[i]) values.push_back(get(trial));
  return values;
}

}  // namespace

std::vector<diagnosis::Quantiles> family_members(const CurvePlan& plan, const FineRun& run) {
  std::vector<diagnosis::Quantiles> members;
  for (int phase = 0; phase < plan.phases; ++phase) {
    members.push_back(
        diagnosis::quantiles_of(settled(plan, sample(plan, run, phase, 0, 0), plan.request.periods)));
    for (double& value : members.back()) value = rounded(value);
  }
  return members;
}

void calibrate_family(const CurvePlan& plan, const std::vector<FineRun>& between, Ticker& ticker,
                      diagnosis::ApdFamily& family) {
  const std::size_t segments = between.size();
  family.segments.assign(segments, {});
  std::vector<Trials> trials(segments);
  const auto run_all = [&](double noise) {
    const diagnosis::NoisyFamily members(family, noise);
    for_each_in_parallel(static_cast<int>(segments), ticker, [&](int i) {
      trials[i] = run_trials(plan, between[i], members, i, noise);
      ticker.tick();
    });
  };
  run_all(0);
  for (std::size_t i = 0; i < segments; ++i)
    family.segments[i].floor =
        rounded(signal::median(pooled(trials, i, [](const Trial& t) { return t.smallest; })));
  for (const double noise : plan.noise_levels) {
    run_all(noise);
    for (std::size_t i = 0; i < segments; ++i) {
      diagnosis::FamilySegment& segment = family.segments[i];
      const double floor = segment.floor;
      const auto excess = [floor](const Trial& t) {
        const double scale = std::max({t.smallest, floor, 1e-300});
        return (t.own - t.smallest) / scale;
      };
      const auto misfit = pooled(trials, i, [](const Trial& t) { return std::sqrt(t.smallest); });
      segment.threshold.push_back(rounded(signal::quantile(pooled(trials, i, excess), kShare)));
      segment.misfit.push_back(rounded(*std::max_element(misfit.begin(), misfit.end())));
    }
  }
}

}  // namespace backlash::studies
