// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/position_difference.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/flank_fit.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "encoder_motion.h"
#include "flank_choice.h"
#include "refusal.h"
#include "rest_levels.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kLongestWindow = 64;  // samples, half a window
// Residuals fall by 2^2.5 per doubling of the window where second differences of noise dominate, by 2^0.5
// where white torque noise does; only the former is worth a longer window.
constexpr double kNoiseFalls = 2.0;
// Of the play, with a locked output: bouncing takes longer the larger the gap, until it fills the half
// period.
constexpr double kBounce = 0.03;
constexpr double kLockedTravel = 0.05;  // of the motor's travel
constexpr double kLockedResidual = 2;   // share of the rms residual in the interval, of a locked rig
// Of the play, of a moving load: what windows over touches and coarse encoders shift. Simulation.
constexpr double kMovingModel = 0.01;
// Of the deflection under a large torque: what friction that is not as modelled shifts. Simulation.
constexpr double kMovingElastic = 0.005;
// The same where the deflection bends otherwise than declared, and of the deflection under a large torque:
// its law is none of those that are tried exactly, and half a step between them shifts the play by that much.
constexpr double kBentModel = 0.03, kBentElastic = 0.05;
constexpr double kLargeTorque = 0.95;  // quantile, where laws of the deflection are the same: choice
// Of the deflection, that an interval of more than twice the play may be wide. Choice.
constexpr double kWorthSaying = 0.25;
constexpr double kLargestScaleError = 0.01;
// Of the compliance against the declared one. Where the torque has two values only, as with a slow square
// wave, nothing but the noise of the acceleration distinguishes compliance from play, and draws the former
// towards 0.
constexpr double kLargestFactor = 2;
// Parts of a record with a moving load give the same play: to within a share of it, their errors, and what
// the shape of the deflection leaves. Choices, tried on plays that grow within the record.
constexpr std::size_t kMostParts = 16, kFewestWindows = 32;  // of a part, at least
constexpr double kPartChange = 0.1, kPartErrors = 4, kPartResiduals = 2;
constexpr double kSkewErrors = 2;        // theory: standard errors to either side, 95 %
constexpr std::size_t kFewestStays = 6;  // on a flank

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid) throw InvalidParameter(std::string("position_difference.") + name, value, limit);
}

void check(const PositionDifferenceSettings& s) {
  if (!s.elastic_deflection)
    throw InvalidParameter("position_difference.elastic_deflection", "empty", "needed");
  require(s.elastic_uncertainty > 0 && std::isfinite(s.elastic_uncertainty), "elastic_uncertainty",
          s.elastic_uncertainty, "must be > 0");
  require(s.motor_inertia >= 0 && std::isfinite(s.motor_inertia), "motor_inertia", s.motor_inertia,
          "must be >= 0");
  require(s.load_ratio > 0 && std::isfinite(s.load_ratio), "load_ratio", s.load_ratio, "must be > 0");
  require(std::isfinite(s.encoder_skew), "encoder_skew", s.encoder_skew, "must be finite");
  require(!(s.base_radius <= 0), "base_radius", s.base_radius, "must be > 0");
}

struct Fits {
  FlankFit fit, longer;
  std::size_t half;  // samples, of the windows of `fit`
};

/// The shortest window that noise does not spoil, and the next.
Fits fit_record(const TwoEncoders& motion, const FlankModel& model) {
  std::size_t half = kShortestWindow;
  FlankFit fit = fit_flanks(average_windows(motion, half), model);
  for (;;) {
    half *= 2;
    FlankFit longer = fit_flanks(average_windows(motion, half), model);
    const bool noisy = longer.found && (!fit.found || fit.residual > kNoiseFalls * longer.residual);
    if (!noisy && (fit.found || half >= kLongestWindow)) return {fit, longer, half / 2};
    if (2 * half > kLongestWindow) return noisy ? Fits{longer, longer, half} : Fits{fit, longer, half / 2};
    fit = longer;
  }
}

