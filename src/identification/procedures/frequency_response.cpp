// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/frequency_response.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/procedures/stepped_sine.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

using Complex = std::complex<double>;

constexpr double kSteppedShare = 0.9;   // choice: of the time in sine runs; less is no stepped sine
constexpr double kLongestSegment = 16;  // s, choice: if not asked for
constexpr std::size_t kShortestSegment = 64, kFewestSegments = 8;
constexpr std::size_t kFirstLine = 3;  // theory: below, what drifts leaks in
constexpr double kExcited = 1e-5;      // choice: of the largest power of a line
constexpr std::size_t kLeakReach = 8;  // theory: lines
constexpr std::size_t kLobe = 2;       // theory: lines, half the main lobe of a Hann window
constexpr double kAlone = 1e-2;        // choice: of a line's power, just beyond its lobe: it stands alone
constexpr Eigen::Index kFewestForInertia = 4;  // choice: points for a line of two parameters

struct Signals {
  std::vector<double> torque, speed;
  double interval = 0;
  bool from_position = false;
};

void require_finite(const std::vector<double>& values, record::Channel channel) {
  for (const double v : values)
    if (!std::isfinite(v))
      throw CannotIdentify(record::channel_name(channel) + " has values that are not finite");
}

Signals collect(const record::Record& given) {
  const record::Channel velocity = record::Channel::motor_velocity,
                        position = record::Channel::motor_position;
  if (!given.has(record::Channel::motor_torque)) throw CannotIdentify("the record has no motor_torque");
  if (!given.has(velocity) && !given.has(position))
    throw CannotIdentify("the record has neither " + record::channel_name(velocity) + " nor " +
                         record::channel_name(position));
  const record::Record record = record::evenly_sampled(given);
  Signals s;
  s.torque = record.column(record::Channel::motor_torque);
  s.interval = (record.time.back() - record.time.front()) / double(record.size() - 1);
  s.from_position = !record.has(velocity);
  const record::Channel source = s.from_position ? position : velocity;
  require_finite(s.torque, record::Channel::motor_torque);
  require_finite(record.column(source), source);
  if (signal::peak_to_peak(s.torque) == 0) throw CannotIdentify("the torque does not vary");
  s.speed = s.from_position ? signal::derivative(record.column(source), s.interval) : record.column(source);
  return s;
}

double sinc(double x) {
  return x == 0 ? 1 : std::sin(x) / x;
}

/// What sampling does to the response of an inertia: a gain, and the images of the hold.
struct Sampling {
  double gain = 1, images = 0;
};

Sampling sampling(const Signals& s, const ResponseSettings& settings, double frequency) {
  const double x = M_PI * frequency * s.interval, hold = settings.held ? sinc(x) : 1;
  const Sampling line{hold * (s.from_position ? sinc(2 * x) : 1), 0};
  if (!settings.held) return line;
  const double all = s.from_position ? std::pow(std::cos(x), 2) / sinc(x) : 1 / sinc(x);
  return {line.gain, all - line.gain};
}

/// 1 / motor inertia from the upper half of the points: w |H| = (1 + d / f^2) / JM there.
double inertance(const Signals& s, const ResponseSettings& settings, const FrequencyResponse& response) {
  const auto& points = response.points;
  const std::size_t first = points.size() / 2;
  const auto rows = static_cast<Eigen::Index>(points.size() - first);
  if (rows < kFewestForInertia) return 0;
  Eigen::MatrixXd a(rows, 2);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const ResponsePoint& p = points[first + static_cast<std::size_t>(i)];
    const Sampling line = sampling(s, settings, p.frequency);
    a.row(i) << 1, std::pow(points.back().frequency / p.frequency, 2);
    b[i] = 2 * M_PI * p.frequency * std::abs(p.response) / (line.gain + line.images);
  }
  return signal::fit_robust(a, b).values[0];
}

void correct_sampling(const Signals& s, const ResponseSettings& settings, FrequencyResponse& response) {
  const double inverse_inertia = settings.held ? inertance(s, settings, response) : 0;
  for (ResponsePoint& point : response.points) {
    const double w = 2 * M_PI * point.frequency;
    const Sampling line = sampling(s, settings, point.frequency);
    if (settings.held) point.response *= std::polar(1.0, 0.5 * w * s.interval);
    point.response = (point.response - inverse_inertia * line.images / Complex(0, w)) / line.gain;
  }
}

std::vector<ResponsePoint> stepped_points(const Signals& s, const SineRuns& sines) {
  std::vector<ResponsePoint> points;
  for (const SineRun& run : sines.runs) {
    points.push_back(sine_response(s.torque, s.speed, run));
    points.back().frequency /= s.interval;
  }
  return points;
}

/// Highest of its neighbours, with nearly nothing just beyond the lobe.
bool alone(const std::vector<double>& power, std::size_t k) {
  return power[k] >= power[k - 1] && power[k] > power[k + 1] &&
         std::max(power[k - kLobe - 1], power[k + kLobe + 1]) < kAlone * power[k];
}

