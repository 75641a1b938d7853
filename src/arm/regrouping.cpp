// SPDX-License-Identifier: BSD-3-Clause
#include "regrouping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::arm {
namespace {

constexpr double kLeastShown = 1e-4;  // choice: of a column's size, below which the motions do not show it
constexpr double kNone =
    1e-9;  // choice: of the largest column of its kind, below which it is none but for rounding
constexpr int kMostSteps = 100, kMostHalvings = 40;  // of Newton; choice
constexpr double kSettled = 1e-12;                   // of the decrease that a step promises; choice

Eigen::VectorXd stacked(const std::vector<BodyParameters>& links) {
  Eigen::VectorXd theta(10 * Eigen::Index(links.size()));
  for (std::size_t i = 0; i < links.size(); ++i) theta.segment<10>(10 * Eigen::Index(i)) = links[i];
  return theta;
}

std::vector<BodyParameters> bodies_of(const Eigen::VectorXd& theta) {
  std::vector<BodyParameters> links;
  for (Eigen::Index i = 0; i < theta.size(); i += 10) links.emplace_back(theta.segment<10>(i));
  return links;
}

bool all_consistent(const Eigen::VectorXd& theta) {
  const std::vector<BodyParameters> links = bodies_of(theta);
  return std::all_of(links.begin(), links.end(), is_consistent);
}

Eigen::Matrix4d inverse(const Eigen::Matrix4d& p) {
  return signal::symmetric_inverse(Eigen::MatrixXd(p));
}

/// sum of tr(P P_0^-1) - log|P| over the bodies, with its derivatives.
class Distance {
 public:
  explicit Distance(const std::vector<BodyParameters>& declared) {
    for (const BodyParameters& body : declared) inverse_.push_back(inverse(pseudo_inertia(body)));
    for (std::size_t i = 0; i < 10; ++i) basis_[i] = pseudo_inertia(BodyParameters::Unit(Eigen::Index(i)));
  }

  double value(const Eigen::VectorXd& theta) const {
    double sum = 0;
    for (std::size_t b = 0; b < inverse_.size(); ++b) {
      const Eigen::Matrix4d p = pseudo_inertia(theta.segment<10>(10 * Eigen::Index(b)));
      const Eigen::VectorXd eigenvalues = signal::symmetric_eigenvalues(Eigen::MatrixXd(p));
      if (!(eigenvalues[0] > 0)) return std::numeric_limits<double>::infinity();
      sum += (inverse_[b] * p).trace() - eigenvalues.array().log().sum();
    }
    return sum;
  }

  void derivatives(const Eigen::VectorXd& theta, Eigen::VectorXd& gradient, Eigen::MatrixXd& hessian) const {
    gradient = Eigen::VectorXd::Zero(theta.size());
    hessian = Eigen::MatrixXd::Zero(theta.size(), theta.size());
    for (std::size_t b = 0; b < inverse_.size(); ++b) {
      const Eigen::Index at = 10 * Eigen::Index(b);
      const Eigen::Matrix4d own = inverse(pseudo_inertia(theta.segment<10>(at)));
      std::array<Eigen::Matrix4d, 10> turned;
      for (std::size_t i = 0; i < 10; ++i) turned[i] = own * basis_[i];
      for (std::size_t i = 0; i < 10; ++i) {
        gradient[at + Eigen::Index(i)] = ((inverse_[b] - own) * basis_[i]).trace();
        for (std::size_t k = 0; k < 10; ++k)
          hessian(at + Eigen::Index(i), at + Eigen::Index(k)) = (turned[i] * turned[k]).trace();
      }
    }
  }

 private:
  std::vector<Eigen::Matrix4d> inverse_;  // of the declared pseudo inertias
  std::array<Eigen::Matrix4d, 10> basis_;
};

/// The least distance that the directions (columns) lead to, from bodies that are physical.
Eigen::VectorXd least(const Distance& distance, const Eigen::VectorXd& start,
                      const Eigen::MatrixXd& directions) {
  Eigen::VectorXd theta = start;
  double best = distance.value(theta);
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  for (int i = 0; i < kMostSteps && directions.cols() > 0; ++i) {
    distance.derivatives(theta, gradient, hessian);
    const Eigen::VectorXd g = directions.transpose() * gradient;
    Eigen::MatrixXd h = signal::product(directions.transpose(), signal::product(hessian, directions));
    const Eigen::VectorXd scale = h.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * h * scale.asDiagonal();
    const Eigen::VectorXd step =
        -(scale.asDiagonal() * signal::solve_symmetric(scaled, Eigen::MatrixXd(scale.asDiagonal() * g)));
    if (!(-g.dot(step) > kSettled)) break;
    const Eigen::VectorXd along = directions * step;
    double t = 1;
    int halvings = 0;
    for (; halvings < kMostHalvings && !(distance.value(theta + t * along) < best); ++halvings) t /= 2;
    if (halvings == kMostHalvings) break;
    theta += t * along;
    best = distance.value(theta);
  }
  return theta;
}

}  // namespace

