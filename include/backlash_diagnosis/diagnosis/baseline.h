// SPDX-License-Identifier: BSD-3-Clause
// The healthy machine, to compare with: what a verdict said of it once, kept as a YAML file.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {

struct Diagnosis;

/// NaN where not known; the intervals hold with 95 %.
struct Baseline {
  std::string rig, rig_digest;                                           // name and digest of the rig file
  std::vector<std::string> methods;                                      // that agreed on it
  double backlash = kNaN, lower = kNaN, upper = kNaN;                    // m, total free play
  double backlash_angle = kNaN, angle_lower = kNaN, angle_upper = kNaN;  // rad, axis of motor_position
  double skewness = kNaN;                                                // of the APD
};

/// The combined value of the verdict, as a baseline of the rig with this name and digest. Throws BadData,
/// naming the rig and the reason, where the verdict is no value with an interval or its estimates contradict
/// each other.
Baseline baseline_of(const Diagnosis& diagnosis, const std::string& rig, const std::string& rig_digest);

/// The content of a file. There is no date in it: the same machine gives the same file.
std::string to_yaml(const Baseline& baseline);

/// Throws BadData for a file that is no baseline: unknown schema or keys, no angle, a value outside its
/// interval.
Baseline baseline_from_yaml(const YamlReader& yaml);

Baseline read_baseline(const std::string& path);                         ///< MissingInput, BadData
void write_baseline(const Baseline& baseline, const std::string& path);  ///< whole or not at all; CannotWrite

/// Throws BadData, naming `source` and both rigs, for a baseline of another rig. Returns a warning where only
/// the text of the rig file has changed since, else nothing.
std::string check_baseline(const Baseline& baseline, const std::string& rig, const std::string& rig_digest,
                           const std::string& source);

}  // namespace backlash::diagnosis
