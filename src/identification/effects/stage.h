// SPDX-License-Identifier: BSD-3-Clause
// One fit of the machine at one bandwidth, and what belongs to it.
#pragma once

#include <optional>
#include <vector>

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/base/error.h"

namespace backlash {

constexpr double kRoughTolerance = 1e-3, kFineTolerance = 1e-5;

/// A fit with all that belongs to it.
struct Stage {
  MachineFit fit;
  Machine start;  // what fit.fit.values belong to
  RecordSet records;
  Leftover leftover;
};

/// Fits at weights of its own. @throws CannotIdentify
Stage fit_stage(const std::vector<ServoData>& data, Machine start, double cutoff, double tolerance);

/// A map has many values, in which the residuals are nearly linear.
NonlinearOptions fit_options(double tolerance, bool with_map = false);

/// Of both channels.
double size(const Leftover& left);

/// What acts a good part of a sample earlier than a held torque is not held.
void tell_held(Machine& machine);
/// What seemed not to be held, because the delay had to stand in for an effect, may be.
void tell_held_again(Machine& machine);
/// Beyond calibration a delay is an effect: then as much as is calibration stays, and is fitted no more, so
/// that the effect can be seen.
void limit_delay(Machine& machine);
/// Where delay is an effect calibration is part of it.
void without_calibration(Machine& machine);
/// A delay that is tried as an effect, the last term, begins with what calibration has found.
void take_over_calibration(Machine& machine, double interval);

/// A fit, or none where the model cannot be fitted or followed.
template <typename Fit>
auto attempted(const Fit& fit) -> std::optional<decltype(fit())> {
  try {
    return fit();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace backlash
