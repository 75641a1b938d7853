// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/coherence.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "refusal.h"

namespace backlash {
namespace {

using Spectrum = std::vector<std::complex<double>>;

constexpr double kOverlap = 1.0 / 6;  // correlation of Hann windows that overlap by half
constexpr double kFewestAverages = 16;
constexpr double kExcited = 0.1;                       // of the mean power in the band, still excited
constexpr std::size_t kNarrow = 16;                    // lines; a narrower band is no broad one
constexpr double kFilled = 0.9;                        // share of the lines of the band that are excited
constexpr double kKurtosisLow = 2, kKurtosisHigh = 5;  // 3: Gaussian; 1: square wave, 1.5: sine
constexpr double kNeighbours = 1.94;  // 1 + 2 (4/9 + 1/36): neighbouring lines of a Hann window correlate

Spectrum windowed_spectrum(const std::vector<double>& x, std::size_t begin, const std::vector<double>& window,
                           Eigen::FFT<double>& fft) {
  std::vector<double> part(x.begin() + static_cast<std::ptrdiff_t>(begin),
                           x.begin() + static_cast<std::ptrdiff_t>(begin + window.size()));
  const double mean = std::accumulate(part.begin(), part.end(), 0.0) / static_cast<double>(part.size());
  for (std::size_t i = 0; i < part.size(); ++i) part[i] = (part[i] - mean) * window[i];
  Spectrum spectrum;
  fft.fwd(spectrum, part);
  return spectrum;
}

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

int differences(Channel channel) {
  switch (channel) {
    case Channel::motor_position:
    case Channel::load_position:
    case Channel::reference_position:
      return 2;
    case Channel::motor_velocity:
    case Channel::load_velocity:
      return 1;
    default:
      return 0;
  }
}

struct Signals {
  std::vector<double> torque, response;
  double rate = 0;
};

Signals collect(const Record& record, const CoherenceSettings& settings) {
  for (const Channel channel : {Channel::motor_torque, settings.response})
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "the record has no " + channel_name(channel)};
  Signals signals;
  const double interval = record.sampling_interval();
  signals.torque = record.column(Channel::motor_torque);
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

void require_random(const Record& record) {
  const std::vector<double>& torque = record.column(Channel::motor_torque);
  const double k = kurtosis(torque);
  if (k < kKurtosisLow || k > kKurtosisHigh)
    throw Refusal{Status::out_of_domain, "torque is not random noise: kurtosis " + text(k) +
                                             ", of Gaussian noise 3, of a square wave 1"};
  if (const auto period = detect_period(record.time, torque))
    throw Refusal{Status::out_of_domain, "torque repeats every " + text(*period) +
                                             " s, so that any response repeats with it and is coherent"};
}

void judge(const CoherenceSettings& settings, CoherenceDetection& found) {
  found.status = Status::ok;
  found.message = "mean loss of coherence " + text(found.loss) + " from " + text(found.lower) + " to " +
                  text(found.upper) + " Hz, " + text(found.spectrum.averages) + " averages";
  if (!settings.baseline) {
    found.message += "; without a baseline of the healthy machine no finding";
    return;
  }
  const double half = 1.96 * std::hypot(found.deviation, settings.baseline->deviation);
  found.index = found.loss - settings.baseline->loss;
  found.index_lower = found.index - half;
  found.index_upper = found.index + half;
  if (found.index_lower <= settings.least_growth && settings.least_growth <= found.index_upper) {
    found.status = Status::ambiguous;
    found.message += "; grown by " + text(found.index) + " +- " + text(half) + ": cannot tell";
    return;
  }
  found.nonlinear = found.index_lower > settings.least_growth;
  found.message += *found.nonlinear ? "; play or another nonlinearity present, grown by "
                                    : "; no play or other nonlinearity seen, grown by ";
  found.message += text(found.index) + " +- " + text(half);
}

void fill(const Record& record, const CoherenceSettings& settings, CoherenceDetection& found) {
  const Signals signals = collect(record, settings);
  require_random(record);
  const auto segment = 2 * static_cast<std::size_t>(std::lround(0.5 * settings.segment * signals.rate));
  const double averages =
      segment >= 8 ? 2.0 * static_cast<double>(signals.torque.size()) / static_cast<double>(segment) - 1 : 0;
  if (averages / (1 + 2 * kOverlap * kOverlap) < kFewestAverages)
    throw Refusal{Status::insufficient_data,
                  "the record holds " + text(std::max(0.0, std::floor(averages))) + " segments of " +
                      text(settings.segment) + " s, needed are " +
                      text(std::ceil(kFewestAverages * (1 + 2 * kOverlap * kOverlap)))};
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
  found.deviation = std::sqrt(variance * kNeighbours / lines);
  judge(settings, found);
}

}  // namespace

CoherenceSpectrum estimate_coherence(const std::vector<double>& x, const std::vector<double>& y, double rate,
                                     std::size_t segment) {
  if (segment < 8 || segment % 2 != 0)
    throw InvalidParameter("segment", static_cast<double>(segment), "must be even and >= 8");
  if (x.size() != y.size())
    throw InvalidParameter("y", static_cast<double>(y.size()), "must have as many samples as x");
  if (2 * x.size() < 3 * segment)
    throw InvalidParameter("segment", static_cast<double>(segment), "must fit twice, overlapping by half");
  std::vector<double> window(segment);
  double power = 0;
  for (std::size_t i = 0; i < segment; ++i) {
    window[i] = 0.5 - 0.5 * std::cos(2 * M_PI * static_cast<double>(i) / static_cast<double>(segment));
    power += window[i] * window[i];
  }
  const std::size_t lines = segment / 2 - 1;
  std::vector<double> xx(lines, 0.0), yy(lines, 0.0);
  Spectrum xy(lines, 0.0);
  Eigen::FFT<double> fft;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin + segment <= x.size(); begin += segment / 2, ++count) {
    const Spectrum a = windowed_spectrum(x, begin, window, fft), b = windowed_spectrum(y, begin, window, fft);
    for (std::size_t k = 0; k < lines; ++k) {
      xx[k] += std::norm(a[k + 1]);
      yy[k] += std::norm(b[k + 1]);
      xy[k] += std::conj(a[k + 1]) * b[k + 1];
    }
  }
  CoherenceSpectrum spectrum;
  spectrum.averages = static_cast<double>(count) / (1 + 2 * kOverlap * kOverlap);
  spectrum.significance = 1 - std::pow(0.05, 1 / (spectrum.averages - 1));
  for (std::size_t k = 0; k < lines; ++k) {
    spectrum.frequency.push_back(rate * static_cast<double>(k + 1) / static_cast<double>(segment));
    const double product = xx[k] * yy[k];
    spectrum.coherence.push_back(product > 0 ? std::min(1.0, std::norm(xy[k]) / product) : 0);
    spectrum.input_power.push_back(2 * xx[k] / (rate * power * static_cast<double>(count)));
  }
  return spectrum;
}

CoherenceDetection detect_nonlinearity(const Record& record, const CoherenceSettings& settings) {
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

}  // namespace backlash
