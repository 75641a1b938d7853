// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/coherence.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kFewestAverages = 16;
constexpr double kSegmentsPerAverage = 1 + 2.0 / 36;   // theory: Hann windows that overlap by half
constexpr double kExcited = 0.1;                       // of the mean power in the band, still excited
constexpr std::size_t kNarrow = 16;                    // lines; a narrower band is no broad one
constexpr double kFilled = 0.9;                        // share of the lines of the band that are excited
constexpr double kKurtosisLow = 2, kKurtosisHigh = 5;  // 3: Gaussian; 1: square wave, 1.5: sine

void check(const CoherenceSettings& s) {
  const auto require = [](bool valid, const char* name, double value, const char* limit) {
    if (!valid) throw InvalidParameter(std::string("coherence.") + name, value, limit);
  };
  require(s.segment > 0 && std::isfinite(s.segment), "segment", s.segment, "must be > 0");
  require(!(s.lower < 0), "lower", s.lower, "must be >= 0");
  require(!(s.upper <= 0) && !(s.upper <= s.lower), "upper", s.upper, "must be > lower");
  require(s.least_growth > 0, "least_growth", s.least_growth, "must be > 0");
  if (!s.baseline) return;
  require(s.baseline->loss >= 0 && s.baseline->loss <= 1, "baseline.loss", s.baseline->loss,
          "must be 0 to 1");
  require(s.baseline->deviation >= 0, "baseline.deviation", s.baseline->deviation, "must be >= 0");
}

int differences(record::Channel channel) {
  switch (channel) {
    case record::Channel::motor_position:
    case record::Channel::load_position:
    case record::Channel::reference_position:
      return 2;
    case record::Channel::motor_velocity:
    case record::Channel::load_velocity:
      return 1;
    default:
      return 0;
  }
}

struct Signals {
  std::vector<double> torque, response;
  double rate = 0;
};

/// What drives the motor. A factor does not change the coherence, so that a current needs no torque constant.
record::Channel driving(const record::Record& record) {
  const bool current_only =
      !record.has(record::Channel::motor_torque) && record.has(record::Channel::motor_current);
  return current_only ? record::Channel::motor_current : record::Channel::motor_torque;
}

Signals collect(const record::Record& record, const CoherenceSettings& settings) {
  for (const record::Channel channel : {driving(record), settings.response})
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "the record has no " + record::channel_name(channel)};
  Signals signals;
  const double interval = record.sampling_interval();
  signals.torque = record.column(driving(record));
  signals.response = record.column(settings.response);
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (!std::isfinite(signals.torque[i]) || !std::isfinite(signals.response[i]))
      throw Refusal{Status::insufficient_data, "the record has values that are not finite"};
    if (i > 0 && std::abs(record.time[i] - record.time[i - 1] - interval) > 0.5 * interval)
      throw Refusal{Status::out_of_domain, "the samples are not equidistant"};
  }
  for (int order = differences(settings.response); order > 0; --order) {
    for (std::size_t i = signals.response.size(); i-- > 1;) signals.response[i] -= signals.response[i - 1];
    signals.response.erase(signals.response.begin());
    signals.torque.erase(signals.torque.begin());
  }
  signals.rate = interval > 0 ? 1 / interval : 0;
  return signals;
}

double kurtosis(const std::vector<double>& x) {
  const double n = static_cast<double>(x.size()), mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
  double second = 0, fourth = 0;
  for (const double v : x) {
    const double square = (v - mean) * (v - mean);
    second += square / n;
    fourth += square * square / n;
  }
  return second > 0 ? fourth / (second * second) : 0;
}

struct Band {
  std::size_t begin = 0, end = 0;  // lines
};

/// The excited band, or the one asked for, checked to be filled with power.
Band excited_band(const CoherenceSpectrum& spectrum, const CoherenceSettings& settings) {
  const auto& f = spectrum.frequency;
  const auto& power = spectrum.input_power;
  const bool compare = settings.baseline.has_value();
  const double lower = std::isnan(settings.lower) && compare ? settings.baseline->lower : settings.lower;
  const double upper = std::isnan(settings.upper) && compare ? settings.baseline->upper : settings.upper;
  // At the edges of what is excited the windows leak, so a hundredth of the power stays outside on either
  // side.
  const double total = std::accumulate(power.begin(), power.end(), 0.0);
  double below = 0, above = 0;
  const auto left_out = [&](std::size_t i, double& sum) {
    sum += power[i];
    return sum < 0.01 * total;
  };
  Band band{0, f.size()};
  while (band.begin < band.end && (std::isnan(lower) ? left_out(band.begin, below) : f[band.begin] < lower))
    ++band.begin;
  while (band.end > band.begin &&
         (std::isnan(upper) ? left_out(band.end - 1, above) : f[band.end - 1] > upper))
    --band.end;
  const std::size_t lines = band.end > band.begin ? band.end - band.begin : 0;
  if (lines < kNarrow)
    throw Refusal{Status::out_of_domain, "torque is not broadband: its power lies in " +
                                             std::to_string(lines) + " lines, needed are " +
                                             std::to_string(kNarrow)};
  const auto first = power.begin() + static_cast<std::ptrdiff_t>(band.begin);
  const std::vector<double> inside(first, first + static_cast<std::ptrdiff_t>(lines));
  const double mean = std::accumulate(inside.begin(), inside.end(), 0.0) / static_cast<double>(lines);
  const auto excited =
      std::count_if(inside.begin(), inside.end(), [&](double p) { return p > kExcited * mean; });
  if (static_cast<double>(excited) < kFilled * static_cast<double>(lines))
    throw Refusal{Status::out_of_domain, "torque is not broadband: only " + std::to_string(excited) + " of " +
                                             std::to_string(lines) + " lines of its band have power"};
  return band;
}