Regrouping::Regrouping(const Chain& chain, const std::vector<FittedMotion>& motions) {
  const Eigen::Index size = 10 * Eigen::Index(chain.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
  for (const FittedMotion& m : motions)
    for (const Eigen::MatrixXd& y : m.motion->chain) gram += signal::gram(y);
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt();
  shown_.assign(std::size_t(size), Shown::in_others);
  Eigen::MatrixXd left = gram;
  for (Eigen::Index i = 0; i < size; ++i) {
    double most = 0;  // of its kind
    for (Eigen::Index k = 0; k < size; ++k)
      if (kStandardUnits[std::size_t(k % 10)] == kStandardUnits[std::size_t(i % 10)])
        most = std::max(most, scale[k]);
    if (!(scale[i] > kNone * most)) {
      shown_[std::size_t(i)] = Shown::not_at_all;
      continue;
    }
    if (!(left(i, i) > kLeastShown * kLeastShown * scale[i] * scale[i])) continue;
    kept_.push_back(i);
    shown_[std::size_t(i)] = Shown::leads;
    left = (left - left.col(i) * left.row(i) / left(i, i)).eval();
  }
  const auto n = Eigen::Index(kept_.size());
  Eigen::MatrixXd own(n, n), cross(n, size);
  for (Eigen::Index r = 0; r < n; ++r)
    for (Eigen::Index c = 0; c < size; ++c) {
      cross(r, c) = gram(kept_[std::size_t(r)], c);
      for (Eigen::Index k = 0; k < n; ++k) own(r, k) = gram(kept_[std::size_t(r)], kept_[std::size_t(k)]);
    }
  regroup_ = signal::solve_symmetric(own, cross);
}

std::vector<BaseParameter> Regrouping::base_parameters(const Chain& chain,
                                                       const std::vector<BodyParameters>& links,
                                                       const Eigen::MatrixXd& covariance) const {
  const Eigen::Index size = regroup_.cols();
  const Eigen::VectorXd values = regroup_ * stacked(links);
  const Eigen::MatrixXd spread = regroup_ * covariance.topLeftCorner(size, size) * regroup_.transpose();
  std::vector<BaseParameter> base;
  for (Eigen::Index r = 0; r < values.size(); ++r) {
    const auto i = std::size_t(kept_[std::size_t(r)]);
    base.push_back({standard_name(chain, i),
                    {values[r], std::sqrt(std::max(0.0, spread(r, r)))},
                    kStandardUnits[i % 10]});
  }
  return base;
}

std::vector<BodyParameters> Regrouping::nearest(const std::vector<BodyParameters>& declared,
                                                const std::vector<BodyParameters>& links) const {
  const Eigen::VectorXd theta = stacked(links), wanted = stacked(declared);
  Eigen::VectorXd kept = theta;
  for (Eigen::Index i = 0; i < theta.size(); ++i)
    if (shown_[std::size_t(i)] == Shown::not_at_all) kept[i] = wanted[i];
  const bool exact = all_consistent(kept);
  Eigen::MatrixXd directions(theta.size(), 0);
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const Shown shown = shown_[std::size_t(i)];
    if (shown == Shown::leads || (exact && shown == Shown::not_at_all)) continue;
    Eigen::VectorXd direction = Eigen::VectorXd::Unit(theta.size(), i);
    for (std::size_t r = 0; r < kept_.size() && shown == Shown::in_others; ++r)
      direction[kept_[r]] -= regroup_(Eigen::Index(r), i);
    directions.conservativeResize(Eigen::NoChange, directions.cols() + 1);
    directions.rightCols(1) = direction;
  }
  return bodies_of(least(Distance(declared), exact ? kept : theta, directions));
}

}  // namespace backlash::arm
