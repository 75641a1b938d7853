// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/harmonics.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/signal/least_squares.h"

namespace backlash::identification {
namespace {

struct Points {
  const std::vector<double>&angle, &value;
};

signal::LeastSquaresFit fit_orders(const Points& points, const std::vector<int>& orders) {
  const auto n = Eigen::Index(points.value.size());
  Eigen::MatrixXd a(n, 1 + 2 * Eigen::Index(orders.size()));
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    b[i] = points.value[std::size_t(i)];
    a(i, 0) = 1;
    for (std::size_t k = 0; k < orders.size(); ++k) {
      const double angle = orders[k] * points.angle[std::size_t(i)];
      a(i, 1 + 2 * Eigen::Index(k)) = std::sin(angle);
      a(i, 2 + 2 * Eigen::Index(k)) = std::cos(angle);
    }
  }
  return signal::fit_linear(a, b);
}

/// P(F > f) for 2 and `freedom` degrees: closed form.
double f_tail(double f, double freedom) {
  return std::pow(1 + 2 * f / freedom, -freedom / 2);
}

struct Selection {
  std::vector<int> orders;
  std::map<int, double> chance;
  double first_chance = 1;  // of the strongest order, taken or not
};

Selection select_orders(const Points& points, std::vector<int> left, double false_alarm) {
  Selection s;
  double before = fit_orders(points, {}).residuals.squaredNorm();
  while (!left.empty() && points.value.size() > 2 * s.orders.size() + 5) {
    int best = -1;
    double least = before;
    for (const int order : left) {
      std::vector<int> with = s.orders;
      with.push_back(order);
      const double sum = fit_orders(points, with).residuals.squaredNorm();
      if (sum < least) {
        least = sum;
        best = order;
      }
    }
    if (best < 0) break;
    const double freedom = double(points.value.size()) - 3 - 2 * double(s.orders.size());
    const double f = least > 0 ? (before - least) / 2 / (least / freedom) : 1e300;
    const double chance = std::min(1.0, double(left.size()) * f_tail(f, freedom));
    if (s.orders.empty()) s.first_chance = chance;
    if (chance > false_alarm) break;
    s.orders.push_back(best);
    s.chance[best] = chance;
    left.erase(std::find(left.begin(), left.end(), best));
    before = least;
  }
  std::sort(s.orders.begin(), s.orders.end());
  return s;
}

Harmonic harmonic_of(const signal::LeastSquaresFit& fit, std::size_t k, int order, double chance) {
  const auto at = 1 + 2 * Eigen::Index(k);
  const double s = fit.values[at], c = fit.values[at + 1], size = std::hypot(s, c);
  const Eigen::Matrix2d covariance = fit.covariance.block<2, 2>(at, at);
  const Eigen::Vector2d along(s / size, c / size), across(-c / size, s / size);
  Harmonic h;
  h.order = order;
  h.amplitude = {size, std::sqrt(along.dot(covariance * along))};
  h.phase = {std::atan2(c, s), std::sqrt(across.dot(covariance * across)) / size};
  h.chance = chance;
  return h;
}

}  // namespace

HarmonicSeries fit_harmonics(const std::vector<double>& angle, const std::vector<double>& values,
                             const std::vector<int>& orders, double false_alarm) {
  const Points points{angle, values};
  const Selection selection = select_orders(points, orders, false_alarm);
  const signal::LeastSquaresFit fit = fit_orders(points, selection.orders);
  HarmonicSeries series;
  series.mean = fit.parameter(0);
  series.deviation = fit.deviation;
  series.chance = selection.first_chance;
  for (std::size_t k = 0; k < selection.orders.size(); ++k)
    series.harmonics.push_back(
        harmonic_of(fit, k, selection.orders[k], selection.chance.at(selection.orders[k])));
  return series;
}

}  // namespace backlash::identification
