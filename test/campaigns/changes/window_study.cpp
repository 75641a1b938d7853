// SPDX-License-Identifier: BSD-3-Clause
// How long the likelihood ratio of `detect_changes` takes for an effect, beside a two-sided CUSUM of the same
// false alarms, and how often it is wrong. A *window* is 4 s of motion; its *score* is the sum of residual
// times the effect's column over it; *sigma* is the standard deviation of a healthy window's score. The CUSUM
// sees scores, the likelihood ratio the rows that they are made of, in looks at the last 75 windows (300 s),
// one look after each window. Rows are noise of first order, so that scores scatter more than by white noise.
// The search's own gates (a tenth explained, a second look) are not in it. Deterministic for its arguments.
#include "window_study.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include "changes/change_scan.h"
#include "changes/onset_threshold.h"

namespace backlash::change_study {
namespace {

using changes::Background;
using changes::EffectSums;

constexpr int kRows = 8, kLook = 75, kMargin = 2;  // of a window; windows of a look; where no onset is tried
constexpr double kWindow = 4, kColour = 0.6;       // s; correlation of neighbouring rows
constexpr double kReference = 0.5;                 // sigma, k of the CUSUM
constexpr int kStream = 2000, kHealthyBefore = kLook;

/// Rows of a window, of unit variance, shifted. They remember each other; windows, longer than that, do not.
std::vector<double> rows_of_window(std::mt19937_64& random, double shift) {
  std::normal_distribution<double> normal;
  std::vector<double> rows(kRows);
  double last = normal(random);
  for (double& r : rows) {
    last = kColour * last + std::sqrt(1 - kColour * kColour) * normal(random);
    r = last + shift;
  }
  return rows;
}

/// Variance of the sum of the rows of a window over that of white ones: closed form of first order noise.
double inflation() {
  double sum = kRows;
  for (int lag = 1; lag < kRows; ++lag) sum += 2 * (kRows - lag) * std::pow(kColour, lag);
  return sum / kRows;
}

double sigma() {
  return std::sqrt(kRows * inflation());
}

/// The largest gain over the onsets of a look, over the inflation of the scores.
double gain_of(const std::deque<std::vector<double>>& windows, double inflation) {
  changes::SampledMotion motion;
  const auto n = static_cast<Eigen::Index>(windows.size() * kRows);
  Background b;
  b.residual.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto window = static_cast<std::size_t>(i) / kRows;
    changes::Moment m{};
    m.time = kWindow * (double(window) + (double(i % kRows) + 0.5) / kRows);
    motion.moments.push_back(m);
    motion.rows.push_back(static_cast<std::size_t>(i));
    b.residual[i] = windows[window][static_cast<std::size_t>(i) % kRows];
  }
  b.columns.resize(n, 0);
  b.spread.resize(0);
  b.variance = 1;
  b.inverse.resize(0, 0);
  b.estimate.resize(0);
  const EffectSums sums(motion, Eigen::MatrixXd::Ones(n, 1), b, kWindow, false);
  double most = 0;
  for (std::size_t k = 0; k + kMargin <= windows.size(); ++k)
    most = std::max(most, sums.score(k, sums.blocks(), b).gain / inflation);
  return most;
}

/// One joint: what was learned, then window after window.
class Joint {
 public:
  explicit Joint(unsigned long seed) : random_(seed) {}

  /// Statistics after one more window.
  void add(double shift_in_sigmas) {
    windows_.push_back(rows_of_window(random_, shift_in_sigmas * sigma() / kRows));
    if (windows_.size() > kLook) windows_.pop_front();
    double score = 0;
    for (const double r : windows_.back()) score += r / sigma();
    up_ = std::max(0.0, up_ + score - kReference);
    down_ = std::max(0.0, down_ - score - kReference);
  }
  double likelihood() const { return gain_of(windows_, inflation()); }
  double cusum() const { return std::max(up_, down_); }
  /// A CUSUM begins at 0 when the shift does: what the exact figures are for.
  void restart_cusum() { up_ = down_ = 0; }

