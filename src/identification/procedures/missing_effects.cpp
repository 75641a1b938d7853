// SPDX-License-Identifier: BSD-3-Clause
#include "missing_effects.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kLeastExplained =
    0.1;                              // choice: share of the squares that are left, that an effect explains
constexpr double kComparable = 2;     // choice: times the squares that the best effect leaves
constexpr int kMostEffects = 4;       // choice: in one machine
constexpr double kDrawn = 0.1;        // simulation: share of what is left that follows a column
constexpr double kUnresolved = 1e-8;  // choice: of a column, beyond the others: nothing but rounding
constexpr double kShort = 2;          // choice: rad of travel, up to which a turn's wave is a straight line
constexpr double kStribeckSpeeds[] = {0.03, 0.1, 0.3};  // choice: of the speed's root of mean square

double root_of_mean_square(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / double(x.size()));
}

double sign(double x) {
  return (x > 0) - (x < 0);
}

/// What a fit of the columns to the residuals moves and leaves.
struct Extended {
  Eigen::VectorXd moved;  // of the first columns
  double left = 0;        // squares
};

Extended extended(const Eigen::MatrixXd& a, const Eigen::MatrixXd& more, const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd all(a.rows(), a.cols() + more.cols());
  all << a, more;
  const Eigen::VectorXd length = all.colwise().norm().cwiseMax(1e-300);
  all *= length.cwiseInverse().asDiagonal();
  if (signal::smallest_pivot(signal::gram(all)) < kUnresolved)
    return {Eigen::VectorXd::Zero(a.cols()), residuals.squaredNorm()};
  const Eigen::VectorXd x =
      signal::solve_symmetric(signal::gram(all), signal::transposed_product(all, residuals));
  return {x.cwiseQuotient(length).head(a.cols()), (residuals - all * x).squaredNorm()};
}

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(b.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

/// How far x is moved by what no effect explains.
Eigen::VectorXd unexplained(const Eigen::MatrixXd& a, double left) {
  const Eigen::MatrixXd gain = signal::symmetric_inverse(signal::gram(a));
  Eigen::VectorXd drawn(a.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) drawn[i] = kDrawn * left * std::sqrt(gain(i, i));
  return drawn;
}

/// A wave of one period a turn, or the straight line that a short travel sees of it, times `factor`.
EffectShapes by_position(const std::vector<double>& position, const std::vector<double>& factor) {
  const auto [low, high] = std::minmax_element(position.begin(), position.end());
  const double middle = 0.5 * (*low + *high);
  EffectShapes shapes(*high - *low > kShort ? 2 : 1, factor);
  for (std::size_t k = 0; k < position.size(); ++k) {
    const double from_middle = position[k] - middle;
    shapes[0][k] *= shapes.size() == 1 ? from_middle : std::sin(from_middle);
    if (shapes.size() == 2) shapes[1][k] *= std::cos(from_middle);
  }
  return shapes;
}

}  // namespace

std::vector<EffectShapes> likely_effects(const std::vector<double>& time, const std::vector<double>& position,
                                         const std::vector<double>& speed,
                                         const std::vector<double>& torque) {
  const auto of = [&](auto shape) {
    std::vector<double> out(time.size());
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = shape(k);
    return out;
  };
  const auto direction = [&](std::size_t k) { return sign(speed[k]); };
  std::vector<EffectShapes> effects{
      by_position(position, of([](std::size_t) { return 1.0; })),
      {of([&](std::size_t k) { return speed[k] * std::fabs(speed[k]); })},
      {of([&](std::size_t k) { return std::fabs(speed[k]); })},
      {of([&](std::size_t k) { return direction(k) * std::fabs(torque[k]); })},
      by_position(position, of(direction)),
      {of([&](std::size_t k) { return direction(k) * (time[k] - time.front()); })}};
  const double usual = root_of_mean_square(speed);
  for (const double share : kStribeckSpeeds)
    effects.push_back(
        {of([&](std::size_t k) { return direction(k) * std::exp(-std::fabs(speed[k]) / (share * usual)); })});
  return effects;
}

Eigen::VectorXd drawn_by_missing(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                 const std::vector<Eigen::MatrixXd>& effects, double noise) {
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(a.cols());
  Eigen::MatrixXd chosen(a.rows(), 0);
  Extended with{moved, residuals.squaredNorm()};
  for (int n = 0; n < kMostEffects && with.left > noise * noise; ++n) {
    std::vector<Extended> tried;
    for (const Eigen::MatrixXd& effect : effects)
      tried.push_back(extended(a, beside(chosen, effect), residuals));
    const auto best = std::min_element(tried.begin(), tried.end(),
                                       [](const Extended& x, const Extended& y) { return x.left < y.left; });
    if (best == tried.end() || with.left - best->left < kLeastExplained * with.left) break;
    Eigen::VectorXd furthest = Eigen::VectorXd::Zero(a.cols());
    for (const Extended& e : tried)
      if (e.left <= kComparable * best->left)
        furthest = furthest.cwiseMax((1 - e.left / with.left) * (e.moved - with.moved).cwiseAbs());
    moved += furthest;
    chosen = beside(chosen, effects[std::size_t(best - tried.begin())]);
    with = *best;
  }
  const double unknown = std::sqrt(std::max(0.0, with.left - noise * noise));
  return (moved.cwiseAbs2() + unexplained(a, unknown).cwiseAbs2()).cwiseSqrt();
}

}  // namespace backlash::identification
