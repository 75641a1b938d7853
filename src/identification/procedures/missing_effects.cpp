// SPDX-License-Identifier: BSD-3-Clause
#include "missing_effects.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kLeastExplained =
    0.1;                           // choice: share of the squares that are left, that an effect explains
constexpr double kComparable = 2;  // choice: times the squares that the best effect leaves
constexpr int kMostEffects = 4;    // choice: in one machine
constexpr double kDrawn = 0.1;     // simulation: share of what is left that follows a column
// Choice: of the squares of an effect, what the equation cannot do by itself. One with less would have to be
// ten times as large as what is left of the torque.
constexpr double kOwn = 0.01;

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(b.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

/// What a fit of the columns to the residuals moves and leaves.
struct Extended {
  Eigen::VectorXd moved;  // of the first columns
  double left = 0;        // squares
};

Eigen::VectorXd fitted(const Eigen::MatrixXd& a, const Eigen::VectorXd& y) {
  const Eigen::VectorXd length = a.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = a * length.cwiseInverse().asDiagonal();
  return signal::solve_symmetric(signal::gram(scaled), signal::transposed_product(scaled, y))
      .cwiseQuotient(length);
}

Extended extended(const Eigen::MatrixXd& a, const Eigen::MatrixXd& more, const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd all = a;
  for (Eigen::Index i = 0; i < more.cols(); ++i) {
    const Eigen::VectorXd column = more.col(i), own = column - all * fitted(all, column);
    if (!(own.squaredNorm() > kOwn * column.squaredNorm()))
      return {Eigen::VectorXd::Zero(a.cols()), residuals.squaredNorm()};
    all = beside(all, column);
  }
  const Eigen::VectorXd x = fitted(all, residuals);
  return {x.head(a.cols()), (residuals - all * x).squaredNorm()};
}

/// How far x is moved by what no effect explains.
Eigen::VectorXd unexplained(const Eigen::MatrixXd& a, double left) {
  const Eigen::MatrixXd gain = signal::symmetric_inverse(signal::gram(a));
  Eigen::VectorXd drawn(a.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) drawn[i] = kDrawn * left * std::sqrt(gain(i, i));
  return drawn;
}

model::MotionRange range_of(const std::vector<model::JointMoment>& moments) {
  model::MotionRange range;
  range.from = range.to = moments.front().position;
  for (const model::JointMoment& m : moments) {
    range.speed += m.speed * m.speed, range.torque += m.load * m.load;
    range.from = std::min(range.from, m.position), range.to = std::max(range.to, m.position);
  }
  range.speed = std::sqrt(range.speed / double(moments.size()));
  range.torque = std::sqrt(range.torque / double(moments.size()));
  range.duration = moments.back().time - moments.front().time;
  return range;
}

EffectShapes shapes_of(const model::TermColumns& term, const std::vector<model::JointMoment>& moments) {
  EffectShapes all(term.count());
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const model::JointMoment& m : moments) all[i].push_back(term.at(i, m));
  return all;
}

}  // namespace

std::vector<EffectShapes> likely_effects(const std::vector<model::JointMoment>& moments) {
  const model::MotionRange range = range_of(moments);
  // Slow waves alone follow the columns of the equation: one a turn, or half of one over the travel.
  const double slowest = std::max(1.0, 0.5 * model::order_resolution(range));
  std::vector<EffectShapes> all;
  for (const model::SearchedTerm& searched : model::searched_terms(model::ShownIn::torque, range)) {
    const std::optional<ParameterSpec> shape = model::searched_shape(*searched.type);
    std::vector<double> values = searched.shapes;
    if (values.empty()) values.push_back(slowest);
    ParameterValues given = searched.given;
    for (const double value : values) {
      if (shape) given[shape->name] = value;
      all.push_back(shapes_of(model::TermColumns(*searched.type, given), moments));
    }
  }
  return all;
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