const char* remedy_of(FlankObstacle obstacle) {
  switch (obstacle) {
    case FlankObstacle::one_direction:
      return "each flank is pressed in one direction of motion only: play looks like the dry friction of the "
             "motor there; loads that drive, or that are braked, would do";
    case FlankObstacle::chatter:
      return "flanks change within a few samples: a drive that chatters; calmer torque or faster sampling "
             "would do";
    case FlankObstacle::own_part:
      return "each flank is pressed in a part of the path, or at a torque, of its own: play looks like "
             "errors "
             "of the encoders, or like what the teeth yield; moves over other paths and at "
             "other speeds would do";
    default:
      return "torque does not press both flanks (10 % of the time at least); loads that drive, or that are "
             "braked, would do";
  }
}

void require_sound(const FlankFit& fit) {
  if (!fit.found) throw Refusal{Status::out_of_domain, remedy_of(fit.obstacle)};
  if (fit.stays < kFewestStays)
    throw Refusal{Status::insufficient_data, "the motor lies on a flank only " + std::to_string(fit.stays) +
                                                 " times, needed are " + std::to_string(kFewestStays)};
  const double factor = fit.compliance_factor;
  if (!(factor > 1 / kLargestFactor && factor < kLargestFactor))
    throw Refusal{Status::out_of_domain, fmt::format("the deflection does not follow the torque as declared: "
                                                     "{:.4g} times the elastic deflection of the rig",
                                                     factor)};
  if (std::abs(fit.scale_error) > kLargestScaleError)
    throw Refusal{Status::out_of_domain,
                  fmt::format("motor_position and load_position differ by {:.4g} % in scale: the reduction "
                              "ratio or an encoder is not as declared",
                              100 * fit.scale_error)};
}

double torque_size(const TwoEncoders& motion, double share) {
  std::vector<double> size;
  for (const double torque : motion.torque) size.push_back(std::abs(torque));
  return signal::quantile(size, share);
}

/// What the parts of a record give, in as many as half of them still give something.
std::vector<FlankFit> fits_of_parts(const FlankReading& whole) {
  const std::size_t n = whole.windows.size();
  for (std::size_t parts = kMostParts; parts > 1; parts /= 2) {
    std::vector<FlankFit> fits;
    for (std::size_t k = 0; k < parts; ++k) {
      if (n / parts < kFewestWindows) break;
      const FlankFit fit =
          fit_flanks(part_of(whole.windows, k * n / parts, (k + 1) * n / parts), whole.model);
      if (fit.found && fit.stays >= kFewestStays) fits.push_back(fit);
    }
    if (2 * fits.size() >= parts) return fits;
  }
  return {};
}

/// Noise of the torque draws the compliance, and with it the play, towards that of no deflection at all. And
/// a play that is another as soon as windows are longer, or by other windows that leave as little, is none.
void require_one_play(const FlankReading& reading) {
  const FlankFit& fit = reading.fit;
  if (!std::isfinite(fit.attenuation) || !std::isfinite(reading.windows_change))
    throw Refusal{
        Status::out_of_domain,
        "how the deflection follows the torque is lost in the noise of the torque or of the encoders"};
  if (reading.windows_change > std::max(0.0, fit.gap) + kPartErrors * error_of(fit))
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the play changes by {:.4g} rad with the length of the windows: motion that is too "
                    "slow or too even to distinguish play from deflection",
                    reading.windows_change)};
  if (std::abs(reading.another_gap - fit.gap) > kPartChange * fit.gap + kPartErrors * error_of(fit))
    throw Refusal{Status::out_of_domain,
                  fmt::format("the play is {:.4g} rad over some windows and {:.4g} rad over others that are "
                              "read as well: the torque, or the teeth, are not as declared",
                              fit.gap, reading.another_gap)};
}

/// An interval as wide as the elastic deflection, or one twice as wide as the play and as a good part of the
/// deflection, says that play is not distinguished from that.
void require_worth_saying(const FlankReading& reading, double width, double large_torque) {
  const double elastic = std::abs(reading.fit.compliance_factor * reading.model.elastic(large_torque));
  if (width > std::min(elastic, std::max(2 * reading.fit.gap, kWorthSaying * elastic)))
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the play is known to {:.4g} rad only, where the teeth yield by {:.4g} rad: too few "
                    "torques, or too few reversals, to distinguish play from deflection",
                    width, elastic)};
}

