// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/decay.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust_mean.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kSearched = 12;  // choice: periods after a step in which ringing may begin
constexpr double kShape =
    0.01;  // simulation: of the amplitude: misfit that contact with friction and drift leaves
constexpr double kNoiseMargin = 1.2;   // choice: of the residuals' deviation over the noise
constexpr double kLeastAmplitude = 5;  // choice: deviations
constexpr int kHeld = 2;               // choice: eighths of a period
constexpr double kSteady = 0.1;        // choice: of the torque's travel: it is constant within this

using Values = std::vector<double>;

/// Standard deviation of the noise from fourth differences, which slow signals do not reach; not below that
/// of the sensor's steps, which a signal at rest does not show.
double noise_of(const Values& y) {
  const double step = signal::smallest_step(y, 1e-9 * signal::peak_to_peak(y));
  return std::max(signal::noise_from_differences(y, 4), step / std::sqrt(12.0));
}

/// Where a two-level signal changes level, with a dead band of half its travel about the middle.
std::vector<int> steps_of(const Values& y) {
  const double low = signal::quantile(y, 0.05), high = signal::quantile(y, 0.95);
  std::vector<int> steps;
  int level = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const int now = y[i] > 0.25 * low + 0.75 * high ? 1 : y[i] < 0.75 * low + 0.25 * high ? -1 : level;
    if (level != 0 && now != level) steps.push_back(int(i));
    level = now;
  }
  return steps;
}

