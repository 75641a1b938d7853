// SPDX-License-Identifier: BSD-3-Clause
#include "multi_start.h"

#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "calibration.h"

namespace backlash::identification {
namespace {

/// With the weights that the records have.
BandFit fit_weighed(RecordSet records, Machine start, double tolerance, const FitSettings& settings) {
  MachineFit fit = fit_machine(start, records, fit_options(settings, tolerance, start.has_map));
  const Misfit misfit = records.misfit(fit.machine);
  return {std::move(fit), std::move(start), std::move(records), misfit};
}

BandFit fit_with_own_weights(RecordSet records, Machine start, double tolerance,
                             const FitSettings& settings) {
  records.weigh(start);
  return fit_weighed(std::move(records), std::move(start), tolerance, settings);
}

BandFit fit_until_settled(const RecordSet& records, const Machine& start, double tolerance,
                          const FitSettings& settings) {
  BandFit fit = fit_with_own_weights(records, start, tolerance, settings);
  for (int i = 0; i < settings.renewals; ++i) {
    RecordSet renewed = fit.records;
    renewed.weigh(fit.fit.machine);
    if (fit.fit.fit.converged && renewed.difference_of_weights(fit.records) < settings.same_weights) break;
    fit = fit_weighed(std::move(renewed), fit.fit.machine, tolerance, settings);
  }
  return fit;
}

}  // namespace

fit::NonlinearOptions fit_options(const FitSettings& settings, double tolerance, bool with_map) {
  fit::NonlinearOptions options;
  options.iterations = with_map ? settings.iterations_of_map : settings.iterations;
  options.tolerance = tolerance;
  options.central = tolerance <= settings.tolerance;
  options.step = options.central ? settings.wide_step : settings.step;
  options.parallel = true;
  return options;
}

BandFit fit_in_band(const std::vector<ServoData>& data, Machine start, double cutoff, double tolerance,
                    const FitSettings& settings) {
  return fit_with_own_weights({data, cutoff, settings.feedback}, std::move(start), tolerance, settings);
}

BandFit fit_settled(const std::vector<ServoData>& data, const Machine& start, double cutoff, double tolerance,
                    const FitSettings& settings) {
  return fit_until_settled({data, cutoff, settings.feedback}, start, tolerance, settings);
}

Machine other_start(Machine machine, double spread, std::uint64_t seed) {
  Random random(seed);
  for (const FitParameter& p : machine.parameters) {
    const double share = 2 * random.uniform() - 1;
    if (p.positive) p.set(machine.rig, p.get(machine.rig) * std::exp(spread * share));
  }
  return machine;
}

BandFit fit_from_starts(const std::vector<ServoData>& data, const Machine& start, const FitSettings& settings,
                        const BeforeFit& before_fit) {
  const int others = start.parameters.empty() ? 0 : settings.other_starts;
  const RecordSet records(data, settings.rough_cutoff, settings.feedback);
  std::optional<BandFit> best;
  for (int i = 0; i <= others; ++i) {
    if (before_fit) before_fit();
    const Machine from = i == 0 ? start : other_start(start, settings.start_spread, settings.seed + i);
    try {
      BandFit one = fit_with_own_weights(records, from, settings.rough_tolerance, settings);
      const double least = best ? size(best->misfit) : INFINITY, left = size(one.misfit);
      if (left < least) best = std::move(one);
      if (left < settings.at_floor || std::fabs(left / least - 1) < settings.same_minimum) break;
    } catch (const CannotIdentify&) {
      if (i == others && !best) throw;
    }
  }
  return std::move(*best);
}

BandFit fit_to_records(const std::vector<ServoData>& data, const Machine& start, const FitSettings& settings,
                       const BeforeFit& before_fit) {
  Machine machine = fit_from_starts(data, start, settings, before_fit).fit.machine;
  const RecordSet records(data, settings.cutoff, settings.feedback);
  const auto fit = [&](const Machine& from, double tolerance) {
    if (before_fit) before_fit();
    return fit_until_settled(records, from, tolerance, settings);
  };
  release_hold(machine);
  machine = fit(machine, settings.rough_tolerance).fit.machine;
  release_hold(machine);
  limit_delay(machine, settings.calibration_delay);
  machine = fit(machine, settings.rough_tolerance).fit.machine;
  return fit(machine, settings.tolerance);
}

}  // namespace backlash::identification
