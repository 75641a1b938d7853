// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/apd_skewness.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

constexpr double kNoiseExcess = 1.2;  // noise estimate over the largest on the curve that may be by chance
constexpr double kOftenNoise = 1.65;  // standard deviations of noise that a twentieth of the time exceeds

bool differs(double value, double reference, double tolerance) {
  return !(std::fabs(value - reference) <= tolerance * std::fabs(reference));
}

std::string mismatch(const char* what, double value, double reference, const char* unit) {
  return fmt::format("{0} is {1:.4g} {3}, the curve was made at {2:.4g} {3}", what, value, reference, unit);
}

/// `noise`: standard deviation of that of motor_torque.
std::string excitation_mismatch(const record::Record& record, const CurveConditions& made, double noise) {
  const std::vector<double>& torque = record.column(record::Channel::motor_torque);
  if (torque.empty()) return {};
  if (signal::peak_to_peak(torque) <= 0.05 * made.amplitude)
    return "motor_torque is constant: there is no excitation";
  // A level that a tenth of the time is exceeded stands for the amplitude: a few spikes or noise do not
  // change it.
  if (differs(signal_level(torque), made.excitation_level, 0.05))
    return mismatch("excitation level (median of |motor_torque|)", signal_level(torque),
                    made.excitation_level, "N m");
  std::vector<double> magnitude;
  magnitude.reserve(torque.size());
  for (const double v : torque) magnitude.push_back(std::fabs(v));
  const double largest = *std::max_element(magnitude.begin(), magnitude.end());
  if (largest < 0.95 * made.amplitude)
    return mismatch("excitation amplitude", largest, made.amplitude, "N m");
  const double often = signal::quantile(std::move(magnitude), 0.9);
  if (often > 1.1 * made.amplitude + kOftenNoise * noise)
    return mismatch("excitation amplitude", often, made.amplitude, "N m");
  return {};
}

std::string motion_mismatch(const record::Record& record, const MonitoringCurve& curve) {
  if (!curve.conditions.output_locked) return {};
  const double load = signal::peak_to_peak(record.column(record::Channel::load_position));
  const double travel = travel_of(record.column(record::Channel::motor_position));
  if (load > 0.05 * curve.conditions.motor_travel)
    return fmt::format("the output moves by {:.4g} rad, the rig says it is locked", load);
  if (travel > 1.05 * curve.conditions.motor_travel)
    return fmt::format(
        "the motor travels {:.4g} rad, more than any backlash on the curve allows ({:.4g} rad): output free, "
        "or backlash above the curve",
        travel, curve.conditions.motor_travel);
  return {};
}

/// Lowest and highest level of the signal on the curve.
std::pair<double, double> signal_levels(const MonitoringCurve& curve) {
  const auto [low, high] = std::minmax_element(
      curve.points.begin(), curve.points.end(),
      [](const CurvePoint& a, const CurvePoint& b) { return a.signal_level < b.signal_level; });
  return {low->signal_level, high->signal_level};
}

/// Level of the signal: with the output locked it follows the torque, whether that was recorded or not.
std::string level_mismatch(const record::Record& record, const ApdSettings& settings,
                           const MonitoringCurve& curve) {
  const auto [low, high] = signal_levels(curve);
  const double level = signal_level(record.column(settings.signal));
  const char* unit = record::channel_unit(settings.signal);
  if (level < 0.88 * low) return mismatch("signal level (median magnitude)", level, low, unit);
  if (level > 1.12 * high) return mismatch("signal level (median magnitude)", level, high, unit);
  return {};
}

}  // namespace

double travel_of(const std::vector<double>& position) {
  return signal::quantile(position, 0.95) - signal::quantile(position, 0.05);
}

double excitation_period(const record::Record& record, record::Channel signal) {
  const record::Channel source =
      record.has(record::Channel::motor_torque) ? record::Channel::motor_torque : signal;
  if (!record.has(source)) return 0;
  return detect_period(record.time, record.column(source)).value_or(0);
}

