// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/position_difference.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "encoder_motion.h"
#include "flank_fit.h"
#include "flank_torque.h"
#include "refusal.h"
#include "rest_levels.h"

namespace backlash::diagnosis {
namespace {

// Windows, half of one [samples]: the two shortest in which noise is a small part of the torque.
constexpr std::size_t kHalves[] = {4, 6, 8, 12, 16, 24, 32, 48};
constexpr double kNoise = 0.02;  // of the large torque: choice
// Of the squares that the best law of the teeth leaves, up to which another one is not ruled out: by standard
// errors, and where it is no spring more, as none is the true one exactly. Choices.
constexpr double kLawErrors = 3, kAnySpring = 1.1, kAnyLaw = 1.5, kOutlying = 5;
// Of the play, of the deflection, of the residual: simulation (see the header).
constexpr double kModel = 0.01, kElastic = 0.005, kResidual = 0.3;
constexpr double kLockedModel = 0.03, kLockedResidual = 2;
constexpr double kLockedTravel = 0.05;  // of the motor's travel: choice
// The gates of the header, choices: stays; share of windows in which flanks change; deflection over the
// declared one; standard deviations of what is declared; scale; width of the interval over the play and over
// the deflection.
constexpr std::size_t kFewestStays = 6;
constexpr double kSwings = 0.5, kFactor = 5, kWrong = 2.5, kScale = 0.01, kWide = 2, kWorthSaying = 0.25;
// Parts of a record with a moving load give the same play: to within a share of it, their errors, and what
// the shape of the deflection leaves. Choices, tried on plays that grow within the record.
constexpr std::size_t kMostParts = 16, kFewestWindows = 32;  // of a part, at least
constexpr double kPartChange = 0.1, kPartErrors = 4, kPartResiduals = 2;
constexpr double kMovingDeviation = 0.5;  // of the deflection over the declared one, with the load's inertia
constexpr double kSkewWorth = 0.5;        // intervals, from which the load's motion is moved by the skew

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid) throw InvalidParameter(std::string("position_difference.") + name, value, limit);
}

void check(const PositionDifferenceSettings& s) {
  if (!s.elastic_deflection)
    throw InvalidParameter("position_difference.elastic_deflection", "empty", "needed");
  require(s.elastic_uncertainty > 0 && std::isfinite(s.elastic_uncertainty), "elastic_uncertainty",
          s.elastic_uncertainty, "must be > 0");
  for (const auto& [name, value] : {std::pair{"motor_inertia", s.motor_inertia},
                                    {"load_inertia", s.load_inertia},
                                    {"load_damping", s.load_damping},
                                    {"load_friction", s.load_friction}})
    require(value >= 0 && std::isfinite(value), name, value, "must be >= 0");
  require(s.load_ratio > 0 && std::isfinite(s.load_ratio), "load_ratio", s.load_ratio, "must be > 0");
  require(std::isfinite(s.encoder_skew), "encoder_skew", s.encoder_skew, "must be finite");
  require(!(s.base_radius <= 0), "base_radius", s.base_radius, "must be > 0");
}

/// One way to cut the record, and what it shows.
struct Cut {
  FlankReading reading;
  FlankFit fit;  // by the likeliest law
  const ToothLaw* law = nullptr;
  bool bent = false;              // no spring
  double least = 0, largest = 0;  // rad, play by all laws that are not ruled out, with its scatter

  double width() const { return largest - least; }
};

/// Mean square of the residuals, each at most so many typical ones.
double mean_square(const FlankFit& fit, double typical) {
  double sum = 0;
  for (const double left : fit.left) sum += std::pow(std::min(std::abs(left), kOutlying * typical), 2);
  return sum / double(std::max<std::size_t>(1, fit.left.size()));
}

