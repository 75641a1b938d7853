// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/waveform.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "refusal.h"
#include "waveform_solution.h"

namespace backlash::diagnosis {
namespace {

// Half widths in standard errors are Student's of the windows, but for these.
constexpr double kErrorsFree =
    2.9;  // of a free link with position: of 172 answers about rigs of a simulator that is not
          // ours, most with something that the file has not, 9 missed by this, 19 by 2
constexpr double kErrorsAlone =
    2.3;  // of torque alone: simulation, 863 drawn machines, of which 93 % held by 2.1
// The gates, but for the noise of a sampled torque (waveform_solution.cpp).
constexpr double kMostLeft = 0.05;    // of the swing of a channel, that is no noise: choice
constexpr double kMostLeftOut = 0.5;  // of the windows: choice
constexpr double kFarthest = 4;       // spreads, of an inertia or a stiffness: choice
constexpr double kVague = 4;      // upper over lower end of an interval, by which it says too little: choice
constexpr double kRivalCost = 9;  // chi^2 of three standard errors: theory
// What the message says of the file: values beyond what it says of them, one spread, and surely so, as the
// record shows them. A message that is wrong costs a commissioning; one that lacks hides a wrong file.
// Choices.
constexpr double kBeyondSpread = 1;  // spreads
constexpr double kErrorsFar = 3;     // standard errors

void check(const WaveformSettings& s) {
  const auto require = [](const char* name, double value) {
    if (!(value > 0 && std::isfinite(value)))
      throw InvalidParameter(std::string("waveform.") + name, value, "must be > 0");
  };
  require("base_radius", s.base_radius);
  require("motor_inertia", s.motor_inertia);
  require("pinion_inertia", s.pinion_inertia);
  require("motor_damping", s.motor_damping);
  require("sensor_stiffness", s.sensor_stiffness);
  require("sensor_damping", s.sensor_damping);
  if (s.output != WaveformOutput::link) {
    require("gear_inertia", s.gear_inertia);
    require("output_stiffness", s.output_stiffness);
    require("output_damping", s.output_damping);
  }
  if (s.output != WaveformOutput::locked) {
    require("link_inertia", s.link_inertia);
    if (!std::isnan(s.link_damping)) require("link_damping", s.link_damping);
    if (!(s.link_friction >= 0))
      throw InvalidParameter("waveform.link_friction", s.link_friction, "must be >= 0");
  }
  require("contact_stiffness", s.contact_stiffness);
  if (!std::isnan(s.contact_loss)) require("contact_loss", s.contact_loss);
  if (!std::isnan(s.contact_damping)) require("contact_damping", s.contact_damping);
  if (!(s.contact_exponent >= 1 && s.contact_exponent <= 1.5))
    throw InvalidParameter("waveform.contact_exponent", s.contact_exponent, "must be 1 to 1.5");
  if (s.angular && s.base_radius != 1)
    throw InvalidParameter("waveform.base_radius", s.base_radius, "must be 1 of a mesh of angles");
  require("friction_speed", s.friction_speed);
  require("sensor_gain", s.sensor_gain);
  if (!(s.dry_friction >= 0)) throw InvalidParameter("waveform.dry_friction", s.dry_friction, "must be >= 0");
}

/// From what the file says, with the scale that its values have in common.
double deviations(const WaveformSolution& s, std::size_t k) {
  return std::fabs(s.z[k]) / std::hypot(1, s.priors.common(static_cast<int>(k)));
}

}  // namespace

void refuse_waveform(const WaveformSolution& s) {
  static const char* const kNames[] = {"torque", "position"};
  if (s.left_out > kMostLeftOut * s.windows)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("about {} of {} reversals the motion is not that of the machine of the rig file",
                    s.left_out, s.windows)};
  for (int c = 0; c < (s.position() ? 2 : 1); ++c)
    if (const double left = s.misfit[c].left() / s.misfit[c].swing; !(left < kMostLeft))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the machine of the rig file, whatever its values and what it may lack, does not "
                      "explain the {}: {:.2g} % of its swing are left that are no noise",
                      kNames[c], 100 * left)};
  for (const int k : {kSensorStiffness, kMotorInertia, kPinionInertia, kGearInertia, kOutputStiffness})
    if (const double away = deviations(s, std::size_t(k)); away > kFarthest)
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the record fits only a machine far from that of the rig file: {} {:.3g}, {:.1f} "
                      "standard deviations from what the file says",
                      waveform_value_name(k), s.values[std::size_t(k)], away)};
}

