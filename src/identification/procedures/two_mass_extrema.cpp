// SPDX-License-Identifier: BSD-3-Clause
// What can be read off the response without a model of all of it: resonances and plateaus.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/procedures/two_mass.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {
namespace {

using ResponsePoints = std::vector<ResponsePoint>;

constexpr double kWindow = 2;                 // choice: of |H|^2, around an extremum
constexpr std::size_t kBeside = 3;            // choice: points on either side of an extremum
constexpr double kLeastError = 1e-3;          // choice: relative, of any point
constexpr double kBelow = 0.5, kAbove = 1.5;  // theory: of F_AR and F_R: bands of the plateaus

/// Median of a value over five neighbours: a single bad point makes no extremum.
std::vector<double> smoothed(const ResponsePoints& points,
                             const std::function<double(const ResponsePoint&)>& value) {
  std::vector<double> out;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t reach = std::min<std::size_t>({2, i, n - 1 - i});
    std::vector<double> near;
    for (std::size_t k = i - reach; k <= i + reach; ++k) near.push_back(value(points[k]));
    out.push_back(signal::median(std::move(near)));
  }
  return out;
}

/// Minimum of |H|^2 (power 1) or 1/|H|^2 (power -1) near point `at`: vertex of the cubic c0 .. c3 in
/// x = (f - f_at) / half width, from c1 + 2 c2 x + 3 c3 x^2 = 0.
signal::Measured vertex(const ResponsePoints& points, std::size_t at, int power, double variance_factor,
                        const char* what) {
  const auto value = [&](std::size_t i) { return std::pow(std::norm(points[i].response), power); };
  std::size_t first = at, last = at;
  while (first > 0 && (at - first < kBeside || value(first - 1) < kWindow * value(at))) --first;
  while (last + 1 < points.size() && (last - at < kBeside || value(last + 1) < kWindow * value(at))) ++last;
  const std::string where = std::string(what) + " near " + to_text(points[at].frequency) + " Hz";
  if (at - first < kBeside || last - at < kBeside)
    throw CannotIdentify(where + ": less than three points on either side of it");
  const double middle = points[at].frequency, half = 0.5 * (points[last].frequency - points[first].frequency);
  const auto rows = static_cast<Eigen::Index>(last - first + 1);
  Eigen::MatrixXd a(rows, 4);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const ResponsePoint& p = points[first + static_cast<std::size_t>(i)];
    const double x = (p.frequency - middle) / half, v = value(first + static_cast<std::size_t>(i));
    const double error = 2 * v * std::max(kLeastError, p.standard_error);
    a.row(i) << 1 / error, x / error, x * x / error, x * x * x / error;
    b[i] = v / error;
  }
  const signal::LeastSquaresFit fit = signal::fit_linear(a, b);
  const double c1 = fit.values[1], c2 = fit.values[2], c3 = fit.values[3];
  const double root = std::sqrt(c2 * c2 - 3 * c1 * c3), x = -c1 / (c2 + root);
  if (!(c2 > 0) || !(std::fabs(x) < 1)) throw CannotIdentify(where + ": no extremum there");
  const double bend = 2 * c2 + 6 * c3 * x;  // second derivative
  Eigen::Vector4d sensitivity(0, 1, 2 * x, 3 * x * x);
  const double variance = sensitivity.dot(fit.covariance * sensitivity) / (bend * bend);
  const double least = 1 / std::min(1.0, fit.deviation);  // never below what the points' errors give
  return {middle + half * x, half * least * std::sqrt(variance * variance_factor)};
}

