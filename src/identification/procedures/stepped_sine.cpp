// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/stepped_sine.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kFewestCycles = 4, kMostCycles = 200;
constexpr std::size_t kFewestForNoise = 64;  // theory: samples that show the noise
constexpr double kBetween = 2.5;             // choice: cycles between two runs that count as inside
constexpr double kMostMoved = 0.25;      // choice: cycles that a refined passage may lie from the rough one
constexpr double kTail = 0.01;           // choice: share of the samples beyond the range on either side
constexpr std::size_t kSettling = 5;     // choice: one of so many cycles is left out at the begin
constexpr std::size_t kSpareTheEnd = 8;  // choice: cycles, from which on the last one is left out too
constexpr double kLeastUneven = 1e-3, kMostUneven = 0.02;  // choice: cycles
constexpr double kJitter = 5;                              // choice: deviations of a passage
constexpr std::size_t kJitterReach = 10;  // choice: passages on either side that show the deviation
constexpr double kSameHeight = 0.2;       // choice: of the amplitude
constexpr double kNoSine = 0.1;           // choice: of the torque's power
constexpr double kTurn = 0.1;             // choice: of the torque's range; a smaller turn is noise
constexpr double kNoiseTurn = 8;          // choice: standard deviations; the same for known noise
constexpr double kMostTurn = 0.5;         // choice: of the range, lest the sine itself be noise
constexpr std::size_t kFewestSamples =
    8;  // theory: a cycle or a group of them is fitted with, three unknowns

/// A rising passage of the mean between a minimum and the next maximum.
struct Passage {
  double at = 0, mean = 0, amplitude = 0;
};

/// Between the samples where it crosses the mean first; refined later.
Passage passage(const std::vector<double>& u, std::size_t low, std::size_t high) {
  Passage p{0, 0.5 * (u[low] + u[high]), 0.5 * (u[high] - u[low])};
  std::size_t k = low + 1;
  while (u[k] < p.mean) ++k;
  p.at = double(k) - (u[k] - p.mean) / (u[k] - u[k - 1]);
  return p;
}

/// Passages from the sine through the cycle around each, which averages noise and needs no sample at the
/// extremes; mean and amplitude too. The first and the last stay as they are.
void refine(const std::vector<double>& u, std::vector<Passage>& passages) {
  std::vector<Passage> refined;
  for (std::size_t i = 1; i + 1 < passages.size(); ++i) {
    const double period = 0.5 * (passages[i + 1].at - passages[i - 1].at), rough = passages[i].at;
    const auto begin = static_cast<std::size_t>(std::max(0.0, std::ceil(rough - period / 2)));
    const auto end = std::min(u.size(), static_cast<std::size_t>(std::ceil(rough + period / 2)));
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t k = begin; k < end; ++k) {
      const double angle = 2 * M_PI * (double(k) - rough) / period;
      const Eigen::Vector3d b(1, std::cos(angle), std::sin(angle));
      normal += b * b.transpose();
      right += b * u[k];
    }
    const Eigen::Vector3d fit = signal::solve_symmetric(normal, right);
    const double early = std::atan2(fit[1], fit[2]) / (2 * M_PI);
    const bool found = std::isfinite(early) && std::fabs(early) < kMostMoved;
    refined.push_back(found ? Passage{rough - early * period, fit[0], std::hypot(fit[1], fit[2])}
                            : passages[i]);
  }
  std::copy(refined.begin(), refined.end(), passages.begin() + !passages.empty());
}

std::vector<Passage> find_passages(const std::vector<double>& u) {
  std::vector<Passage> passages;
  if (u.size() < kFewestSamples) return passages;
  const double reach = signal::quantile_range(u, kTail);
  const double noise = u.size() < kFewestForNoise ? 0 : signal::white_noise(u);
  const double turn = std::clamp(kNoiseTurn * noise, kTurn * reach, kMostTurn * reach);
  if (!(turn > 0)) return passages;
  std::optional<std::size_t> low;
  std::size_t extreme = 0;
  bool rising = true;
  for (std::size_t i = 1; i < u.size(); ++i) {
    if (rising ? u[i] > u[extreme] : u[i] < u[extreme]) extreme = i;
    if (std::fabs(u[i] - u[extreme]) < turn) continue;
    if (!rising)
      low = extreme;
    else if (low)
      passages.push_back(passage(u, *low, extreme));
    rising = !rising;
    extreme = i;
  }
  return passages;
}