 private:
  std::mt19937_64 random_;
  std::deque<std::vector<double>> windows_;
  double up_ = 0, down_ = 0;
};

/// When a statistic first came beyond each of its heights.
using Climb = std::vector<std::pair<int, double>>;

/// Mean windows to an alarm beyond `height`: all windows over all alarms, as alarms come without memory.
double windows_to_alarm(const std::vector<Climb>& climbs, double height) {
  double windows = 0, alarms = 0;
  for (const Climb& climb : climbs) {
    const auto at =
        std::find_if(climb.begin(), climb.end(), [&](const auto& c) { return c.second > height; });
    windows += at == climb.end() ? kStream : at->first;
    alarms += at != climb.end();
  }
  return alarms > 0 ? windows / alarms : 1e300;
}

double height_for(const std::vector<Climb>& climbs, double windows) {
  double low = 0, high = 200;
  for (int i = 0; i < 60; ++i)
    (windows_to_alarm(climbs, (low + high) / 2) < windows ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

struct Delay {
  double likelihood = 0, cusum = 0;  // windows, mean
};

Delay delay_of(double shift, double gain, double cusum, int joints, unsigned long seed) {
  Delay sum;
  int counted = 0;
  for (int i = 0; i < joints; ++i) {
    Joint joint(seed + static_cast<unsigned long>(i));
    for (int k = 0; k < kHealthyBefore; ++k) joint.add(0);
    if (joint.likelihood() > gain) continue;  // wrong already
    joint.restart_cusum();
    int likelihood_at = 0, cusum_at = 0;
    for (int k = 1; likelihood_at == 0 || cusum_at == 0; ++k) {
      joint.add(shift);
      if (cusum_at == 0 && joint.cusum() > cusum) cusum_at = k;
      if (likelihood_at == 0 && joint.likelihood() > gain) likelihood_at = k;
    }
    sum.likelihood += likelihood_at;
    sum.cusum += cusum_at;
    ++counted;
  }
  return {sum.likelihood / counted, sum.cusum / counted};
}

/// Looks that share no window: how often one is wrong, beside how often the threshold says.
void false_alarms(long windows, unsigned long seed) {
  std::vector<double> gains;
  std::mt19937_64 random(seed);
  std::deque<std::vector<double>> look;
  for (long k = 0; k < windows; ++k) {
    look.push_back(rows_of_window(random, 0));
    if (look.size() < kLook) continue;
    gains.push_back(gain_of(look, inflation()));
    look.clear();
  }
  for (const double allowed : {0.1, 0.03, 0.01}) {  // per look
    const double height = changes::gain_by_chance(allowed, 1, kMargin, kLook);
    const auto wrong = std::count_if(gains.begin(), gains.end(), [&](double g) { return g > height; });
    fmt::print("{} looks at {} windows, {:.0f} false alarms allowed: {}\n", gains.size(), kLook,
               allowed * double(gains.size()), wrong);
  }
}

}  // namespace

void study_windows(long windows, unsigned long seed) {
  false_alarms(windows, seed);
  std::vector<Climb> likelihood, cusum;
  for (long i = 0; i * kStream < windows; ++i) {
    Joint joint(seed + 1000 + static_cast<unsigned long>(i));
    for (int k = 0; k < kHealthyBefore; ++k) joint.add(0);
    joint.restart_cusum();
    Climb a = {{0, 0}}, b = {{0, 0}};
    for (int k = 1; k <= kStream; ++k) {
      joint.add(0);
      if (const double x = joint.likelihood(); x > a.back().second) a.emplace_back(k, x);
      if (const double x = joint.cusum(); x > b.back().second) b.emplace_back(k, x);
    }
    likelihood.push_back(a);
    cusum.push_back(b);
  }
  fmt::print("CUSUM of h = 5: {:.0f} windows to a false alarm (exact: 465)\n", windows_to_alarm(cusum, 5));
  struct Anchor {
    double height, windows;
    double delays[3];
  };
  // Exact, k = 0.5, two-sided.
  for (const Anchor& anchor : {Anchor{5, 465, {38, 10.4, 4.0}}, Anchor{8, 9475, {84, 16.4, 6.0}}}) {
    const double gain = height_for(likelihood, anchor.windows);
    const double shifts[] = {0.5, 1, 2};
    for (int i = 0; i < 3; ++i) {
      const Delay d = delay_of(shifts[i], gain, anchor.height, 400, seed + 100000);
      fmt::print(
          "{} windows to a false alarm (gain {:.2f}), shift of {} sigma: delay {:.1f} windows, CUSUM {:.1f} "
          "(exact: "
          "{}), ratio to the exact one {:.2f}\n",
          anchor.windows, gain, shifts[i], d.likelihood, d.cusum, anchor.delays[i],
          d.likelihood / anchor.delays[i]);
    }
  }
}

}  // namespace backlash::change_study
