// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/fit_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::arm {
namespace {

constexpr std::size_t kMostRecords = 8;  // choice (time)
// Friction below so much of the torque has no sign; so much of it must drive. Choices: measured and drawn
// joints have friction that takes power all the time.
constexpr double kLeastFriction = 0.03, kDriving = 0.2;
// Left of a joint's torque, over which a fit is told to be none. Choices: the joints of the measured arm
// leave 1 to 4 %, up to four times the noise.
constexpr double kMisfit = 0.1, kFarAboveNoise = 5;
constexpr double kTimes = 2;  // choice: between 1.2 and 3.4, see the header

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

/// Sums over the rows in which a joint moves: of friction and of torque, and what friction takes.
struct Rubbing {
  double friction = 0, speed = 0, torque = 0;  // squares
  double power = 0;
};

Rubbing rubbing_of(const JointDrive& drive, const RecordMotions& motions, std::size_t joint) {
  const auto column = [](DriveTerm term) { return Eigen::Index(term); };
  const auto j = Eigen::Index(joint);
  Rubbing sum;
  for (const ArmMotion& m : motions)
    for (Eigen::Index k = 0; k < m.counts.rows(); ++k) {
      if (!m.counts(k, j)) continue;
      const double speed = m.drive[joint](k, column(DriveTerm::viscous));
      const double torque = drive.constant * m.signal(Eigen::Index(m.rows[std::size_t(k)]), j);
      double friction = 0;
      for (const DriveTerm t :
           {DriveTerm::coulomb, DriveTerm::viscous, DriveTerm::quadratic, DriveTerm::cubic})
        friction += drive.terms[std::size_t(t)] * m.drive[joint](k, column(t));
      sum.friction += friction * friction, sum.speed += speed * speed, sum.torque += torque * torque;
      sum.power += friction * speed;
    }
  return sum;
}

/// Friction takes power. Where it comes out as a drive, torque and position count against each other.
void require_rubbing(const ArmFit& fit, const RecordMotions& motions) {
  for (std::size_t j = 0; j < fit.rig.joints.size(); ++j) {
    const JointDrive& drive = fit.rig.joints[j];
    const Rubbing sum = rubbing_of(drive, motions, j);
    if (sum.friction < kLeastFriction * kLeastFriction * sum.torque) continue;
    if (sum.power > -kDriving * std::sqrt(sum.friction * sum.speed)) continue;
    throw CannotIdentify(
        fmt::format("{}: friction comes out as a torque that drives it (Coulomb {:.3g} N m, viscous {:.3g} "
                    "N m s/rad): the sign of its torque or of its position is not that of the rig file and "
                    "the URDF",
                    drive.name, drive.terms[std::size_t(DriveTerm::coulomb)],
                    drive.terms[std::size_t(DriveTerm::viscous)]));
  }
}

void warn_of_misfit(ArmFit& fit) {
  for (std::size_t j = 0; j < fit.train.size(); ++j)
    if (fit.train[j] > std::max(kMisfit, kFarAboveNoise * fit.floor[j]))
      fit.warnings.push_back(
          fmt::format("{}: the fitted arm leaves {:.3g} % of its torque where noise alone would leave "
                      "{:.3g} %: it has an effect that the rig file lacks, or its signs, axis or links are "
                      "not as declared",
                      fit.rig.joints[j].name, 100 * fit.train[j], 100 * fit.floor[j]));
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
  require_rubbing(fit, motions);
  warn_of_misfit(fit);
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