Cut read_laws(FlankReading reading, const std::vector<ToothLaw>& laws) {
  Cut cut{std::move(reading), {}, &laws[0]};
  if (!cut.reading.found()) return cut;
  std::vector<FlankFit> fits;
  double typical = INFINITY;
  for (const ToothLaw& law : laws) {
    fits.push_back(cut.reading.fit(law));
    typical = std::min(typical, fits.back().residual);
  }
  std::vector<double> squares;
  for (const FlankFit& fit : fits) squares.push_back(std::max(1e-300, mean_square(fit, typical)));
  const auto best = std::size_t(std::min_element(squares.begin(), squares.end()) - squares.begin());
  const double stays = double(std::max<std::size_t>(3, cut.reading.stays()));
  const double errors = 1 + kLawErrors * kLawErrors / std::max(stays, fits[best].independent);
  const bool spring = laws.size() == 1 || best == kSpringLaw;
  const double apart = std::max(errors, spring ? kAnySpring : kAnyLaw);
  // Between two laws the squares follow a parabola about the likeliest one.
  const auto above = [&](std::size_t k) { return std::sqrt(squares[k] / squares[best] - 1); };
  cut.least = INFINITY, cut.largest = -INFINITY;
  for (std::size_t k = 0; k < laws.size(); ++k) {
    if (squares[k] > apart * squares[best]) continue;
    const double scatter =
        signal::student_t_quantile(0.975, std::max(1.0, 0.5 * stays - 1)) * fits[k].standard_error;
    cut.least = std::min(cut.least, fits[k].gap - scatter);
    cut.largest = std::max(cut.largest, fits[k].gap + scatter);
    for (const std::size_t next : {k - 1, k + 1}) {
      if (next >= laws.size() || squares[next] <= apart * squares[best]) continue;
      const double share = (std::sqrt(apart - 1) - above(k)) / (above(next) - above(k));
      const double between = fits[k].gap + share * (fits[next].gap - fits[k].gap);
      cut.least = std::min(cut.least, between - scatter);
      cut.largest = std::max(cut.largest, between + scatter);
    }
  }
  cut.fit = fits[best], cut.law = &laws[best];
  cut.bent = laws.size() > 1 && squares[kSpringLaw] > apart * squares[best];
  return cut;
}

/// The narrower of two cuts, and what the play changes by with the other one.
struct Answer {
  Cut cut;
  double change = 0;  // rad
  double skew = 0;    // s, that was taken out
  bool moving = false;
};

/// `wanted`: how many cuts, at most.
std::vector<Cut> cuts_of(const TwoEncoders& motion, TorqueBy by, const PositionDifferenceSettings& settings,
                         const std::vector<ToothLaw>& laws, std::size_t wanted) {
  std::vector<Cut> cuts;
  const bool locked = by == TorqueBy::drive;
  for (const std::size_t half : kHalves) {
    FlankWindows windows = average_windows(motion, half);
    FlankTorque torque = flank_torque(motion, windows, by, settings);
    if (torque.noise > kNoise * torque.level && half != std::end(kHalves)[-1] &&
        half != std::end(kHalves)[-2])
      continue;
    const double declared = std::abs(settings.elastic_deflection(torque.level));
    const double deviation =
        locked ? settings.elastic_uncertainty / signal::kNormalQuantile975 : kMovingDeviation;
    const ToothLaw& usual = laws[laws.size() > 1 ? kUsualLaw : 0];
    cuts.push_back(read_laws(
        FlankReading(std::move(windows), std::move(torque), declared, deviation, settings.load_ratio, usual),
        laws));
    if (cuts.size() == wanted) break;
  }
  return cuts;
}

/// The declared deflection, whose shape counts where the record shows one torque only.
std::vector<ToothLaw> declared_law(const TwoEncoders& motion, const PositionDifferenceSettings& settings) {
  std::vector<double> size;
  for (const double torque : motion.torque) size.push_back(std::abs(torque));
  const double large = std::max(1e-300, signal::quantile(std::move(size), 0.95));
  return {{"declared", [elastic = settings.elastic_deflection, large](double t) {
             const double all = elastic(large);
             return all != 0 ? elastic(t * large) / all : t;
           }}};
}

Answer read_flanks(TwoEncoders motion, TorqueBy by, const PositionDifferenceSettings& settings,
                   const std::vector<ToothLaw>& laws) {
  double skew = 0;
  if (by != TorqueBy::drive) {  // a late load encoder is late for the torque, too
    const std::vector<Cut> first = cuts_of(motion, by, settings, {laws[kUsualLaw]}, 1);
    if (!first.empty() && first[0].reading.found() &&
        std::abs(first[0].fit.skew) > kSkewWorth * motion.interval) {
      skew = first[0].fit.skew;
      motion = without_skew(std::move(motion), skew);
    }
  }
  std::vector<Cut> cuts = cuts_of(motion, by, settings, laws, 2);
  const bool both = cuts.size() == 2 && cuts[0].reading.found() && cuts[1].reading.found();
  const bool second = cuts.size() == 2 && cuts[1].reading.found() &&
                      (!cuts[0].reading.found() || cuts[1].width() < cuts[0].width());
  if (cuts.empty())
    throw Refusal{Status::insufficient_data, "the record is too short for windows of four samples"};
  const double change = both ? std::abs(cuts[0].fit.gap - cuts[1].fit.gap) : std::abs(cuts[second].fit.gap);
  return {std::move(cuts[second ? 1 : 0]), change, skew, by != TorqueBy::drive};
}

