// SPDX-License-Identifier: BSD-3-Clause
// The fit of a machine to records: from several starts in a narrow band, then from the best of them in the
// whole band.
#pragma once

#include <functional>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/identification/fit/fit_settings.h"
#include "joint_fit.h"

namespace backlash::identification {

/// A machine fitted in one band, and what belongs to it.
struct BandFit {
  MachineFit fit;
  Machine start;  // what fit.fit.values belong to
  RecordSet records;
  Misfit misfit;
};

/// Called before each fit; may throw to end them.
using BeforeFit = std::function<void()>;

/// As the settings say, with another tolerance; `with_map`: of a machine with a learned map.
fit::NonlinearOptions fit_options(const FitSettings& settings, double tolerance, bool with_map);

/// One fit with weights of its own, those of `start` in this band [Hz]. `settings` have their bands. `data`
/// must outlive what is returned. Throws CannotIdentify.
BandFit fit_in_band(const std::vector<ServoData>& data, Machine start, double cutoff, double tolerance,
                    const FitSettings& settings);

/// The same again from where it has ended, until the weights no longer change: the weights of a start
/// that lacks an effect, or is far off, come from its residual and not from the noise.
BandFit fit_settled(const std::vector<ServoData>& data, const Machine& start, double cutoff, double tolerance,
                    const FitSettings& settings);

/// The same machine from another start: each parameter > 0 times exp(spread u), u in [-1, 1) from a generator
/// of random numbers with this seed.
Machine other_start(Machine machine, double spread, std::uint64_t seed);

/// The best of several starts in the narrow band. Where `start` leaves more than noise others are tried until
/// one ends within `same_minimum` of the best before it: that is taken for the lowest minimum. Throws
/// CannotIdentify where no start can be fitted.
BandFit fit_from_starts(const std::vector<ServoData>& data, const Machine& start, const FitSettings& settings,
                        const BeforeFit& before_fit = nullptr);

/// The whole fit: from several starts, then in the whole band, where each record's torque is found to be held
/// or of the moment, with weights renewed from fit to fit. Throws CannotIdentify.
BandFit fit_to_records(const std::vector<ServoData>& data, const Machine& start, const FitSettings& settings,
                       const BeforeFit& before_fit = nullptr);

}  // namespace backlash::identification