/// Whether the line may be no more than what a Hann window leaks from a stronger one: d lines beside a sine
/// 1 / (pi d (d^2 - 1)) of its amplitude at most; here twice that.
bool leaked(const std::vector<double>& power, std::size_t k) {
  for (std::size_t d = kLobe; d <= kLeakReach; ++d) {
    const double share = std::pow(2 / (M_PI * double(d) * double(d * d - 1)), 2);
    const double below = k >= d ? power[k - d] : 0, above = k + d < power.size() ? power[k + d] : 0;
    if (power[k] < share * std::max(below, above)) return true;
  }
  return false;
}

/// Where between the lines a single sine under a Hann window lies.
double interpolated(const std::vector<double>& power, std::size_t k) {
  const bool above = power[k + 1] > power[k - 1];
  const double ratio = std::sqrt((above ? power[k + 1] : power[k - 1]) / power[k]);
  return double(k) + (above ? 1 : -1) * (2 * ratio - 1) / (ratio + 1);
}

std::size_t segment_length(const Signals& s) {
  const std::size_t samples = s.torque.size();
  std::size_t segment = kShortestSegment;
  while (2 * segment <= samples / kFewestSegments && 2.0 * double(segment) * s.interval <= kLongestSegment)
    segment *= 2;
  if (2 * samples / segment < kFewestSegments + 1)
    throw CannotIdentify(std::to_string(samples) + " samples do not hold " + std::to_string(kFewestSegments) +
                         " half-overlapping segments of " + std::to_string(segment));
  return segment;
}

bool reverses(const std::vector<double>& speed) {
  double sum = 0, squares = 0;
  for (const double v : speed) sum += v, squares += v * v;
  const double n = double(speed.size()), mean = sum / n;
  return std::sqrt(2 * std::max(0.0, squares / n - mean * mean)) > std::fabs(mean);
}

FrequencyResponse broadband(const Signals& s) {
  const std::size_t segment = segment_length(s);
  const signal::WelchSpectra spectra = signal::welch(s.torque, s.speed, s.interval, segment);
  const std::vector<double>& power = spectra.xx;
  const double largest = *std::max_element(power.begin() + kFirstLine, power.end());
  const bool both_signs = reverses(s.speed);
  FrequencyResponse response;
  std::size_t single = 0;  // line of the last sine that stands alone
  for (std::size_t k = kFirstLine; k + kLobe + 1 < power.size(); ++k) {
    if (!(power[k] > kExcited * largest) || !(spectra.yy[k] > 0) || leaked(power, k)) continue;
    if (single > 0 && k <= single + kLobe) continue;
    double line = double(k);
    if (alone(power, k)) {
      line = interpolated(power, k);
      single = k;
      while (!response.points.empty() && response.points.back().frequency * double(segment) * s.interval >=
                                             double(k) - double(kLobe) - 0.5)
        response.points.pop_back();
    }
    ResponsePoint point;
    point.frequency = line / (double(segment) * s.interval);
    point.response = spectra.xy[k] / power[k];
    point.coherence = spectra.coherence(k);
    point.standard_error = std::sqrt((1 - point.coherence) / (2 * spectra.averages * point.coherence));
    point.reverses = both_signs;
    response.points.push_back(point);
    if (single != k) response.variance_factor = signal::kHannLines;
  }
  return response;
}

void check(const ResponseSettings& settings) {
  if (!(settings.least_coherence >= 0 && settings.least_coherence <= 1))
    throw InvalidParameter("least_coherence", settings.least_coherence, "must be 0 to 1");
}

}  // namespace

FrequencyResponse estimate_response(const record::Record& record, const ResponseSettings& settings) {
  check(settings);
  const Signals s = collect(record);
  FrequencyResponse response;
  const SineRuns sines = find_sine_runs(s.torque);
  if (sines.share >= kSteppedShare)
    response.points = stepped_points(s, sines);
  else
    response = broadband(s);
  double best = 0;
  for (const ResponsePoint& point : response.points) best = std::max(best, point.coherence);
  const auto bad = [&](const ResponsePoint& p) {
    return !(p.coherence >= settings.least_coherence) || p.frequency * s.interval > kHighestFrequency ||
           !std::isfinite(p.standard_error);
  };
  auto& points = response.points;
  points.erase(std::remove_if(points.begin(), points.end(), bad), points.end());
  if (points.empty())
    throw CannotIdentify("no frequency at which the speed follows the torque: highest coherence " +
                         to_text(best) + ", needed is " + to_text(settings.least_coherence));
  std::sort(points.begin(), points.end(),
            [](const ResponsePoint& a, const ResponsePoint& b) { return a.frequency < b.frequency; });
  correct_sampling(s, settings, response);
  return response;
}

}  // namespace backlash::identification