void require_both_flanks(const FlankReading& reading) {
  if (!reading.found())
    throw Refusal{Status::out_of_domain,
                  "torque does not press both flanks for twelve windows each; loads that drive, or that are "
                  "braked, would do"};
  if (reading.stays() < kFewestStays)
    throw Refusal{
        Status::insufficient_data,
        fmt::format("the motor lies on a flank only {} times, needed are {}", reading.stays(), kFewestStays)};
}

void require_steady_flanks(const Cut& cut) {
  const double share = cut.reading.share_that_swings(*cut.law, cut.fit);
  if (share > kSwings)
    throw Refusal{Status::out_of_domain,
                  fmt::format("flanks change within a few samples in {:.0f} % of the windows: a drive that "
                              "chatters; calmer torque or faster sampling would do",
                              100 * share)};
}

void require_this_machine(const FlankFit& fit, bool moving) {
  if (moving && !(fit.compliance > 1 / kFactor && fit.compliance < kFactor))
    throw Refusal{Status::out_of_domain, fmt::format("the deflection does not follow the torque as declared: "
                                                     "{:.4g} times the elastic deflection of the rig",
                                                     fit.compliance)};
  if (moving && fit.wrong > kWrong)
    throw Refusal{Status::out_of_domain,
                  fmt::format("friction or weight of the load are {:.2g} standard deviations from what is "
                              "declared over its inertia (60 and 30 %): which flank they press is not known",
                              fit.wrong)};
  if (moving && std::abs(fit.scale_error) > kScale)
    throw Refusal{Status::out_of_domain,
                  fmt::format("motor_position and load_position differ by {:.4g} % in scale: the reduction "
                              "ratio or an encoder is not as declared",
                              100 * fit.scale_error)};
}

/// A play that grows within the record gives groups of deflections that are those of no machine, and a play
/// that lies anywhere.
void require_constant(const Cut& cut) {
  const std::size_t n = cut.reading.windows();
  for (std::size_t parts = kMostParts; parts > 1; parts /= 2) {
    if (n / parts < kFewestWindows) continue;
    std::vector<FlankFit> fits;
    for (std::size_t k = 0; k < parts; ++k)
      if (FlankFit fit;
          cut.reading.fit_part(*cut.law, k * n / parts, (k + 1) * n / parts, fit) >= kFewestStays)
        fits.push_back(std::move(fit));
    if (2 * fits.size() < parts) continue;
    const auto less = [](const FlankFit& a, const FlankFit& b) { return a.gap < b.gap; };
    const auto [least, most] = std::minmax_element(fits.begin(), fits.end(), less);
    const double errors = kPartErrors * std::hypot(least->standard_error, most->standard_error) +
                          kPartResiduals * std::max(least->residual, most->residual);
    const double over_position = cut.fit.varies ? cut.fit.largest_gap - cut.fit.least_gap : 0;
    if (most->gap - least->gap > kPartChange * most->gap + errors + over_position)
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the play is not the same throughout the record: parts of it give {:.4g} to {:.4g} rad",
                      least->gap, most->gap)};
    return;
  }
}

/// An interval that is twice as wide as the play, and a good part of the deflection, says that play is not
/// distinguished from that.
void require_worth_saying(double width, const FlankFit& fit) {
  if (width > std::max(kWide * fit.gap, kWorthSaying * fit.elastic))
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the play is known to {:.4g} rad only, where the teeth yield by {:.4g} rad: too few "
                    "torques, or too few reversals, to distinguish play from deflection",
                    width, fit.elastic)};
}

std::string describe(const Answer& answer) {
  const FlankReading& reading = answer.cut.reading;
  const FlankFit& fit = answer.cut.fit;
  std::string message = fmt::format("{} and {} windows on the two flanks, {} stays; ", reading.used(0),
                                    reading.used(1), reading.stays());
  message += answer.moving ? fmt::format("elastic deflection from the record, {:.4g} times the declared",
                                         fit.compliance)
                           : std::string("elastic deflection as declared");
  if (answer.cut.bent) message += "; the deflection bends over the torque as that of " + answer.cut.law->name;
  if (answer.moving && std::abs(fit.scale_error) > 1e-4)
    message += fmt::format("; the difference of the encoders drifts by {:.4g} % of the travel",
                           100 * fit.scale_error);
  if (answer.skew != 0)
    message += fmt::format("; the load encoder is {:.3g} ms later than the rig file says",
                           1e3 * (answer.skew + fit.skew));
  if (reading.shown() > 0)
    message +=
        fmt::format("; the motor's torque shows a load of {:.3g} N m that no term declares", reading.shown());
  if (fit.varies)
    message += fmt::format(
        "; the play depends on the position of the load, from {:.4g} to {:.4g} rad: the interval holds it "
        "all",
        fit.least_gap, fit.largest_gap);
  return message;
}

