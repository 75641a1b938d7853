// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/fit_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::arm {
namespace {

constexpr std::size_t kMostRecords = 8;  // choice (time)
constexpr double kTimes = 2;             // choice: between 1.2 and 3.4, see the header

/// Of each record that tells the arm by itself.
std::vector<ArmFit> fits_alone(const ArmRig& rig, const std::vector<RecordMotions>& records,
                               const FitSettings& settings, const Progress& progress) {
  std::vector<ArmFit> fits;
  for (const RecordMotions& record : records) {
    ArmRig declared = rig;
    RecordMotions motions = record;
    try {
      fits.push_back(fit_arm_and_friction_speeds(declared, motions, settings, progress));
    } catch (const CannotIdentify&) {  // nothing moves long enough: it cannot contradict
    }
  }
  return fits;
}

void widen(signal::Measured& measured, const signal::Measured& other) {
  const double apart = std::fabs(other.value - measured.value);
  if (apart > measured.standard_error) measured.standard_error = apart;
}

void allow_for(const ArmFit& alone, ArmFit& together) {
  for (std::size_t j = 0; j < together.drives.size(); ++j)
    for (std::size_t i = 0; i < together.drives[j].size(); ++i)
      widen(together.drives[j][i], alone.drives[j][i]);
  for (BaseParameter& b : together.base) {
    const auto same = std::find_if(alone.base.begin(), alone.base.end(),
                                   [&](const BaseParameter& other) { return other.name == b.name; });
    if (same != alone.base.end()) widen(b.measured, same->measured);
  }
}

}  // namespace

std::vector<Contradiction> contradictions(const ArmFit& together, const std::vector<ArmFit>& alone) {
  std::vector<Contradiction> all;
  if (alone.size() < 2) return all;
  for (std::size_t j = 0; j < together.train.size(); ++j) {
    double most = 0;
    for (const ArmFit& fit : alone)
      if (std::isfinite(fit.train[j])) most = std::max(most, fit.train[j]);
    if (most > 0 && together.train[j] > kTimes * most)
      all.push_back({together.rig.joints[j].name, most, together.train[j]});
  }
  return all;
}

std::string description(const std::vector<Contradiction>& all) {
  std::string text =
      "records contradict each other: they are not of one arm, or it has changed between them, or carries a "
      "body in some of them. Left of the torque by all together, and at most by each alone: ";
  for (const Contradiction& c : all)
    text += fmt::format("{}{} {:.3g} and {:.3g} %", &c == &all.front() ? "" : ", ", c.joint, 100 * c.together,
                        100 * c.alone);
  return text + ". trace_residual --train ONE --test ANOTHER says what differs";
}

ArmFit fit_records(const ArmRig& declared, const std::vector<RecordMotions>& records,
                   const FitSettings& settings, const Progress& progress) {
  ArmRig rig = declared;
  RecordMotions motions;
  for (const RecordMotions& record : records) motions.insert(motions.end(), record.begin(), record.end());
  ArmFit fit = fit_arm_and_friction_speeds(rig, motions, settings, progress);
  if (records.size() < 2 || records.size() > kMostRecords) return fit;
  const std::vector<ArmFit> alone = fits_alone(declared, records, settings, progress);
  fit.contradictions = contradictions(fit, alone);
  if (fit.contradictions.empty()) return fit;
  for (const ArmFit& other : alone) allow_for(other, fit);
  fit.warnings.push_back("The " + description(fit.contradictions) +
                         ". The values that follow are of none of them, and their errors hold them all");
  return fit;
}

}  // namespace backlash::arm