/// How far [cycles] passages near `i` may be off an even step: some deviations, estimated by third
/// differences, which neither a sweep nor a step of the frequency now and then has.
double allowance(const std::vector<Passage>& p, std::size_t i) {
  const std::size_t first = i < kJitterReach ? 0 : i - kJitterReach;
  std::vector<double> third;
  for (std::size_t k = first; k + 3 < p.size() && k <= i + kJitterReach; ++k)
    third.push_back(std::fabs(p[k + 3].at - 3 * p[k + 2].at + 3 * p[k + 1].at - p[k].at) * 3 /
                    (p[k + 3].at - p[k].at));
  if (third.empty()) return kMostUneven;
  const double deviation = signal::kNormalPerMedianDeviation * signal::median(std::move(third)) /
                           std::sqrt(20.0);  // 1 + 9 + 9 + 1
  return std::clamp(kJitter * deviation, kLeastUneven, kMostUneven);
}

/// Whether passages first to last keep to an even step and alike half waves.
bool even(const std::vector<Passage>& p, std::size_t first, std::size_t last, double allowed) {
  const double step = (p[last].at - p[first].at) / double(last - first);
  const double height = kSameHeight * p[first].amplitude;
  if (std::fabs(p[last].amplitude - p[first].amplitude) > height ||
      std::fabs(p[last].mean - p[first].mean) > height)
    return false;
  for (std::size_t k = first + 1; k < last; ++k)
    if (std::fabs(p[k].at - p[first].at - step * double(k - first)) > allowed * step) return false;
  return true;
}

/// Rows: 1, s, s^2 (s from -1 to 1 over the window), cos, sin; fitted to torque and speed.
struct LineFit {
  Eigen::Matrix<double, 5, 2> values;
  Eigen::RowVector2d line_power, left_power;  // mean squares: of the line, of what the five leave
};

Eigen::Matrix<double, 5, 1> row(double sample, double middle, double half, double frequency) {
  const double s = (sample - middle) / half, angle = 2 * M_PI * frequency * (sample - middle);
  return (Eigen::Matrix<double, 5, 1>() << 1, s, s * s, std::cos(angle), std::sin(angle)).finished();
}

LineFit fit_line(const std::vector<double>& u, const std::vector<double>& y, const SineRun& run) {
  const auto begin = static_cast<std::size_t>(std::ceil(run.begin));
  const auto end = std::min<std::size_t>(u.size(), static_cast<std::size_t>(std::ceil(run.end)));
  const double middle = 0.5 * (run.begin + run.end), half = 0.5 * (run.end - run.begin);
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 2> right = Eigen::Matrix<double, 5, 2>::Zero();
  for (std::size_t k = begin; k < end; ++k) {
    const auto a = row(double(k), middle, half, run.frequency());
    normal += a * a.transpose();
    right += a * Eigen::RowVector2d(u[k], y[k]);
  }
  LineFit fit{signal::solve_symmetric(normal, right), Eigen::RowVector2d::Zero(), Eigen::RowVector2d::Zero()};
  const double count = double(end - begin);
  for (std::size_t k = begin; k < end; ++k) {
    const Eigen::RowVector2d line = row(double(k), middle, half, run.frequency()).transpose() * fit.values;
    fit.left_power += (Eigen::RowVector2d(u[k], y[k]) - line).array().square().matrix() / count;
  }
  fit.line_power = 0.5 * fit.values.bottomRows<2>().colwise().squaredNorm();
  return fit;
}

std::complex<double> amplitude(const Eigen::Vector2d& cosine_and_sine) {
  return {cosine_and_sine[0], -cosine_and_sine[1]};
}

