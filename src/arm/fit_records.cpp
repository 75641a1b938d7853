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
// Share of a joint's torque that a fit leaves, above which a warning says that it is no fit. Choices: the
// joints of the measured arm leave 1 to 4 %, up to four times the noise.
constexpr double kMostUnexplained = 0.1, kFarAboveNoise = 5;
constexpr double kTimes = 2;  // choice: between 1.2 and 3.4, see the header

/// Of each record that identifies the arm by itself.
std::vector<ArmFit> fits_alone(const ArmRig& rig, const std::vector<RecordMotions>& records,
                               const FitSettings& settings, const Progress& progress) {
  std::vector<ArmFit> fits;
  for (const RecordMotions& record : records) {
    ArmRig declared = rig;
    RecordMotions motions = record;
    try {
      fits.push_back(fit_arm_and_friction_turns(declared, motions, settings, progress));
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

/// Friction takes power. Where it comes out as driving, torque or position has the wrong sign.
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
    if (fit.train[j] > std::max(kMostUnexplained, kFarAboveNoise * fit.floor[j]))
      fit.warnings.push_back(
          fmt::format("{}: the fitted arm leaves {:.3g} % of its torque where noise alone would leave "
                      "{:.3g} %: it has an effect that the rig file lacks, or its signs, axis or links are "
                      "not as declared",
                      fit.rig.joints[j].name, 100 * fit.train[j], 100 * fit.floor[j]));
}

constexpr double kExact = 1e-4;  // of a mass that is stated as exact; choice: far below what any torque shows
constexpr double kFarFromDeclared = 3;  // standard errors of the declared scale; choice

bool carries(const std::vector<std::optional<Carried>>& carried, std::size_t record) {
  return record < carried.size() && carried[record].has_value();
}

/// The same with what some records carry at the last link.
ArmFit fit_loaded(const ArmRig& rig, std::vector<RecordMotions> records,
                  const std::vector<std::optional<Carried>>& carried, const FitSettings& settings,
                  const Progress& progress) {
  FitFreedom freedom;
  freedom.payload = rig.chain.size() - 1;
  freedom.friction = true;
  std::vector<FittedMotion> motions;
  bool weighed = false;
  for (std::size_t r = 0; r < records.size(); ++r) {
    if (carries(carried, r)) {
      signal::Measured mass = carried[r]->mass;
      weighed = weighed || std::isfinite(mass.standard_error);
      if (mass.standard_error < kExact * mass.value) mass.standard_error = kExact * mass.value;
      freedom.weights.push_back(mass);
    }
    for (ArmMotion& m : records[r]) {
      set_friction_turns(m, rig);
      motions.push_back({&m, carries(carried, r) ? freedom.weights.size() : 0});
    }
  }
  ArmFit fit = fit_arm(rig, motions, freedom, settings, progress);
  fit.weighed = weighed;
  return fit;
}

/// A weight that contradicts the declared constants may be wrong, or belong to another record.
void warn_of_scale(const ArmRig& declared, ArmFit& fit) {
  double sum = 0, own = 0, count = 0;
  for (std::size_t j = 0; j < declared.joints.size(); ++j) {
    const double error = declared.joints[j].constant_error;
    if (!(error > 0) || !std::isfinite(fit.train[j])) continue;
    sum += std::log(fit.rig.joints[j].constant / declared.joints[j].constant);
    own += error * error, count += 1;
  }
  if (!(count > 0)) return;
  const double scale = std::exp(sum / count),
               error = std::hypot(declared.common_error, std::sqrt(own) / count);
  if (std::fabs(std::log(scale)) > kFarFromDeclared * error)
    fit.warnings.push_back(fmt::format(
        "the known weight makes the torque constants {:.3g} times the declared ones, which are known to "
        "{:.2g} %: check the weight, and that it belongs to this record",
        scale, 100 * error));
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
      "records contradict each other: they are of different arms, or the arm has changed between them, or "
      "carries a body in some of them. Share of the torque left by a fit to all, and at most by each alone: ";
  for (const Contradiction& c : all)
    text += fmt::format("{}{} {:.3g} and {:.3g} %", &c == &all.front() ? "" : ", ", c.joint, 100 * c.together,
                        100 * c.alone);
  return text + ". trace_residual --train ONE --test ANOTHER says what differs";
}

ArmFit fit_records(const ArmRig& declared, const std::vector<RecordMotions>& records,
                   const FitSettings& settings, const Progress& progress,
                   const std::vector<std::optional<Carried>>& carried) {
  ArmRig rig = declared;
  RecordMotions motions;
  for (std::size_t r = 0; r < records.size(); ++r)
    if (!carries(carried, r)) motions.insert(motions.end(), records[r].begin(), records[r].end());
  if (motions.empty())
    throw CannotIdentify(
        "all records carry something: what the arm is without it takes at least one record without a "
        "payload");
  ArmFit fit = fit_arm_and_friction_turns(rig, motions, settings, progress);
  if (std::any_of(carried.begin(), carried.end(), [](const auto& c) { return c.has_value(); })) {
    const std::vector<std::string> before = std::move(fit.warnings);
    fit = fit_loaded(rig, records, carried, settings, progress);
    for (const std::string& warning : before)
      if (std::find(fit.warnings.begin(), fit.warnings.end(), warning) == fit.warnings.end())
        fit.warnings.push_back(warning);
    if (fit.weighed) warn_of_scale(declared, fit);
  }
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
