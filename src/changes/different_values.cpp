// SPDX-License-Identifier: BSD-3-Clause
#include "different_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Relative to the healthy value; 0 where it is not clear.
signal::Measured difference(const HealthyModel& model, const Background& b, int column) {
  const double by = b.estimate[column], error = std::sqrt(b.inverse(column, column)),
               healthy = model.values[column];
  const bool clear = std::fabs(by) > kClear * std::max(model.spread[column], error) &&
                     std::fabs(by) > kLeast * std::fabs(healthy);
  return clear && healthy != 0 ? signal::Measured{by / healthy, error / std::fabs(healthy)}
                               : signal::Measured{0, 0};
}

}  // namespace

std::vector<DifferentValue> different_values(const HealthyModel& model, Background background, bool linear) {
  // No prior: values of another machine must not be drawn to those of the healthy one.
  background.spread.head(kCommonColumns).setConstant(std::numeric_limits<double>::infinity());
  if (model.sampling.channel == ChangeChannel::deflection)
    background.spread[kHalfGap] = std::numeric_limits<double>::infinity();
  background.solve();
  const std::vector<Named> torque = {{kInertia, "inertia", "kg m^2", 1},
                                     {kCoulomb, "motor_coulomb", "N m", 1},
                                     {kViscous, "motor_viscous", "N m s/rad", 1}},
                           deflection = {{kHalfGap, "backlash", "rad", 2}};
  const bool of_torque = model.sampling.channel == ChangeChannel::torque;
  std::vector<DifferentValue> all;
  std::vector<signal::Measured> factors;
  for (const Named& n : of_torque ? torque : deflection) {
    const signal::Measured by = difference(model, background, n.column);
    if (by.value == 0) continue;
    factors.push_back(by);
    all.push_back({n.name, fmt::format("{} by {:.3g} {} (healthy: {:.3g})", n.name,
                                       n.times * background.estimate[n.column],
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