signal::Measured plateau(const FrequencyResponse& motor, double from, double to,
                         const std::function<double(double frequency)>& factor) {
  std::vector<double> inertia, error;
  for (const ResponsePoint& p : motor.points) {
    if (p.frequency < from || p.frequency > to) continue;
    inertia.push_back(factor(p.frequency) / (2 * M_PI * p.frequency * std::abs(p.response)));
    error.push_back(inertia.back() * std::max(kLeastError, p.standard_error));
  }
  if (inertia.size() < kBeside)
    throw CannotIdentify("inertia from " + to_text(from) + " to " + to_text(to) + " Hz: only " +
                         std::to_string(inertia.size()) + " points of the response");
  Eigen::MatrixXd a(inertia.size(), 1);
  Eigen::VectorXd b(inertia.size());
  for (std::size_t i = 0; i < inertia.size(); ++i) {
    a(static_cast<Eigen::Index>(i), 0) = 1 / error[i];
    b[static_cast<Eigen::Index>(i)] = inertia[i] / error[i];
  }
  signal::Measured found = signal::fit_robust(a, b).parameter(0);
  found.standard_error *= std::sqrt(motor.variance_factor);
  return found;
}

/// The plateau whose halves should agree: what they differ by is added to its error.
signal::Measured checked_plateau(const FrequencyResponse& motor, double from, double to,
                                 const std::function<double(double frequency)>& factor) {
  signal::Measured found = plateau(motor, from, to, factor);
  std::vector<double> inside;
  for (const ResponsePoint& p : motor.points)
    if (p.frequency >= from && p.frequency <= to) inside.push_back(p.frequency);
  const double middle = signal::median(std::move(inside));
  const double difference =
      plateau(motor, from, middle, factor).value - plateau(motor, middle, to, factor).value;
  found.standard_error = std::hypot(found.standard_error, difference);
  return found;
}

}  // namespace

Resonances find_resonances(const FrequencyResponse& motor) {
  const ResponsePoints& points = motor.points;
  if (points.size() < 4 * kBeside)
    throw CannotIdentify("only " + std::to_string(points.size()) +
                         " points of the response: no resonance can be found: run at more frequencies");
  // w |H| is flat but for friction and the resonances, so its maximum is the resonance; below it |H| falls
  // but for the anti-resonance.
  const auto lifted =
      smoothed(points, [](const ResponsePoint& p) { return p.frequency * std::abs(p.response); });
  const auto top = static_cast<std::size_t>(std::max_element(lifted.begin(), lifted.end()) - lifted.begin());
  const auto size = smoothed(points, [](const ResponsePoint& p) { return std::abs(p.response); });
  const auto end = size.begin() + static_cast<std::ptrdiff_t>(top) + 1;
  const auto bottom = static_cast<std::size_t>(std::min_element(size.begin(), end) - size.begin());
  if (bottom < kBeside || top < bottom + kBeside || top + kBeside >= points.size())
    throw CannotIdentify("no anti-resonance and resonance above it between " +
                         to_text(points.front().frequency) + " and " + to_text(points.back().frequency) +
                         " Hz");
  return {vertex(points, top, -1, motor.variance_factor, "resonance"),
          vertex(points, bottom, 1, motor.variance_factor, "anti-resonance")};
}

signal::Measured inertia_plateau(const FrequencyResponse& motor, double from, double to) {
  if (!(from >= 0)) throw InvalidParameter("from", from, "must be >= 0 Hz");
  if (!(to > from)) throw InvalidParameter("to", to, "must be > from");
  return plateau(motor, from, to, [](double) { return 1.0; });
}

InertiaPlateaus find_inertias(const FrequencyResponse& motor, const Resonances& resonances) {
  const double r = resonances.resonance.value, ar = resonances.anti_resonance.value;
  const auto off = [](double ratio) { return std::fabs(1 - ratio * ratio); };
  const double infinite = std::numeric_limits<double>::infinity();
  return {checked_plateau(motor, 0, kBelow * ar, [&](double f) { return off(f / ar) / off(f / r); }),
          checked_plateau(motor, kAbove * r, infinite, [&](double f) { return off(ar / f) / off(r / f); })};
}

}  // namespace backlash::identification
