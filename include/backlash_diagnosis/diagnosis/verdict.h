// One answer from several estimates: which one it stands on, which agree with it, and what to do.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash {

enum class Grade { good, watch, service, stop, cannot_tell };
const char* to_string(Grade grade);

/// Backlash from which a grade begins, by experience with the machine: in m (`backlash`) or rad
/// (`backlash_angle`). With a baseline they limit the growth since then.
struct Limits {
  bool angular = false;
  double watch = 0, service = 0, stop = 0;  // increasing
};

Limits read_limits(const YamlReader& yaml);

/// The healthy machine, to compare with.
struct Baseline {
  double backlash = kNaN;        // m
  double backlash_angle = kNaN;  // rad, axis of motor_position
  double skewness = kNaN;
};

struct Verdict {
  Grade grade = Grade::cannot_tell;
  int estimate = -1;      // index of the estimate that the verdict stands on; -1: none
  std::string agreement;  // "none", "single", "agree", or "disagree: ..." with the names
  double growth = kNaN;   // since the baseline, in the unit of the limits
  std::string message;
};

/// Stands on the estimate with status ok and the narrowest interval. Others with status ok, or above_range
/// with its lower bound, agree where the intervals overlap. Without limits a sound estimate is graded good.
/// An above_range estimate alone is graded by its lower bound.
Verdict combine(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits,
                const std::optional<Baseline>& baseline);

}  // namespace backlash
