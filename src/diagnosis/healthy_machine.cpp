// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/healthy_machine.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

Baseline baseline_of(const Diagnosis& diagnosis, const std::string& rig, const std::string& rig_digest) {
  const Verdict& verdict = diagnosis.verdict;
  // An open or missing interval does not tell how sure the baseline is.
  if (!std::isfinite(verdict.backlash_angle) || !std::isfinite(verdict.angle_lower) ||
      !std::isfinite(verdict.angle_upper))
    throw BadData(rig, "no baseline, there is no value with an interval: " + verdict.message);
  if (!verdict.dissenters.empty())
    throw BadData(rig, "no baseline, the estimates contradict each other: " + verdict.message);
  Baseline baseline;
  baseline.rig = rig;
  baseline.rig_digest = rig_digest;
  for (const int i : verdict.members)
    if (diagnosis.estimates[i].status == Status::ok)
      baseline.methods.push_back(diagnosis.estimates[i].method);
  baseline.backlash = verdict.backlash;
  baseline.lower = verdict.lower;
  baseline.upper = verdict.upper;
  baseline.backlash_angle = verdict.backlash_angle;
  baseline.angle_lower = verdict.angle_lower;
  baseline.angle_upper = verdict.angle_upper;
  if (diagnosis.apd) baseline.skewness = diagnosis.apd->skewness;
  return baseline;
}

}  // namespace backlash