namespace {

double error_of(const WaveformSolution& s, std::size_t k) {
  const fit::Prior& prior = s.priors.shared[k];
  if (!(prior.spread > 0)) return kNaN;
  return s.left_of_spread[k] * prior.spread * (prior.factor ? s.values[k] : 1);
}

std::vector<ContradictedValue> contradicted(const WaveformSolution& s, const WaveformSettings& settings) {
  std::vector<ContradictedValue> found;
  for (std::size_t k = kHalfGap + 1; k <= kSensorGain; ++k)
    if (deviations(s, k) > kBeyondSpread && std::fabs(s.z[k]) > kErrorsFar * s.left_of_spread[k])
      found.push_back({waveform_value_name(static_cast<int>(k)),
                       waveform_quantities()[k - 1].unit_in(settings),  // both start with the motor's damping
                       s.priors.shared[k].centre, s.values[k], error_of(s, k)});
  return found;
}

/// What is left, and which of what a file may lack takes most.
std::string lacking_text(const WaveformSolution& s) {
  std::string text;
  for (std::size_t k = s.position() ? kTeethHysteresis : kStribeck; k < kGlobalValues; ++k)
    if (std::fabs(s.z[k]) > kBeyondSpread && std::fabs(s.z[k]) > kErrorsFar * s.left_of_spread[k])
      text += fmt::format("{} {:.2g}, ", waveform_value_name(static_cast<int>(k)), s.values[k]);
  text += fmt::format("{:.2g} % of the torque",
                      100 * s.misfit[kTorqueChannel].left() / s.misfit[kTorqueChannel].swing);
  if (s.position())
    text += fmt::format(" and {:.2g} % of the position",
                        100 * s.misfit[kPositionChannel].left() / s.misfit[kPositionChannel].swing);
  return text + " are not explained";
}

std::string message_of(const WaveformSolution& s, const std::vector<ContradictedValue>& far) {
  const bool position = s.position();
  std::string text = fmt::format("fitted to {} of {} reversals, {}", s.windows - s.left_out, s.windows,
                                 position ? "torque and position" : "torque alone");
  if (!position) text += ": limited by the declared stiffness of the sensor and by inertias";
  if (s.lacking) text += "; the machine has something that the rig file lacks: " + lacking_text(s);
  const std::string wrong = contradiction_text(far);
  return wrong.empty() ? text : text + "; " + wrong;
}

std::shared_ptr<const WaveformEvidence> evidence_of(const WaveformSolution& s) {
  auto evidence = std::make_shared<WaveformEvidence>(s.evidence);
  for (const int place : kQuantityPlaces) {
    const auto k = static_cast<std::size_t>(place);
    const fit::Prior& prior = s.priors.shared[k];
    if (prior.spread > 0)
      evidence->values.push_back({prior.centre, prior.spread, s.values[k], error_of(s, k)});
    else
      evidence->values.emplace_back();
  }
  return evidence;
}

/// Ends of the interval of a gap, in `unit` of the backlash.
struct Ends {
  double lower, upper, of_file;  // of_file: half of the width that declared values leave open
};

/// Standard errors, and what is left of each channel taken for play: of the position as it is, of the torque
/// as a twist of the sensor, and there a typical torque of an effect that the fit has not, where the machine
/// has something that the rig file lacks. Equations of rigid flanks are no finer than `finest`.
Ends ends_of(const WaveformSolution& s, const WaveformSettings& settings, double half_gap) {
  const bool position = s.position();
  const double windows = std::max(1, s.windows - s.left_out - 1);
  const double errors = !position ? kErrorsAlone
                        : settings.output == WaveformOutput::locked
                            ? signal::student_t_quantile(0.975, windows)
                            : kErrorsFree;
  const double half = errors * s.log_error, backlash = 2 * half_gap;
  const double twist = std::hypot(s.misfit[kTorqueChannel].left(), s.lacking ? s.foreign_torque : 0) /
                       s.values[kSensorStiffness];
  const double shown = position ? s.misfit[kPositionChannel].left() : 0;
  const double least = std::hypot(s.finest, settings.base_radius * std::hypot(twist, shown));
  const double below = backlash * (1 - std::exp(-half)), above = backlash * (std::exp(half) - 1);
  return {std::max(0.0, backlash - std::hypot(below, least)), backlash + std::hypot(above, least), below};
}

void fill(Estimate& e, const WaveformSolution& s, const WaveformSettings& settings) {
  const double per_angle = settings.base_radius;
  Ends ends = ends_of(s, settings, s.half_gap);
  e.backlash = 2 * s.half_gap;
  const bool beside = 2 * s.rival < ends.lower || 2 * s.rival > ends.upper;  // else it came to the same
  if (s.rival_cost < kRivalCost && beside) {
    const Ends rival = ends_of(s, settings, s.rival);
    ends.lower = std::min(ends.lower, rival.lower), ends.upper = std::max(ends.upper, rival.upper);
    if (ends.upper > kVague * ends.lower && std::max(s.rival, s.half_gap) > s.finest)
      throw Refusal{Status::ambiguous,
                    fmt::format("backlash of {:.4g} {} and of {:.4g} {} fit the record alike", 2 * s.half_gap,
                                s.unit, 2 * s.rival, s.unit)};
  }
  e.lower = ends.lower, e.upper = ends.upper;
  e.backlash_angle = e.backlash / per_angle;
  e.angle_lower = e.lower / per_angle, e.angle_upper = e.upper / per_angle;
  const bool some = e.lower > 0;
  if (settings.angular) e.backlash = e.lower = e.upper = kNaN;
  if (!s.position()) e.declared = ends.of_file / per_angle;  // nearly all of it, by the symmetry
  e.from_record = e.fits_machine = true;
  e.must_hold = s.lacking;  // the other methods take the machine of the file
  e.declared_wrong = contradicted(s, settings);
  e.message = message_of(s, e.declared_wrong);
  e.status = some ? Status::ok : Status::below_range;
  if (some) return;
  e.message = "no more play than equations of rigid flanks resolve; " + e.message;
  e.backlash = e.backlash_angle = kNaN;
}

}  // namespace

void check_waveform(const record::Record& record, const WaveformSettings& settings) {
  using record::Channel;
  check(settings);
  for (const Channel channel : {Channel::motor_torque, Channel::sensor_torque})
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "needs " + record::channel_name(channel)};
  for (const Channel channel : {Channel::motor_torque, Channel::sensor_torque, Channel::motor_position})
    for (const double value : record.column(channel))
      if (!std::isfinite(value))
        throw Refusal{Status::insufficient_data, record::channel_name(channel) + " has gaps"};
}

Estimate estimate_waveform(const record::Record& record, const WaveformSettings& settings) {
  check(settings);
  return estimate_or_refusal("waveform", [&](Estimate& estimate) {
    check_waveform(record, settings);
    const WaveformSolution solution = solve_waveform(record, settings);
    estimate.waveform = evidence_of(solution);
    refuse_waveform(solution);
    fill(estimate, solution, settings);
  });
}

}  // namespace backlash::diagnosis