/// A play that grows within the record gives groups of deflections that are those of no machine, and a play
/// that lies anywhere. `whole`: what all of it gives.
void require_constant(const FlankReading& whole) {
  const std::vector<FlankFit> fits = fits_of_parts(whole);
  if (fits.empty()) return;
  const auto less = [](const FlankFit& a, const FlankFit& b) { return a.gap < b.gap; };
  const auto [least, most] = std::minmax_element(fits.begin(), fits.end(), less);
  const double errors = kPartErrors * std::hypot(least->standard_error, most->standard_error) +
                        kPartResiduals * std::max(least->residual, most->residual);
  const double over_position = whole.fit.varies ? whole.fit.largest_gap - whole.fit.least_gap : 0;
  if (most->gap - least->gap > kPartChange * most->gap + errors + over_position)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the play is not the same throughout the record: parts of it give {:.4g} to {:.4g} rad",
                    least->gap, most->gap)};
}

std::string describe(const FlankFit& fit, bool moves) {
  std::string message = std::to_string(fit.used[0]) + " and " + std::to_string(fit.used[1]) +
                        " windows on the two flanks, " + std::to_string(fit.stays) + " stays; ";
  message += fit.compliance_from_record
                 ? fmt::format("elastic deflection from the record, {:.4g} times the declared",
                               fit.compliance_factor)
                 : std::string("elastic deflection as declared");
  if (moves && std::abs(fit.scale_error) > 1e-4)
    message += fmt::format("; the difference of the encoders drifts by {:.4g} % of the travel",
                           100 * fit.scale_error);
  if (fit.varies)
    message += fmt::format(
        "; the play depends on the position of the load, from {:.4g} to {:.4g} rad: the interval holds it "
        "all",
        fit.least_gap, fit.largest_gap);
  return message;
}

/// What the machine's elastic deflection, both sides, may differ from the declared one by [rad].
double declared_error(const TwoEncoders& motion, const PositionDifferenceSettings& settings) {
  const double level = torque_size(motion, 0.5);
  return 2 * settings.declared_uncertainty * std::abs(settings.elastic_deflection(level));
}

/// What the flanks show, and how wide the interval must be for what is known of the record [rad].
struct Answer {
  FlankFit fit;
  double half = 0;                // of the interval, about each of
  double least = 0, largest = 0;  // rad, play by all that the record does not rule out
  std::string remark;
  bool declared_law = true;
  double declared = 0;  // rad, share of the declared machine in `half`
};

/// Of a locked output all windows lie at nearly one torque: the declared deflection counts.
Answer read_locked(const TwoEncoders& motion, const FlankModel& model,
                   const PositionDifferenceSettings& settings) {
  const Fits fits = fit_record(motion, model);
  require_sound(fits.fit);
  FlankReading whole;
  whole.windows = average_windows(motion, fits.half);
  whole.model = model;
  whole.fit = fits.fit;
  require_constant(whole);
  const double windows = fits.longer.found ? std::abs(fits.longer.gap - fits.fit.gap) : 0;
  const double unexplained = std::hypot(kLockedResidual * fits.fit.residual, kBounce * fits.fit.gap);
  const double half = std::hypot(std::hypot(scatter_of(fits.fit), windows),
                                 std::hypot(unexplained, declared_error(motion, settings)));
  return {fits.fit, half, fits.fit.gap, fits.fit.gap, ""};
}

/// A reading, and the skew of the encoders that was taken out for it.
struct Unskewed {
  FlankReading reading;
  signal::Measured skew = {0, 0};
};

/// Friction that is not as declared looks like a skew to whoever looks at the whole record: it is taken out
/// where the flanks are then known more surely.
Unskewed read_unskewed(const TwoEncoders& motion, const FlankModel& model, double torque) {
  Unskewed together{read_flanks(motion, model, torque), {0, 0}};
  const signal::Measured skew = clear_skew(motion, model.inertia);
  if (skew.value == 0) return together;
  FlankReading other = read_flanks(without_skew(motion, skew.value), model, torque);
  if (other.fit.found &&
      (!together.reading.fit.found || error_of(other.fit) < error_of(together.reading.fit)))
    together = {std::move(other), skew};
  return together;
}

