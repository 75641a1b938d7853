// SPDX-License-Identifier: BSD-3-Clause
// The whole response at once.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/identification/procedures/two_mass.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {
namespace {

constexpr double kLeastError = 1e-3;   // choice: relative: what sampling and transients leave
constexpr double kOutlier = 5;         // choice: deviations
constexpr std::size_t kPool = 2;       // choice: neighbours on either side whose errors are pooled
constexpr double kStartDamping = 0.1;  // choice: damping ratio

struct Point {
  double frequency = 0, error = 0;
  std::complex<double> response;
};

std::vector<Point> pooled(const std::vector<ResponsePoint>& points) {
  std::vector<Point> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t first = i < kPool ? 0 : i - kPool, last = std::min(points.size() - 1, i + kPool);
    double sum = 0;
    for (std::size_t k = first; k <= last; ++k) sum += std::pow(points[k].standard_error, 2);
    const double error = std::sqrt(sum / double(last - first + 1));
    all.push_back({points[i].frequency, std::max(kLeastError, error), points[i].response});
  }
  return all;
}

// Parameters: logarithms of motor inertia, load inertia, stiffness; damping, motor and load viscous, delay.
TwoMass to_model(const Eigen::VectorXd& p) {
  return {std::exp(p[0]), std::exp(p[1]), std::exp(p[2]), p[3], p[4], p[5]};
}

Eigen::VectorXd residuals(const std::vector<Point>& points, const Eigen::VectorXd& p) {
  const TwoMass m = to_model(p);
  Eigen::VectorXd r(2 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const auto difference = std::log(point.response / m.motor_response(point.frequency) *
                                     std::polar(1.0, 2 * M_PI * point.frequency * p[6]));
    r[2 * static_cast<Eigen::Index>(i)] = difference.real() / point.error;
    r[2 * static_cast<Eigen::Index>(i) + 1] = difference.imag() / point.error;
  }
  return r;
}

/// Without the points that miss the fit by far; at most a tenth of them goes.
std::vector<Point> without_outliers(const std::vector<Point>& points, const signal::LeastSquaresFit& fit) {
  std::vector<double> sizes;
  for (std::size_t i = 0; i < points.size(); ++i)
    sizes.push_back(fit.residuals.segment<2>(2 * static_cast<Eigen::Index>(i)).norm());
  // The median of the length of two normal residuals is sqrt(2 ln 2) of their deviation.
  const double deviation = signal::median(sizes) / std::sqrt(2 * std::log(2.0));
  const double limit = std::max(kOutlier * deviation, signal::quantile(sizes, 0.9));
  std::vector<Point> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (sizes[i] <= limit) kept.push_back(points[i]);
  return kept;
}

/// A value that follows from the parameters, with its propagated error.
signal::Measured derived(const signal::LeastSquaresFit& fit, const Eigen::VectorXd& scale,
                         double variance_factor, const std::function<double(const Eigen::VectorXd&)>& value) {
  Eigen::VectorXd gradient(fit.values.size());
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    Eigen::VectorXd more = fit.values, less = fit.values;
    more[i] += 1e-4 * scale[i];
    less[i] -= 1e-4 * scale[i];
    gradient[i] = (value(more) - value(less)) / (2e-4 * scale[i]);
  }
  return {value(fit.values), std::sqrt(variance_factor * gradient.dot(fit.covariance * gradient))};
}

}  // namespace

TwoMass TwoMassFit::model() const {
  return {motor_inertia.value, load_inertia.value,  stiffness.value,
          damping.value,       motor_viscous.value, load_viscous.value};
}

TwoMassFit fit_two_mass(const FrequencyResponse& motor) {
  const Resonances seen = find_resonances(motor);
  const InertiaPlateaus inertias = find_inertias(motor, seen);
  const StiffnessSplit start = split_stiffness(KnownInertia::total_inertia, seen, inertias.total, {});
  const double k = start.stiffness_anti_resonance.value, total = inertias.total.value;
  const double critical = 2 * std::sqrt(k * start.reduced_inertia.value);
  const double viscous = 2 * M_PI * motor.points.front().frequency * total;
  Eigen::VectorXd p(7), scale(7);
  p << std::log(start.motor_inertia.value), std::log(start.load_inertia.value), std::log(k),
      kStartDamping * critical, 0, 0, 0;
  scale << 1, 1, 1, kStartDamping * critical, viscous, viscous, 0.1 / motor.points.back().frequency;

  std::vector<Point> points = pooled(motor.points);
  const auto fitted = [&](const Eigen::VectorXd& from) {
    return fit::fit_nonlinear([&](const Eigen::VectorXd& q) { return residuals(points, q); }, from, scale);
  };
  signal::LeastSquaresFit fit = fitted(p);
  points = without_outliers(points, fit);
  fit = fitted(fit.values);
  if (!fit.values.allFinite() || !fit.covariance.allFinite())
    throw CannotIdentify("two inertias with a spring between them do not fit the response");

  const double least = 1 / std::min(1.0, fit.deviation);
  const double factor = motor.variance_factor * least * least;
  const auto of = [&](const std::function<double(const Eigen::VectorXd&)>& value) {
    signal::Measured m = derived(fit, scale, factor, value);
    m.standard_error = std::hypot(m.standard_error, kLeastError * m.value);
    return m;
  };
  TwoMassFit found;
  found.motor_inertia = of([](const auto& q) { return to_model(q).motor_inertia; });
  found.load_inertia = of([](const auto& q) { return to_model(q).load_inertia; });
  found.total_inertia = of([](const auto& q) { return to_model(q).total_inertia(); });
  found.stiffness = of([](const auto& q) { return to_model(q).stiffness; });
  found.damping = of([](const auto& q) { return to_model(q).damping; });
  found.damping_ratio = of([](const auto& q) { return to_model(q).damping_ratio(); });
  found.motor_viscous = of([](const auto& q) { return to_model(q).motor_viscous; });
  found.load_viscous = of([](const auto& q) { return to_model(q).load_viscous; });
  found.viscous = of([](const auto& q) { return to_model(q).motor_viscous + to_model(q).load_viscous; });
  found.resonance = of([](const auto& q) { return to_model(q).resonance(); });
  found.anti_resonance = of([](const auto& q) { return to_model(q).anti_resonance(); });
  found.delay = of([](const auto& q) { return q[6]; });
  found.delay.standard_error =
      std::hypot(found.delay.standard_error, kLeastError / (2 * M_PI * motor.points.back().frequency));
  found.misfit = fit.deviation;
  return found;
}

}  // namespace backlash::identification