ApdResult analyse_apd(const PeriodWindow& window, const ApdSettings& settings) {
  const record::Record& record = window.record;
  ApdResult result;
  result.total = AmplitudeDistribution(settings.layout);
  result.period = window.period;
  if (!record.has(settings.signal) || !(result.period > 0)) return result;
  double sum = 0;
  for (const PeriodResult& period : window.periods) {
    const double skewness = period.apd.skewness();
    if (!period.complete || std::isnan(skewness)) {
      ++result.incomplete;
      continue;
    }
    result.periods.push_back(period);
    result.total.merge(period.apd);
    sum += skewness;
  }
  if (!result.periods.empty()) result.skewness = sum / static_cast<double>(result.periods.size());
  const double interval = record.sampling_interval();
  if (interval > 0) {
    const double samples_per_period = result.period / interval;
    result.noise_range = signal::estimate_noise(record.column(settings.signal), samples_per_period);
    if (static_cast<double>(record.size()) >= 2 * samples_per_period) result.noise = result.noise_range.upper;
  }
  return result;
}

namespace {

std::string frequency_mismatch(const record::Record& record, const ApdResult& apd,
                               const ApdSettings& settings, const CurveConditions& made) {
  if (!(made.frequency > 0) || apd.periods.size() < 2) return {};
  const double period = excitation_period(record, settings.signal);
  if (!(period > 0)) return "no excitation period found in the record";
  if (differs(1 / period, made.frequency, 0.02 + record.sampling_interval() / period))
    return mismatch("excitation frequency", 1 / period, made.frequency, "Hz");
  return {};
}

std::string noise_mismatch(const ApdResult& apd, const ApdSettings& settings, const MonitoringCurve& curve) {
  if (!(apd.noise > kNoiseExcess * curve.noise_levels.back())) return {};
  return fmt::format(
      "sensor noise is {0:.4g} {2} (standard deviation), the curve covers noise up to {1:.4g} {2}", apd.noise,
      curve.noise_levels.back(), record::channel_unit(settings.signal));
}

/// Whether the record is of the kind that the curve is for.
std::string kind_mismatch(const record::Record& record, const ApdSettings& settings,
                          const CurveConditions& made) {
  if (made.signal != record::channel_name(settings.signal))
    return "the curve is for the signal " + made.signal + ", not for " +
           record::channel_name(settings.signal);
  if (!(made.apd == settings.layout)) return "the curve was made with another class layout of the APD";
  const double interval = record.sampling_interval();
  if (!(interval > 0) || differs(1 / interval, made.sampling_rate, 0.02))
    return mismatch("sampling rate", interval > 0 ? 1 / interval : 0, made.sampling_rate, "Hz");
  return {};
}

double torque_noise(const record::Record& record, const CurveConditions& made) {
  const double per_period = made.frequency > 0 ? 1 / (made.frequency * record.sampling_interval()) : 0;
  const double noise = signal::estimate_noise(record.column(record::Channel::motor_torque), per_period).lower;
  return std::isnan(noise) ? 0 : noise;
}

}  // namespace

std::optional<Mismatch> out_of_domain(const record::Record& record, const ApdResult& apd,
                                      const ApdSettings& settings, const MonitoringCurve& curve) {
  using Concern = Mismatch::Concern;
  const CurveConditions& made = curve.conditions;
  const std::vector<double>& signal = record.column(settings.signal);
  std::string reason = kind_mismatch(record, settings, made);
  if (!reason.empty()) return Mismatch{Concern::curve, reason};
  if (signal::peak_to_peak(signal) <= 0.05 * signal_levels(curve).second)
    return Mismatch{Concern::signal,
                    "the signal does not move: there is no excitation, or the sensor is dead"};
  reason = excitation_mismatch(record, made, torque_noise(record, made));
  if (!reason.empty()) return Mismatch{Concern::excitation, reason};
  if (looks_saturated(signal))
    return Mismatch{Concern::signal, "the signal stays at its extreme value: the sensor is saturated"};
  reason = level_mismatch(record, settings, curve);
  if (!reason.empty()) return Mismatch{Concern::signal, reason};
  reason = frequency_mismatch(record, apd, settings, made);
  if (!reason.empty()) return Mismatch{Concern::excitation, reason};
  reason = noise_mismatch(apd, settings, curve);
  if (!reason.empty()) return Mismatch{Concern::signal, reason};
  reason = motion_mismatch(record, curve);
  if (!reason.empty()) return Mismatch{Concern::curve, reason};
  return std::nullopt;
}

