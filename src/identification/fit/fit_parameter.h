// SPDX-License-Identifier: BSD-3-Clause
// One number of a rig that a fit may change: of the machine itself or of one of its terms.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

struct FitParameter {
  std::string name;  // in reports
  std::string unit;
  bool positive;  // > 0: its logarithm is fitted
  double scale;   // a typical size, of one that is not positive
  std::function<double(const model::Rig&)> get;
  std::function<void(model::Rig&, double)> set;
};

/// By its name among servo_parameters(). Throws InvalidParameter for one that must be > 0 and is not.
FitParameter machine_parameter(const std::string& name, const model::Rig& rig);

/// The declared friction and stiffness as priors, one row each in standard deviations. If only the deflection
/// is predicted, friction and the skew of the encoders look alike, and a stiff machine hardly shows its
/// stiffness.
std::vector<std::function<double(const model::Rig&)>> rows_as_declared(const model::Rig& declared);

/// A number of the term at this place of rig.terms; `scale` as above. One that may not be negative, and is
/// not 0, stays above 0.
FitParameter term_parameter(std::size_t term, const std::string& name, const model::Rig& rig, double scale);

/// Entry `index` of a list of that term.
FitParameter list_parameter(std::size_t term, const std::string& name, std::size_t index, double scale);

}  // namespace backlash::identification