/// What the machine's elastic deflection, both sides, may differ from the declared one by [rad].
double declared_error(const TwoEncoders& motion, const PositionDifferenceSettings& settings) {
  std::vector<double> size;
  for (const double torque : motion.torque) size.push_back(std::abs(torque));
  return 2 * settings.declared_uncertainty *
         std::abs(settings.elastic_deflection(signal::median(std::move(size))));
}

TorqueBy torque_by(const record::Record& record, const TwoEncoders& motion,
                   const PositionDifferenceSettings& settings) {
  const bool moving = load_travels(motion);
  if (settings.output_locked && travelled(motion.load) > kLockedTravel * travelled(motion.motor))
    throw Refusal{Status::out_of_domain,
                  fmt::format("the output moves by {:.4g} rad although the rig says that it is locked",
                              travelled(motion.load))};
  if (torque_at_flanks(record, settings).behind) return TorqueBy::sensor;
  if (settings.output_locked) require_possible(motion, settings.motor_inertia);
  if (!moving) return TorqueBy::drive;
  if (!(settings.load_inertia > 0))
    throw Refusal{Status::insufficient_data,
                  "the load moves, and no inertia of it is declared: link: inertia"};
  require_steady(motion, settings.motor_inertia);
  return TorqueBy::load;
}

void fill_from_flanks(const record::Record& record, const PositionDifferenceSettings& settings,
                      Estimate& estimate) {
  const TwoEncoders motion = without_skew(two_encoders(record, settings), settings.encoder_skew);
  const TorqueBy by = torque_by(record, motion, settings);
  const std::vector<ToothLaw> laws = by == TorqueBy::drive ? declared_law(motion, settings) : tooth_laws();
  Answer answer = read_flanks(motion, by, settings, laws);
  Cut& cut = answer.cut;
  require_both_flanks(cut.reading);
  if (answer.moving) require_steady_flanks(cut);
  require_this_machine(cut.fit, answer.moving);
  require_constant(cut);
  const FlankFit& fit = cut.fit;
  if (!answer.moving) estimate.declared = declared_error(motion, settings);
  const double model =
      answer.moving ? std::hypot(kModel * fit.gap, kElastic * fit.elastic, kResidual * fit.residual)
                    : std::hypot(kLockedModel * fit.gap, kLockedResidual * fit.residual,
                                 std::hypot(estimate.declared, settings.elastic_uncertainty * fit.elastic));
  const double half = std::hypot(answer.change, model);
  double lower = fit.gap - std::hypot(fit.gap - cut.least, half),
         upper = fit.gap + std::hypot(cut.largest - fit.gap, half);
  if (answer.moving) require_worth_saying(upper - lower, fit);
  if (fit.varies)
    lower = std::min(lower, fit.least_gap - half), upper = std::max(upper, fit.largest_gap + half);
  if (upper < 0)
    throw Refusal{Status::out_of_domain, fmt::format("the flanks are {:.4g} rad closer than the declared "
                                                     "elastic deflection allows: the rig is not this machine",
                                                     -fit.gap)};
  estimate.status = Status::ok;
  estimate.backlash_angle = std::max(0.0, fit.gap);
  estimate.angle_lower = std::max(0.0, lower);
  estimate.angle_upper = upper;
  estimate.backlash = settings.base_radius * estimate.backlash_angle;
  estimate.lower = settings.base_radius * estimate.angle_lower;
  estimate.upper = settings.base_radius * estimate.angle_upper;
  estimate.must_hold = fit.varies || cut.bent;
  estimate.message = describe(answer);
}

void fill(const record::Record& record, const PositionDifferenceSettings& settings, Estimate& estimate) {
  try {
    fill_from_flanks(record, settings, estimate);
  } catch (const Refusal&) {
    if (settings.output_locked) throw;
    const TwoEncoders motion = without_skew(two_encoders(record, settings), settings.encoder_skew);
    if (read_at_rest(motion, settings, estimate)) return;
    throw;
  }
}

}  // namespace

Estimate estimate_position_difference(const record::Record& record,
                                      const PositionDifferenceSettings& settings) {
  check(settings);
  return estimate_or_refusal("position_difference",
                             [&](Estimate& estimate) { fill(record, settings, estimate); });
}

}  // namespace backlash::diagnosis
