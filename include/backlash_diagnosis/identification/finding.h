// SPDX-License-Identifier: BSD-3-Clause
// The results of all procedures in one form, so that they can be combined: a linear combination of parameters
// has a value.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

/// Relative standard error of a declared value, used where a finding determines only its sum with another.
constexpr double kDeclaredUncertainty = 0.4;

/// sum of factor * parameter = measured; parameters are those of servo_parameters(). A system's friction is
/// {motor_coulomb: 1, load_coulomb: 1}.
struct Finding {
  std::string procedure;
  std::map<std::string, double> combination;
  signal::Measured measured;
};

/// The parameters that the findings determine, by least squares weighted with their standard errors; the
/// others keep what `rig` says, and a combination with one of those is read with it. Standard errors grow
/// where findings contradict each other. Only `names` are touched.
std::map<std::string, signal::Measured> combine_findings(const std::vector<Finding>& findings,
                                                         const model::Rig& rig,
                                                         const std::vector<std::string>& names);

}  // namespace backlash::identification
