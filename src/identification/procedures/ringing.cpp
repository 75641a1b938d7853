// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/ringing.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr int kLinear = 4;                  // c0, c1, p, q
constexpr int kNonlinear = 2;               // a, wd
constexpr double kMostDamping = 0.9;        // theory: damping ratio; above, nothing rings
constexpr std::size_t kFewestSamples = 10;  // choice: four more than unknowns
constexpr double kFarthest = 2;             // choice: of w0 found over expected, either way
constexpr double kGridFrom = 0.6, kGridTo = 1.7, kGridStep = 1.12;     // choice: of the expected w0
constexpr double kGridDamping[] = {0.02, 0.06, 0.12, 0.2, 0.35, 0.6};  // choice: damping ratios
constexpr double kTypical = 0.1;         // choice: of the expected w0, the size of a step of the fit
constexpr double kAboveNoise = 3;        // choice: deviations of the residuals that an extreme stands out by
constexpr double kPeakReach = 0.25;      // choice: of half a period, on either side of an extreme
constexpr std::size_t kFewestPeaks = 3;  // theory: a line of two parameters, and one to spare

/// The damped sine as a problem in (rate, frequency) alone.
class DampedSine {
 public:
  DampedSine(const std::vector<double>& time, const std::vector<double>& values)
      : t_(Eigen::Map<const Eigen::ArrayXd>(time.data(), Eigen::Index(time.size())) - time.front()),
        y_(Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()))) {}

  Eigen::VectorXd residuals(const Eigen::VectorXd& p) const { return y_ - basis(p) * coefficients(p); }

  Eigen::VectorXd coefficients(const Eigen::VectorXd& p) const {
    return signal::solve_least_squares(basis(p), y_).x;
  }

 private:
  Eigen::MatrixXd basis(const Eigen::VectorXd& p) const {
    const Eigen::ArrayXd envelope = (-p[0] * t_).exp();
    Eigen::MatrixXd b(t_.size(), kLinear);
    b.col(0).setOnes();
    b.col(1) = t_ / t_[t_.size() - 1];  // of the size of the others
    b.col(2) = envelope * (p[1] * t_).cos();
    b.col(3) = envelope * (p[1] * t_).sin();
    return b;
  }

  Eigen::ArrayXd t_;
  Eigen::VectorXd y_;
};

/// The best of a grid: least squares in two parameters has local minima.
Eigen::Vector2d start_of(const DampedSine& sine, double expected) {
  Eigen::Vector2d best;
  double least = std::numeric_limits<double>::infinity();
  for (double w = kGridFrom * expected; w < kGridTo * expected; w *= kGridStep)
    for (const double z : kGridDamping) {
      const Eigen::Vector2d p(z * w, w * std::sqrt(1 - z * z));
      const double sum = sine.residuals(p).squaredNorm();
      if (sum < least) {
        least = sum;
        best = p;
      }
    }
  return best;
}

/// z and w0 with errors from those of a and wd.
void polar(Ringing& r, const Eigen::Matrix2d& covariance) {
  const double a = r.rate.value, w = r.frequency.value, w0 = std::hypot(a, w);
  const Eigen::Vector2d of_ratio(w * w / (w0 * w0 * w0), -a * w / (w0 * w0 * w0)),
      of_frequency(a / w0, w / w0);
  r.damping_ratio = {a / w0, std::sqrt(of_ratio.dot(covariance * of_ratio))};
  r.natural_frequency = {w0, std::sqrt(of_frequency.dot(covariance * of_frequency))};
}

}  // namespace

