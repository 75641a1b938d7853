#include "backlash_diagnosis/diagnosis/apd_skewness.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "backlash_diagnosis/diagnosis/signal_checks.h"

namespace backlash {
namespace {

double range_of(const std::vector<double>& x) {
  if (x.empty()) return 0;
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return *high - *low;
}

double largest_magnitude(const std::vector<double>& x) {
  double largest = 0;
  for (double v : x) largest = std::max(largest, std::fabs(v));
  return largest;
}

bool differs(double value, double reference, double tolerance) {
  return !(std::fabs(value - reference) <= tolerance * std::fabs(reference));
}

std::string mismatch(const char* what, double value, double reference, const char* unit) {
  std::ostringstream text;
  text.precision(4);
  text << what << " is " << value << ' ' << unit << ", the curve was made at " << reference << ' ' << unit;
  return text.str();
}

std::string excitation_mismatch(const Record& record, const CurveConditions& made) {
  const std::vector<double>& torque = record.column(Channel::motor_torque);
  if (torque.empty()) return {};
  if (range_of(torque) <= 0.05 * made.amplitude) return "motor_torque is constant: there is no excitation";
  // The median of the upper half stands for the amplitude, so that a noisy or spiky channel does not.
  if (differs(median_magnitude(torque), made.excitation_level, 0.05))
    return mismatch("excitation level (median of |motor_torque|)", median_magnitude(torque), made.excitation_level,
                    "N m");
  if (largest_magnitude(torque) < 0.95 * made.amplitude)
    return mismatch("excitation amplitude", largest_magnitude(torque), made.amplitude, "N m");
  return {};
}

std::string motion_mismatch(const Record& record, const MonitoringCurve& curve) {
  if (!curve.conditions.output_locked) return {};
  std::ostringstream text;
  text.precision(4);
  const double load = range_of(record.column(Channel::load_position));
  const double travel = range_of(record.column(Channel::motor_position));
  if (load > 0.05 * curve.conditions.motor_travel) {
    text << "the output moves by " << load << " rad, the rig says it is locked";
    return text.str();
  }
  if (travel > 1.5 * curve.conditions.motor_travel) {
    text << "the motor travels " << travel << " rad, more than any backlash on the curve allows ("
         << curve.conditions.motor_travel << " rad): output free, or backlash far above the curve";
    return text.str();
  }
  return {};
}

/// Level of the signal, as a stand-in where motor_torque was not recorded.
std::string level_mismatch(const Record& record, const ApdSettings& settings, const MonitoringCurve& curve) {
  if (record.has(Channel::motor_torque)) return {};
  double low = 1e300, high = 0;
  for (const CurvePoint& point : curve.points) {
    low = std::min(low, point.signal_level);
    high = std::max(high, point.signal_level);
  }
  const double level = median_magnitude(record.column(settings.signal));
  if (level < 0.75 * low) return mismatch("signal level (median magnitude)", level, low, "N m");
  if (level > 1.25 * high) return mismatch("signal level (median magnitude)", level, high, "N m");
  return {};
}

}  // namespace

double excitation_period(const Record& record, Channel signal) {
  const Channel source = record.has(Channel::motor_torque) ? Channel::motor_torque : signal;
  if (!record.has(source)) return 0;
  return detect_period(record.time, record.column(source)).value_or(0);
}

std::optional<Record> whole_periods(const Record& record, const ApdSettings& settings) {
  const double period = settings.period > 0 ? settings.period : excitation_period(record, settings.signal);
  if (!(period > 0) || record.size() < 2) return std::nullopt;
  const double interval = record.time[1] - record.time[0];
  const double origin = record.time[0] - 0.5 * interval;  // as PeriodAnalyser
  const double count = std::floor((record.time.back() + interval - origin) / period);
  if (count <= settings.settling_periods) return std::nullopt;
  return record.slice(origin + settings.settling_periods * period, origin + count * period);
}

ApdResult analyse_apd(const Record& record, const ApdSettings& settings) {
  ApdResult result;
  result.total = AmplitudeDistribution(settings.layout);
  result.period = settings.period > 0 ? settings.period : excitation_period(record, settings.signal);
  if (!record.has(settings.signal) || !(result.period > 0)) return result;
  const std::vector<double>& signal = record.column(settings.signal);
  PeriodAnalyser analyser(result.period, settings.layout);
  double sum = 0;
  for (std::size_t i = 0; i < record.size(); ++i) {
    const PeriodResult* period = analyser.add(record.time[i], signal[i]);
    if (!period || period->index < settings.settling_periods) continue;
    if (!period->complete || std::isnan(period->apd.skewness())) {
      ++result.incomplete;
      continue;
    }
    result.periods.push_back(*period);
    result.total.merge(period->apd);
    sum += period->apd.skewness();
  }
  if (!result.periods.empty()) result.skewness = sum / result.periods.size();
  const double interval = record.sampling_interval();
  if (interval > 0) {
    const double start = record.time.front() + settings.settling_periods * result.period;
    const Record settled = record.slice(start - 0.5 * interval, record.time.back() + interval);
    result.noise = estimate_noise(settled.column(settings.signal), result.period / interval).value_or(kNaN);
  }
  return result;
}

std::string out_of_domain(const Record& record, const ApdResult& apd, const ApdSettings& settings,
                          const MonitoringCurve& curve) {
  const CurveConditions& made = curve.conditions;
  if (made.signal != channel_name(settings.signal))
    return "the curve is for the signal " + made.signal + ", not for " + channel_name(settings.signal);
  if (!(made.apd == settings.layout)) return "the curve was made with another class layout of the APD";
  const double interval = record.sampling_interval();
  if (!(interval > 0) || differs(1 / interval, made.sampling_rate, 0.02))
    return mismatch("sampling rate", interval > 0 ? 1 / interval : 0, made.sampling_rate, "Hz");
  if (range_of(record.column(settings.signal)) <= 0.05 * made.amplitude)
    return "the signal does not move: there is no excitation, or the sensor is dead";
  std::string reason = excitation_mismatch(record, made);
  if (reason.empty()) reason = level_mismatch(record, settings, curve);
  if (!reason.empty()) return reason;
  const double period = excitation_period(record, settings.signal);
  if (made.frequency > 0 && apd.periods.size() >= 2) {
    if (!(period > 0)) return "no excitation period found in the record";
    if (differs(1 / period, made.frequency, 0.02 + interval / period))
      return mismatch("excitation frequency", 1 / period, made.frequency, "Hz");
  }
  if (looks_saturated(record.column(settings.signal)))
    return "the signal stays at its extreme value: the sensor is saturated";
  return motion_mismatch(record, curve);
}

Estimate estimate_apd_skewness(const Record& record, const ApdResult& apd, const ApdSettings& settings,
                               const MonitoringCurve* curve) {
  Estimate estimate;
  estimate.method = "apd_skewness";
  estimate.skewness = apd.skewness;
  const auto refuse = [&estimate](Status status, const std::string& reason) {
    estimate.status = status;
    estimate.message = reason;
    return estimate;
  };
  if (!record.has(settings.signal))
    return refuse(Status::insufficient_data, "the record has no " + channel_name(settings.signal));
  if (!curve) return refuse(Status::insufficient_data, "no monitoring curve");
  const std::string reason = out_of_domain(record, apd, settings, *curve);
  if (!reason.empty()) return refuse(Status::out_of_domain, reason);
  if (apd.periods.empty())
    return refuse(Status::insufficient_data,
                  "no complete excitation period after " + std::to_string(settings.settling_periods) +
                      " settling period(s); " + std::to_string(apd.incomplete) + " had gaps");
  const double noise = std::isnan(apd.noise) ? curve->conditions.noise : apd.noise;
  return curve->invert(apd.skewness, static_cast<int>(apd.periods.size()), noise);
}

}  // namespace backlash
