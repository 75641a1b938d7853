// SPDX-License-Identifier: BSD-3-Clause
#include "different_values.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/measured.h"
#include "healthy_columns.h"

namespace backlash::changes {
namespace {

constexpr double kLeast = 0.25;  // choice: of a value; friction of a cold day is less
constexpr double kClear = 5;     // choice: of what healthy records differ by, and of standard errors
constexpr double kAlike = 0.1;   // choice: of a factor, that all parts of a torque have in common

struct Named {
  int column;
  const char* name;
  const char* unit;
  double times;  // of the column's value, that of the parameter
};

/// What the record shows more of each lasting column over all of it, whichever of the columns takes it:
/// friction that is 0.1 less for good and 0.1 more while it warms up is the same friction.
struct Lasting {
  Eigen::VectorXd more;
  Eigen::MatrixXd errors, spread;  // covariances: of the record's noise, and of healthy records
};

Lasting lasting_of(const Background& b, Eigen::Index lasting, Eigen::Index own) {
  const auto all = b.columns.leftCols(own), first = b.columns.leftCols(lasting);
  Eigen::MatrixXd squares = first.transpose() * first;
  squares.diagonal().array() *= 1 + 1e-9;  // what the motion does not show
  squares.diagonal().array() += 1e-300;
  const Eigen::MatrixXd shares = squares.ldlt().solve(first.transpose() * all);
  return {shares * b.estimate.head(own), shares * b.inverse.topLeftCorner(own, own) * shares.transpose(),
          shares * b.spread.head(own).cwiseAbs2().asDiagonal() * shares.transpose()};
}

/// Relative to the healthy value; 0 where it is not clear.
signal::Measured difference(const HealthyModel& model, const Lasting& l, int column) {
  const double by = l.more[column], error = std::sqrt(l.errors(column, column)),
               spread = std::sqrt(l.spread(column, column)), healthy = model.values[column];
  const bool clear =
      std::fabs(by) > kClear * std::max(spread, error) && std::fabs(by) > kLeast * std::fabs(healthy);
  return clear && healthy != 0 ? signal::Measured{by / healthy, error / std::fabs(healthy)}
                               : signal::Measured{0, 0};
}

}  // namespace

std::vector<DifferentValue> different_values(const HealthyModel& model, const Background& background,
                                             Eigen::Index own, bool linear) {
  const std::vector<Named> torque = {{kInertia, "inertia", "kg m^2", 1},
                                     {kCoulomb, "motor_coulomb", "N m", 1},
                                     {kViscous, "motor_viscous", "N m s/rad", 1}},
                           deflection = {{kHalfGap, "backlash", "rad", 2}};
  const bool of_torque = model.sampling.channel == ChangeChannel::torque;
  const Lasting lasting = lasting_of(background, of_torque ? kCommonColumns : kScale + 1, own);
  std::vector<DifferentValue> all;
  std::vector<signal::Measured> factors;
  for (const Named& n : of_torque ? torque : deflection) {
    const signal::Measured by = difference(model, lasting, n.column);
    if (by.value == 0) continue;
    factors.push_back(by);
    all.push_back(
        {n.name, fmt::format("{} by {:.3g} {} (healthy: {:.3g})", n.name, n.times * lasting.more[n.column],
                             model::axis_unit(n.unit, linear), n.times * model.values[n.column])});
  }
  if (factors.size() < 2) return all;
  const signal::Measured best =
      *std::min_element(factors.begin(), factors.end(),
                        [](const auto& x, const auto& y) { return x.standard_error < y.standard_error; });
  for (const signal::Measured& f : factors)
    if (std::fabs(f.value - best.value) > kAlike + 2 * f.standard_error) return all;
  return {{"motor_torque_gain", fmt::format("motor_torque_gain by {:.2g}", best.value)}};
}

}  // namespace backlash::changes