Values difference(const Values& a, const Values& b) {
  Values d(a.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = a[i] - b[i];
  return d;
}

/// What the search for stretches needs of a record.
struct Run {
  record::Record record;
  Values signal, motor_speed, load_speed;
  std::vector<int> steps;
  double interval = 0, period = 0, noise = 0, torque_travel = 0;
};

Values speed_of(const record::Record& record, record::Channel speed, record::Channel position,
                double interval, double period) {
  const double cutoff = std::min(4 / period, 0.4 / interval);
  if (record.has(speed)) return signal::low_pass(record.column(speed), interval, cutoff);
  return signal::derivative(signal::low_pass(record.column(position), interval, cutoff), interval);
}

RingingSignal signal_of(const record::Record& record, const DecaySettings& settings) {
  const bool speeds =
      record.has(record::Channel::motor_velocity) && record.has(record::Channel::load_velocity);
  const bool positions =
      record.has(record::Channel::motor_position) && record.has(record::Channel::load_position);
  const RingingSignal signal =
      settings.signal.value_or(speeds ? RingingSignal::speed_difference : RingingSignal::position_difference);
  if (signal == RingingSignal::speed_difference ? !speeds : !positions)
    throw CannotIdentify("damping from ringing needs the speeds or the positions of motor and load");
  if (!positions && !record.has(record::Channel::motor_torque))
    throw CannotIdentify(
        "damping from ringing needs the motor's torque or both positions to find the engagements");
  return signal;
}

Run prepare(const record::Record& given, RingingSignal signal, double period) {
  Run run;
  run.record = record::evenly_sampled(given);
  const record::Record& r = run.record;
  run.interval = r.sampling_interval();
  run.period = period;
  if (period < 8 * run.interval)
    throw CannotIdentify(
        fmt::format("ringing of {:.4g} Hz cannot be seen at {:.4g} Hz", 1 / period, 1 / run.interval));
  const bool speeds = signal == RingingSignal::speed_difference;
  run.signal =
      difference(r.column(speeds ? record::Channel::motor_velocity : record::Channel::motor_position),
                 r.column(speeds ? record::Channel::load_velocity : record::Channel::load_position));
  run.noise = noise_of(run.signal);
  run.motor_speed =
      speed_of(r, record::Channel::motor_velocity, record::Channel::motor_position, run.interval, period);
  run.load_speed =
      speed_of(r, record::Channel::load_velocity, record::Channel::load_position, run.interval, period);
  const Values& torque = r.column(record::Channel::motor_torque);
  run.steps = steps_of(!torque.empty() ? torque
                                       : difference(r.column(record::Channel::motor_position),
                                                    r.column(record::Channel::load_position)));
  if (!torque.empty()) run.torque_travel = signal::quantile_range(torque, 0.05);
  return run;
}

/// The sample before which a stretch from `start` has to end: `limit`, or where a body turns back or the
/// torque moves.
int end_of(const Run& run, int start, int limit) {
  const Values& torque = run.record.column(record::Channel::motor_torque);
  for (int i = start; i < limit; ++i) {
    if (run.motor_speed[i] * run.motor_speed[start] <= 0 || run.load_speed[i] * run.load_speed[start] <= 0)
      return i;
    if (i > start && !torque.empty() && std::fabs(torque[i] - torque[start]) > kSteady * run.torque_travel &&
        std::fabs(torque[i - 1] - torque[start]) > kSteady * run.torque_travel)  // twice: no spike
      return i - 1;
  }
  return limit;
}

/// The ringing from `start`; nothing where it does not hold.
std::optional<Ringing> stretch(const Run& run, int start, int limit, const DecaySettings& settings) {
  const int longest = int(settings.longest * run.period / run.interval);
  const int end = end_of(run, start, std::min(limit, start + longest));
  if ((end - start) * run.interval < settings.shortest * run.period) return std::nullopt;
  const Values& time = run.record.time;
  try {
    Ringing r = fit_ringing({time.begin() + start, time.begin() + end},
                            {run.signal.begin() + start, run.signal.begin() + end}, 2 * M_PI / run.period);
    if (r.deviation > std::hypot(kNoiseMargin * run.noise, kShape * r.amplitude)) return std::nullopt;
    return r;
  } catch (const CannotIdentify&) {
    return std::nullopt;
  }
}

/// The earliest ringing after a step that holds, and still does a quarter of a period later, where the
/// fit begins: from a little before the contact the motion looks like the sine as well.
std::optional<Ringing> ringing_after(const Run& run, int step, int limit, const DecaySettings& settings) {
  const int stride = std::max(1, int(run.period / 8 / run.interval));
  const int last = std::min(limit, step + int(kSearched * run.period / run.interval));
  int held = 0;
  for (int start = step; start < last; start += stride) {
    std::optional<Ringing> r = stretch(run, start, limit, settings);
    if (r && held >= kHeld) {
      if (r->amplitude < kLeastAmplitude * r->deviation) return std::nullopt;  // and later ones are smaller
      measure_peaks(*r);
      return r;
    }
    held = r ? held + 1 : 0;
  }
  return std::nullopt;
}

signal::Measured of(const std::vector<Ringing>& ringings, signal::Measured Ringing::*quantity) {
  std::vector<signal::Measured> values;
  for (const Ringing& r : ringings) values.push_back(r.*quantity);
  return signal::robust_mean(values);
}

signal::Measured of_peaks(const std::vector<Ringing>& ringings) {
  std::vector<signal::Measured> values;
  for (const Ringing& r : ringings)
    if (std::isfinite(r.peak_damping_ratio))
      values.push_back({r.peak_damping_ratio, r.damping_ratio.standard_error});
  return values.size() < 2 ? signal::Measured{} : signal::robust_mean(values);
}

double relative_variance(const signal::Measured& m) {
  return std::isfinite(m.standard_error) ? std::pow(m.standard_error / m.value, 2) : 0;
}

void check(const DecaySettings& s) {
  if (!(s.stiffness.value > 0) || !std::isfinite(s.stiffness.value))
    throw InvalidParameter("stiffness", s.stiffness.value, "must be > 0");
  if (!(s.reduced_inertia.value > 0) || !std::isfinite(s.reduced_inertia.value))
    throw InvalidParameter("reduced_inertia", s.reduced_inertia.value, "must be > 0");
  if (!(s.shortest >= 1 && s.longest >= s.shortest))
    throw InvalidParameter("longest", s.longest, "and shortest must be 1 <= shortest <= longest periods");
  if (!(s.bearing_damping >= 0)) throw InvalidParameter("bearing_damping", s.bearing_damping, "must be >= 0");
  if (s.least_engagements < 2)
    throw InvalidParameter("least_engagements", s.least_engagements, "must be >= 2");
}

void fill(DecayIdentification& d, const DecaySettings& s) {
  d.damping_ratio = of(d.ringings, &Ringing::damping_ratio);
  d.natural_frequency = of(d.ringings, &Ringing::natural_frequency);
  d.peak_damping_ratio = of_peaks(d.ringings);
  const double k = s.stiffness.value, j = s.reduced_inertia.value, z = d.damping_ratio.value;
  const double variance = relative_variance(d.damping_ratio);
  d.damping.value = 2 * z * std::sqrt(k * j);
  d.damping.standard_error =
      d.damping.value *
      std::sqrt(variance + (relative_variance(s.stiffness) + relative_variance(s.reduced_inertia)) / 4);
  const signal::Measured rate = of(d.ringings, &Ringing::rate);
  d.damping_by_rate.value = 2 * rate.value * j;
  d.damping_by_rate.standard_error =
      d.damping_by_rate.value * std::sqrt(relative_variance(rate) + relative_variance(s.reduced_inertia));
  d.damping.value -= s.bearing_damping;
  d.damping_by_rate.value -= s.bearing_damping;
  const double expected = std::sqrt(k / j), found = d.natural_frequency.value;
  if (std::fabs(found / expected - 1) > 0.05)
    d.warnings.push_back(
        fmt::format("the ringing is at {:.4g} Hz, stiffness and inertia give {:.4g} Hz: one of them does not "
                    "belong to this record",
                    found / (2 * M_PI), expected / (2 * M_PI)));
  if (std::isfinite(d.peak_damping_ratio.value) && std::fabs(d.peak_damping_ratio.value / z - 1) > 0.2)
    d.warnings.push_back(fmt::format("the peaks give a damping ratio of {:.4g}, the whole ringing {:.4g}",
                                     d.peak_damping_ratio.value, z));
}

}  // namespace

DecayIdentification identify_decay(const record::Record& record, const DecaySettings& settings) {
  check(settings);
  DecayIdentification d;
  d.signal = signal_of(record, settings);
  const Run run = prepare(record, d.signal,
                          2 * M_PI * std::sqrt(settings.reduced_inertia.value / settings.stiffness.value));
  d.steps = int(run.steps.size());
  for (std::size_t i = 0; i < run.steps.size(); ++i) {
    const int limit = i + 1 < run.steps.size() ? run.steps[i + 1] : int(run.signal.size());
    if (std::optional<Ringing> r = ringing_after(run, run.steps[i], limit, settings))
      d.ringings.push_back(*r);
  }
  if (int(d.ringings.size()) < settings.least_engagements)
    throw CannotIdentify(fmt::format(
        "{} of {} steps are followed by ringing in contact above the noise ({:.4g}{}); {} are needed",
        d.ringings.size(), d.steps, run.noise,
        d.signal == RingingSignal::speed_difference ? " rad/s" : " rad", settings.least_engagements));
  fill(d, settings);
  return d;
}

}  // namespace backlash::identification