namespace {

Estimate refuse(Status status, const std::string& reason) {
  Estimate estimate;
  estimate.status = status;
  estimate.message = reason;
  return estimate;
}

/// `mismatch` is set where the reason is a condition of the curve.
std::optional<Estimate> refusal(const record::Record& record, const ApdResult& apd,
                                const ApdSettings& settings, const MonitoringCurve* curve,
                                std::optional<Mismatch>& mismatch) {
  if (!record.has(settings.signal))
    return refuse(Status::insufficient_data, "the record has no " + record::channel_name(settings.signal));
  if (!curve) return refuse(Status::insufficient_data, "no monitoring curve");
  const std::string lacking = "no complete excitation period";
  const double expected = curve->conditions.frequency > 0 ? 1 / curve->conditions.frequency : apd.period;
  if (record.size() < kLeadingSamples || record.time.back() - record.time.front() < 0.9 * expected)
    return refuse(Status::insufficient_data, lacking + ": the record is too short");
  mismatch = out_of_domain(record, apd, settings, *curve);
  if (mismatch) return refuse(Status::out_of_domain, mismatch->reason);
  if (apd.periods.empty())
    return refuse(Status::insufficient_data, lacking + "; " + std::to_string(apd.incomplete) +
                                                 " had gaps or no sample inside the classes");
  if (std::isnan(apd.noise) && apd.noise_range.upper > kNoiseExcess * curve->noise_levels.back())
    return refuse(Status::insufficient_data,
                  "the sensor noise is unknown from one period at this sampling rate: record two or more");
  return std::nullopt;
}

/// Samples of the complete periods.
std::vector<double> samples_of(const record::Record& record, const ApdResult& apd, record::Channel signal) {
  std::vector<double> samples;
  const std::vector<double>& values = record.column(signal);
  std::size_t i = 0;
  for (const PeriodResult& period : apd.periods) {
    while (i < record.size() && record.time[i] < period.start) ++i;
    for (; i < record.size() && record.time[i] < period.end; ++i)
      if (std::isfinite(values[i])) samples.push_back(values[i]);
  }
  return samples;
}

}  // namespace

CurveMatch match_curve(const record::Record& record, const ApdResult& apd, const ApdSettings& settings,
                       const MonitoringCurve* curve) {
  CurveMatch match;
  match.refused = refusal(record, apd, settings, curve, match.mismatch);
  std::vector<double> samples = samples_of(record, apd, settings.signal);
  match.noise = signal::with_standard_error(apd.noise_range, samples.size());
  if (match.refused || !curve->family) return match;
  match.family = match_family(*curve, std::move(samples), match.noise);
  if (match.family->fits_no_member()) {
    const std::string reason = fmt::format(
        "the distribution is {:.3g} (rms) from the nearest of {}, simulated records were within {:.3g}: the "
        "machine does something that the rig does not contain, or has other values than the rig file",
        match.family->misfit, curve->conditions.rig, match.family->usual_misfit);
    match.mismatch = Mismatch{Mismatch::Concern::curve, reason};
    match.refused = refuse(Status::out_of_domain, reason);
  }
  return match;
}

Estimate estimate_apd_skewness(const ApdResult& apd, const CurveMatch& match, const MonitoringCurve* curve) {
  Estimate estimate = match.refused
                          ? *match.refused
                          : curve->invert(apd.skewness, static_cast<int>(apd.periods.size()), match.noise);
  // Beyond the curve skewness comes back to values that it has on the curve; the whole distribution notices.
  if (estimate.status == Status::ok && match.family && match.family->touches_end) {
    estimate.status = Status::ambiguous;
    estimate.backlash = estimate.backlash_angle = kNaN;
    estimate.message += "; but the distribution also fits the end of the curve, backlash may be larger";
  }
  if (!match.refused) widen(*curve, &DeclaredSpread::skewness, estimate);
  estimate.method = "apd_skewness";
  estimate.skewness = apd.skewness;
  return estimate;
}

}  // namespace backlash::diagnosis