/// Relative standard error of the mean of the responses of single cycles (groups of them where they are
/// short), the trend of the whole run taken off.
double cycle_scatter(const std::vector<double>& u, const std::vector<double>& y, const SineRun& run,
                     const LineFit& whole) {
  const double f = run.frequency(), middle = 0.5 * (run.begin + run.end), half = 0.5 * (run.end - run.begin);
  const auto group = static_cast<std::size_t>(std::max(1.0, std::ceil(double(kFewestSamples) * f)));
  const std::size_t groups = run.cycles / group;
  std::vector<std::complex<double>> found;
  std::complex<double> mean = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    const auto begin = static_cast<std::size_t>(std::ceil(run.begin + double(g * group) / f));
    const auto end = static_cast<std::size_t>(std::ceil(run.begin + double((g + 1) * group) / f));
    for (std::size_t k = begin; k < std::min(end, u.size()); ++k) {
      const auto a = row(double(k), middle, half, f);
      const Eigen::RowVector2d trend = a.head<3>().transpose() * whole.values.topRows<3>();
      const Eigen::Vector3d b(1, a[3], a[4]);
      normal += b * b.transpose();
      right += b * (Eigen::RowVector2d(u[k], y[k]) - trend);
    }
    const Eigen::Matrix<double, 3, 2> values = signal::solve_symmetric(normal, right);
    found.push_back(amplitude(values.col(1).tail<2>()) / amplitude(values.col(0).tail<2>()));
    mean += found.back() / double(groups);
  }
  double sum = 0;
  for (const auto& h : found) sum += std::norm(h - mean);
  return std::sqrt(sum / (2.0 * double(groups) * double(groups - 1))) / std::abs(mean);
}

}  // namespace

SineRuns find_sine_runs(const std::vector<double>& torque) {
  std::vector<Passage> p = find_passages(torque);
  refine(torque, p);
  SineRuns found;
  double inside = 0;
  for (std::size_t first = 0; first + kFewestCycles < p.size();) {
    std::size_t last = first + 1;
    const double allowed = allowance(p, first);
    while (last + 1 < p.size() && last - first < kMostCycles && even(p, first, last + 1, allowed)) ++last;
    const SineRun run{p[first].at, p[last].at, last - first};
    if (run.cycles < kFewestCycles) {
      ++first;
      continue;
    }
    first = last;
    const LineFit fit = fit_line(torque, torque, run);
    if (run.frequency() > kHighestFrequency ||
        fit.left_power[0] > kNoSine * (fit.left_power[0] + fit.line_power[0]))
      continue;
    inside += run.end - run.begin;
    if (!found.runs.empty() && run.begin - found.runs.back().end <= kBetween / run.frequency())
      inside += run.begin - found.runs.back().end;
    found.runs.push_back(run);
  }
  if (p.size() > 1) found.share = inside / (p.back().at - p.front().at);
  return found;
}

ResponsePoint sine_response(const std::vector<double>& torque, const std::vector<double>& speed,
                            const SineRun& run) {
  const double period = 1 / run.frequency();
  const std::size_t leading = std::max<std::size_t>(1, (run.cycles + kSettling - 1) / kSettling),
                    trailing = run.cycles >= kSpareTheEnd;
  const SineRun used{run.begin + double(leading) * period, run.end - double(trailing) * period,
                     run.cycles - leading - trailing};
  const LineFit fit = fit_line(torque, speed, used);
  ResponsePoint point;
  point.frequency = used.frequency();
  point.response = amplitude(fit.values.col(1).tail<2>()) / amplitude(fit.values.col(0).tail<2>());
  point.coherence = fit.line_power[1] / (fit.line_power[1] + fit.left_power[1]);
  point.standard_error = cycle_scatter(torque, speed, used, fit);
  const double mean = fit.values(0, 1) + fit.values(2, 1) / 3;  // of 1 + s^2 over the window
  point.reverses = std::sqrt(2 * fit.line_power[1]) > std::fabs(mean);
  return point;
}

}  // namespace backlash::identification