Ringing fit_ringing(const std::vector<double>& time, const std::vector<double>& values, double expected) {
  if (time.size() < kFewestSamples)
    throw CannotIdentify("ringing of fewer than " + std::to_string(kFewestSamples) + " samples");
  const DampedSine sine(time, values);
  const signal::LeastSquaresFit fit =
      fit::fit_nonlinear([&](const Eigen::VectorXd& p) { return sine.residuals(p); },
                         start_of(sine, expected), Eigen::Vector2d::Constant(kTypical * expected));
  Ringing r;
  r.time = time;
  r.measured = values;
  // The linear coefficients cost degrees of freedom as well.
  const double rows = double(time.size()),
               more = std::sqrt((rows - kNonlinear) / (rows - kNonlinear - kLinear));
  const Eigen::Matrix2d covariance = fit.covariance * (more * more);
  r.deviation = fit.deviation * more;
  r.rate = {fit.values[0], std::sqrt(covariance(0, 0))};
  r.frequency = {std::fabs(fit.values[1]), std::sqrt(covariance(1, 1))};
  polar(r, covariance);
  const double w0 = r.natural_frequency.value;
  if (!(r.rate.value > 0 && r.damping_ratio.value < kMostDamping && w0 > expected / kFarthest &&
        w0 < kFarthest * expected))
    throw CannotIdentify("no decaying ringing near " + std::to_string(expected / (2 * M_PI)) + " Hz");
  const Eigen::VectorXd c = sine.coefficients(fit.values);
  r.fitted.resize(time.size());
  for (std::size_t i = 0; i < time.size(); ++i) r.fitted[i] = values[i] - fit.residuals[Eigen::Index(i)];
  r.level = c[0];
  r.slope = c[1] / (time.back() - time.front());
  for (std::size_t i = 0; i < time.size(); ++i)
    r.amplitude = std::max(r.amplitude, std::fabs(r.fitted[i] - r.level - r.slope * (time[i] - time[0])));
  return r;
}

void measure_peaks(Ringing& r) {
  r.peak_time.clear();
  r.peak.clear();
  const auto n = static_cast<int>(r.time.size());
  std::vector<double> y(r.time.size());
  for (int i = 0; i < n; ++i) y[i] = r.measured[i] - r.level - r.slope * (r.time[i] - r.time[0]);
  const double interval = (r.time.back() - r.time.front()) / (n - 1);
  const double half_period = M_PI / r.frequency.value / interval;  // samples
  const int reach = std::max(1, static_cast<int>(kPeakReach * half_period));
  for (int i = reach; i + reach < n; ++i) {
    bool extreme = std::fabs(y[i]) > kAboveNoise * r.deviation;
    for (int k = i - reach; k <= i + reach && extreme; ++k)
      extreme = y[k] * y[i] > 0 && std::fabs(y[k]) <= std::fabs(y[i]);
    if (!extreme) continue;
    // Vertex of the parabola through the neighbourhood: noise and steps of the sensor average out.
    Eigen::MatrixXd a(2 * reach + 1, 3);
    Eigen::VectorXd b(2 * reach + 1);
    for (int k = -reach; k <= reach; ++k) {
      a.row(k + reach) << 1, k, double(k) * k;
      b[k + reach] = y[i + k];
    }
    const Eigen::Vector3d c = signal::solve_least_squares(a, b).x;
    const double at = -c[1] / (2 * c[2]);
    if (!(std::fabs(at) <= reach)) continue;
    if (!r.peak.empty() && r.peak.back() * y[i] > 0) continue;  // a plateau
    r.peak_time.push_back(r.time[i] + at * interval);
    r.peak.push_back(c[0] + at * c[1] / 2);
  }
  if (r.peak.size() < kFewestPeaks) return;
  Eigen::MatrixXd a(r.peak.size(), 2);
  Eigen::VectorXd logarithm(r.peak.size());
  for (std::size_t i = 0; i < r.peak.size(); ++i) {
    const double weight = std::fabs(r.peak[i]);  // noise of a logarithm grows as the peak falls
    a.row(Eigen::Index(i)) << weight, weight * (r.peak_time[i] - r.peak_time[0]);
    logarithm[Eigen::Index(i)] = weight * std::log(std::fabs(r.peak[i]));
  }
  const double tau = signal::fit_linear(a, logarithm).values[1];
  const double wd = M_PI * double(r.peak.size() - 1) / (r.peak_time.back() - r.peak_time.front());
  const double ratio = -tau / wd;
  r.peak_damping_ratio = ratio / std::sqrt(1 + ratio * ratio);
}

}  // namespace backlash::identification
