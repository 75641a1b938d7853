// SPDX-License-Identifier: BSD-3-Clause
#include "reach.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash::identification {
namespace {

constexpr double kSlope = 0.1;  // choice: of a logarithm, an error up to which its slope says it all
constexpr double kDeviations =
    2;                        // choice: that contradict a value; fewer are hardly above the simulation's own
constexpr double kSteps = 2;  // choice: factor from one value that is tried to the next
constexpr int kHalvings = 4;  // choice (time): of the last step, in logarithms
constexpr int kRefits = 3;    // choice (time): of the other values, at each

/// By how much the rows grow at another value of one, with all others fitted anew along their columns.
class Profile {
 public:
  Profile(const MachineFit& fit, Eigen::Index i, RowsOf rows, Eigen::Index count)
      : values_(fit.fit.values), i_(i), rows_(std::move(rows)), own_prior_(count + i) {
    Eigen::MatrixXd others = fit.fit.jacobian;
    unit_ = others.colwise().norm().cwiseInverse();
    others.col(i).setZero();
    others *= unit_.asDiagonal();
    others(own_prior_, i) = 1;  // the records alone are asked, and its own value stays
    solver_.compute(others);
    const Eigen::VectorXd here = rows_(values_);
    prior_ = here[own_prior_];
    least_ = here.squaredNorm();
  }

  /// Throws Error where the machine cannot be simulated.
  double growth(double value) const {
    double least = std::numeric_limits<double>::infinity();
    Eigen::VectorXd values = values_;
    for (int k = 0; k < kRefits; ++k) {
      values[i_] = value;
      Eigen::VectorXd rows = rows_(values);
      rows[own_prior_] = prior_;
      const double left = rows.squaredNorm();
      if (!(left < least)) break;
      least = left;
      rows[own_prior_] = 0;
      values -= unit_.cwiseProduct(Eigen::VectorXd(solver_.solve(rows)));
    }
    return least - least_;
  }

 private:
  const Eigen::VectorXd values_;
  Eigen::VectorXd unit_;
  const Eigen::Index i_;
  const RowsOf rows_;
  const Eigen::Index own_prior_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver_;
  double prior_ = 0, least_ = 0;
};

/// The logarithm at which the rows have grown by so much, between two; a machine that cannot be simulated is
/// contradicted.
double contradicted_at(const Profile& profile, double from, double to, double growth) {
  const auto contradicted = [&](double value) {
    try {
      return !(profile.growth(value) < growth);
    } catch (const Error&) {
      return true;
    }
  };
  double last = from, next = from + std::log(kSteps);
  for (; next < to && !contradicted(next); next += std::log(kSteps)) last = next;
  if (next >= to) return std::numeric_limits<double>::infinity();
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (last + next);
    (contradicted(middle) ? next : last) = middle;
  }
  return next;
}

}  // namespace

Eigen::VectorXd reach_of_values(const MachineFit& fit, const Machine& start, const RowsOf& rows,
                                Eigen::Index count, double growth) {
  const Unknowns unknowns(start);
  Eigen::VectorXd reach = Eigen::VectorXd::Zero(fit.fit.values.size());
  for (std::size_t k = 0; k < start.parameters.size(); ++k) {
    const auto i = Eigen::Index(k);
    const FitParameter& p = start.parameters[k];
    if (!p.positive || std::sqrt(fit.fit.covariance(i, i)) < kSlope) continue;
    const auto value_at = [&](double logarithm) {
      Eigen::VectorXd values = fit.fit.values;
      values[i] = logarithm;
      return p.get(unknowns.rig(values));
    };
    const Profile profile(fit, i, rows, count);
    const double at =
        contradicted_at(profile, fit.fit.values[i], farthest_logarithm(), std::pow(kDeviations * growth, 2));
    reach[i] = std::isinf(at) ? at : (value_at(at) - value_at(fit.fit.values[i])) / kDeviations;
  }
  return reach;
}

}  // namespace backlash::identification