/// By how much the play changes at either end of the interval of the skew that was taken out.
double skew_change(const TwoEncoders& motion, const FlankReading& reading, const signal::Measured& skew) {
  if (skew.standard_error == 0) return 0;
  double largest = 0;
  for (const double side : {-kSkewErrors, kSkewErrors}) {
    const FlankFit fit = read_again(without_skew(motion, skew.value + side * skew.standard_error), reading);
    if (!fit.found)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the load encoder is {:.3g} +- {:.2g} ms late, and within that error the "
                                "flanks are lost",
                                1e3 * skew.value, 1e3 * skew.standard_error)};
    largest = std::max(largest, std::abs(fit.gap - reading.fit.gap));
  }
  return largest;
}

Answer read_moving(const TwoEncoders& motion, const FlankModel& model) {
  require_steady(motion, model.inertia);
  const double large_torque = torque_size(motion, kLargeTorque);
  const auto [reading, skew] = read_unskewed(motion, model, large_torque);
  const FlankFit& fit = reading.fit;
  require_sound(fit);
  require_one_play(reading);
  require_constant(reading);
  const double elastic = fit.compliance_factor * reading.model.elastic(large_torque);
  const double model_error = reading.declared_law
                                 ? std::hypot(kMovingModel * fit.gap, kMovingElastic * elastic)
                                 : std::hypot(kBentModel * fit.gap, kBentElastic * elastic);
  const double half = std::hypot(
      std::hypot(scatter_of(fit), reading.windows_change),
      std::hypot(std::hypot(kResidualShare * fit.residual, model_error), skew_change(motion, reading, skew)));
  Answer answer{fit, half, reading.least, reading.largest, ""};
  (fit.attenuation < 0 ? answer.least : answer.largest) += fit.attenuation;
  require_worth_saying(reading, answer.largest - answer.least + 2 * half, large_torque);
  answer.declared_law = reading.declared_law;
  if (!reading.declared_law)
    answer.remark += "; the deflection bends over the torque otherwise than declared";
  if (skew.value != 0)
    answer.remark += fmt::format("; the load encoder is {:.3g} +- {:.2g} ms later than the rig file says",
                                 1e3 * skew.value, 1e3 * skew.standard_error);
  return answer;
}

Answer read(const record::Record& record, const PositionDifferenceSettings& settings) {
  const TwoEncoders motion = without_skew(two_encoders(record, settings), settings.encoder_skew);
  if (settings.output_locked && travelled(motion.load) > kLockedTravel * travelled(motion.motor))
    throw Refusal{Status::out_of_domain,
                  fmt::format("the output moves by {:.4g} rad although the rig says that it is locked",
                              travelled(motion.load))};
  const double inertia = torque_at_flanks(record, settings).behind ? 0 : settings.motor_inertia;
  if (settings.output_locked) require_possible(motion, inertia);
  FlankModel model;
  model.elastic = settings.elastic_deflection;
  model.inertia = inertia;
  model.elastic_deviation = settings.elastic_uncertainty / 1.96;
  model.moving = load_travels(motion);
  Answer answer = model.moving ? read_moving(motion, model) : read_locked(motion, model, settings);
  answer.remark = describe(answer.fit, model.moving) + answer.remark;
  if (!model.moving) answer.declared = declared_error(motion, settings);
  return answer;
}

void fill(const record::Record& record, const PositionDifferenceSettings& settings, Estimate& estimate) {
  Answer answer;
  try {
    answer = read(record, settings);
  } catch (const Refusal&) {
    if (settings.output_locked) throw;
    const TwoEncoders motion = without_skew(two_encoders(record, settings), settings.encoder_skew);
    if (read_at_rest(motion, settings, estimate)) return;
    throw;
  }
  const FlankFit& fit = answer.fit;
  double lower = answer.least - answer.half, upper = answer.largest + answer.half;
  if (fit.varies) {
    lower = std::min(lower, fit.least_gap - answer.half);
    upper = std::max(upper, fit.largest_gap + answer.half);
  }
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
  estimate.declared = answer.declared;
  estimate.must_hold = fit.varies || !answer.declared_law;
  estimate.message = answer.remark;
}

}  // namespace

Estimate estimate_position_difference(const record::Record& record,
                                      const PositionDifferenceSettings& settings) {
  check(settings);
  return estimate_or_refusal("position_difference",
                             [&](Estimate& estimate) { fill(record, settings, estimate); });
}

}  // namespace backlash::diagnosis