void require_random(const record::Record& record) {
  const std::vector<double>& torque = record.column(driving(record));
  const double k = kurtosis(torque);
  if (k < kKurtosisLow || k > kKurtosisHigh)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("torque is not random noise: kurtosis {:.4g}, of Gaussian noise 3, of a square wave 1",
                    k)};
  if (const auto period = detect_period(record.time, torque))
    throw Refusal{
        Status::out_of_domain,
        fmt::format("torque repeats every {:.4g} s, so that any response repeats with it and is coherent",
                    *period)};
}

void judge(const CoherenceSettings& settings, CoherenceDetection& found) {
  found.status = Status::ok;
  found.message = fmt::format("mean loss of coherence {:.4g} from {:.4g} to {:.4g} Hz, {:.4g} averages",
                              found.loss, found.lower, found.upper, found.spectrum.averages);
  if (!settings.baseline) {
    found.message += "; without a baseline of the healthy machine no finding";
    return;
  }
  const double half = signal::kNormalQuantile975 * std::hypot(found.deviation, settings.baseline->deviation);
  found.index = found.loss - settings.baseline->loss;
  found.index_lower = found.index - half;
  found.index_upper = found.index + half;
  if (found.index_lower <= settings.least_growth && settings.least_growth <= found.index_upper) {
    found.status = Status::ambiguous;
    found.message += fmt::format("; grown by {:.4g} +- {:.4g}: cannot tell", found.index, half);
    return;
  }
  found.nonlinear = found.index_lower > settings.least_growth;
  found.message += *found.nonlinear ? "; play or another nonlinearity present, grown by "
                                    : "; no play or other nonlinearity seen, grown by ";
  found.message += fmt::format("{:.4g} +- {:.4g}", found.index, half);
}

void fill(const record::Record& record, const CoherenceSettings& settings, CoherenceDetection& found) {
  const Signals signals = collect(record, settings);
  require_random(record);
  const auto segment = 2 * static_cast<std::size_t>(std::lround(0.5 * settings.segment * signals.rate));
  const double averages =
      segment >= 8 ? 2.0 * static_cast<double>(signals.torque.size()) / static_cast<double>(segment) - 1 : 0;
  if (averages / kSegmentsPerAverage < kFewestAverages)
    throw Refusal{Status::insufficient_data,
                  fmt::format("the record holds {:.4g} segments of {:.4g} s, needed are {:.4g}",
                              std::max(0.0, std::floor(averages)), settings.segment,
                              std::ceil(kFewestAverages * kSegmentsPerAverage))};
  found.spectrum = estimate_coherence(signals.torque, signals.response, signals.rate, segment);
  const Band band = excited_band(found.spectrum, settings);
  found.lower = found.spectrum.frequency[band.begin];
  found.upper = found.spectrum.frequency[band.end - 1];
  const double n = found.spectrum.averages, lines = static_cast<double>(band.end - band.begin);
  double loss = 0, variance = 0;
  for (std::size_t i = band.begin; i < band.end; ++i) {
    const double missing = 1 - found.spectrum.coherence[i];
    loss += (missing + missing * missing / n) / lines;
    variance += 2 * (1 - missing) * missing * missing / n / lines;
  }
  found.loss = std::min(1.0, loss);
  found.deviation = std::sqrt(variance * signal::kHannLines / lines);
  judge(settings, found);
  if (driving(record) == record::Channel::motor_current)
    found.message += "; driven by motor_current, as the baseline must be";
}

}  // namespace

CoherenceSpectrum estimate_coherence(const std::vector<double>& x, const std::vector<double>& y, double rate,
                                     std::size_t segment) {
  const signal::WelchSpectra spectra = signal::welch(x, y, 1 / rate, segment);
  CoherenceSpectrum spectrum;
  spectrum.averages = spectra.averages;
  spectrum.significance = 1 - std::pow(0.05, 1 / (spectrum.averages - 1));
  for (std::size_t k = 1; k < spectra.xx.size(); ++k) {
    spectrum.frequency.push_back(rate * static_cast<double>(k) / static_cast<double>(segment));
    spectrum.coherence.push_back(spectra.coherence(k));
    spectrum.input_power.push_back(spectra.xx[k]);
  }
  return spectrum;
}

CoherenceDetection detect_nonlinearity(const record::Record& record, const CoherenceSettings& settings) {
  check(settings);
  CoherenceDetection found;
  try {
    fill(record, settings, found);
  } catch (const Refusal& refusal) {
    found.status = refusal.status;
    found.message = refusal.reason;
  }
  return found;
}

}  // namespace backlash::diagnosis
