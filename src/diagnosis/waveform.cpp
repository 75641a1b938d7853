// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/waveform.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "refusal.h"
#include "waveform_solution.h"

namespace backlash::diagnosis {
namespace {

constexpr double kErrors = 2;  // half width in standard errors, 95 %
// The same of a free link: of 172 answers about rigs of a simulator that is not ours, most with something
// that the file has not, 9 missed by this, 19 by 2.
constexpr double kErrorsFree = 2.9;
constexpr double kErrorsAlone =
    2.3;  // of torque alone: simulation, 863 drawn machines, of which 93 % held by 2.1
constexpr double kMostLeftOut = 0.34;  // of the windows: choice
constexpr double kMostPrior = 36;      // sum of squares of 19 values in spreads: theory, 1 % of chi^2
constexpr double kFarthest = 4;        // spreads, of one value: choice
constexpr double kMostNoise = 1.3;     // residual per noise of the signal: choice
// Of the swing, part of the residual that is no noise: simulation, see test_waveform.cpp.
constexpr double kMostStructure[kWaveformChannels] = {0.01, 0.0006};
// What the message tells of the file: values beyond what it says of them, one spread, and surely so, as the
// record tells them. A message that is wrong costs a commissioning; one that lacks hides a wrong file.
// Choices.
constexpr double kFar = 1;           // spreads
constexpr double kErrorsFar = 3;     // standard errors
constexpr double kRivalCost = 9;     // chi^2 of three standard errors
constexpr double kRivalApart = 0.1;  // of the gap: choice

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
  const double common = s.common_scale * s.priors[k].power / s.priors[k].spread;
  return std::fabs(s.z[k]) / std::hypot(1, common);
}

std::string value_text(const WaveformSolution& s, std::size_t k) {
  return fmt::format("{} {:.3g}, {:.1f} standard deviations from what the file says",
                     waveform_value_name(static_cast<int>(k)), s.values[k], deviations(s, k));
}

void refuse_misfit(const WaveformSolution& s) {
  static const char* const kNames[] = {"torque", "position"};
  for (int c = 0; c < kWaveformChannels; ++c) {
    const WaveformMisfit& m = s.misfit[c];
    const double most = kMostStructure[c] * m.swing + m.drive;
    if (m.structure > most)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the machine of the rig file, whatever its values, does not explain the {}: "
                                "{:.2g} % of its swing are left that are no noise",
                                kNames[c], 100 * m.structure / m.swing)};
    if (m.rms > kMostNoise * m.noise && m.rms > most)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the machine of the rig file, whatever its values, does not explain the {}: "
                                "what is left is {:.2g} times its noise",
                                kNames[c], m.rms / m.noise)};
  }
}

}  // namespace

void refuse_waveform(const WaveformSolution& s) {
  if (s.left_out > kMostLeftOut * s.windows)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("about {} of {} reversals the motion is not that of the machine of the rig file",
                    s.left_out, s.windows)};
  refuse_misfit(s);
  std::size_t worst = kHalfGap + 1;
  for (std::size_t k = kHalfGap + 1; k < kGlobalValues; ++k)
    if (deviations(s, k) > deviations(s, worst)) worst = k;
  if (s.prior_cost > kMostPrior || deviations(s, worst) > kFarthest)
    throw Refusal{Status::out_of_domain,
                  "the record fits only a machine far from that of the rig file: " + value_text(s, worst)};
  if (s.rival_cost < kRivalCost &&
      2 * std::fabs(s.rival - s.half_gap) > std::max(s.finest, 2 * kRivalApart * s.half_gap))
    throw Refusal{Status::ambiguous,
                  fmt::format("backlash of {:.4g} {} and of {:.4g} {} fit the record alike", 2 * s.half_gap,
                              s.unit, 2 * s.rival, s.unit)};
}

namespace {

double error_of(const WaveformSolution& s, std::size_t k) {
  if (!s.priors[k].fitted) return kNaN;
  return s.told[k] * s.priors[k].spread * (s.priors[k].factor ? s.values[k] : 1);
}

std::vector<ContradictedValue> contradicted(const WaveformSolution& s, const WaveformSettings& settings) {
  std::vector<ContradictedValue> found;
  for (std::size_t k = kHalfGap + 1; k <= kSensorGain; ++k)
    if (deviations(s, k) > kFar && std::fabs(s.z[k]) > kErrorsFar * s.told[k])
      found.push_back({waveform_value_name(static_cast<int>(k)),
                       waveform_quantities()[k - 1].unit_in(settings),  // both start with the motor's damping
                       s.priors[k].value, s.values[k], error_of(s, k)});
  return found;
}

std::string message_of(const WaveformSolution& s, const std::vector<ContradictedValue>& far, bool position) {
  std::string text = fmt::format("fitted to {} of {} reversals, {}", s.windows - s.left_out, s.windows,
                                 position ? "torque and position" : "torque alone");
  if (!position) text += ": limited by the declared stiffness of the sensor and by inertias";
  const std::string wrong = contradiction_text(far);
  return wrong.empty() ? text : text + "; " + wrong;
}

std::shared_ptr<const WaveformEvidence> evidence_of(const WaveformSolution& s) {
  auto evidence = std::make_shared<WaveformEvidence>(s.evidence);
  for (const int place : kQuantityPlaces) {
    const auto k = static_cast<std::size_t>(place);
    if (s.priors[k].fitted)
      evidence->values.push_back({s.priors[k].value, s.priors[k].spread, s.values[k], error_of(s, k)});
    else
      evidence->values.emplace_back();
  }
  return evidence;
}

void fill(Estimate& e, const WaveformSolution& s, const WaveformSettings& settings, bool position) {
  const double per_angle = settings.base_radius;
  e.backlash = 2 * s.half_gap;
  const double errors = settings.output == WaveformOutput::locked ? kErrors : kErrorsFree;
  const double half = (position ? errors : kErrorsAlone) * s.log_error;
  const double below = e.backlash * (1 - std::exp(-half)), above = e.backlash * (std::exp(half) - 1);
  e.lower = std::max(0.0, e.backlash - std::hypot(below, s.finest));
  e.upper = e.backlash + std::hypot(above, s.finest);
  e.backlash_angle = e.backlash / per_angle;
  e.angle_lower = e.lower / per_angle, e.angle_upper = e.upper / per_angle;
  const bool some = e.lower > 0;
  if (settings.angular) e.backlash = e.lower = e.upper = kNaN;
  if (!position) e.declared = below / per_angle;  // nearly all of it, by the symmetry
  e.from_record = e.fits_machine = true;
  e.declared_wrong = contradicted(s, settings);
  e.message = message_of(s, e.declared_wrong, position);
  e.status = some ? Status::ok : Status::below_range;
  if (some) return;
  e.message = "no more play than equations of rigid flanks can tell; " + e.message;
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
    fill(estimate, solution, settings, record.has(record::Channel::motor_position));
  });
}

}  // namespace backlash::diagnosis
