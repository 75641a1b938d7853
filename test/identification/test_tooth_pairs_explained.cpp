// SPDX-License-Identifier: BSD-3-Clause
// The errors of single teeth as the term that explains them: config/yumrukcal_2013_pairs.yaml turns slowly,
// and transmission_error is fitted to what its encoders show.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "backlash_diagnosis/model/gear_geometry.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"
#include "support/tooth_pairs.h"

namespace backlash::identification {
namespace {

constexpr double kStarting = 3;    // s, until the speed is steady
constexpr double kDuration = 130;  // s, a turn of the load
const std::vector<double> kOrders = {1, 280.0 / 15, 280};

/// Motor minus load over load position [rad], the steady part.
struct Deflection {
  std::vector<double> load, value;
};

Deflection deflection_of(const model::Rig& rig, const simulation::SimulationSettings& settings) {
  const record::Record r = simulation::simulate_record(rig, settings, kDuration);
  Deflection d;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (r.time[i] < kStarting) continue;
    d.load.push_back(r.column(record::Channel::load_position)[i]);
    d.value.push_back(r.column(record::Channel::motor_position)[i] - d.load.back());
  }
  return d;
}

/// transmission_error is x = q_P - q_G + A sin(n q + p): with teeth in contact under one torque x stays, and
/// motor minus load is a constant less A sin(n q + p).
struct Fit {
  double constant = 0, left = 0;              // rad, rad rms
  std::map<double, double> amplitude, phase;  // rad, by order
};

Fit fit_waves(const Deflection& d, const std::vector<double>& orders) {
  Eigen::MatrixXd a(d.load.size(), 1 + 2 * orders.size());
  Eigen::VectorXd b(d.load.size());
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    a(i, 0) = 1, b[i] = d.value[i];
    for (std::size_t k = 0; k < orders.size(); ++k) {
      a(i, 1 + 2 * k) = -std::sin(orders[k] * d.load[i]);
      a(i, 2 + 2 * k) = -std::cos(orders[k] * d.load[i]);
    }
  }
  const signal::LeastSquaresFit found = signal::fit_linear(a, b);
  Fit fit;
  fit.constant = found.parameter(0).value;
  fit.left = std::sqrt(found.residuals.squaredNorm() / double(b.size()));
  for (std::size_t k = 0; k < orders.size(); ++k) {
    const double in = found.parameter(1 + 2 * int(k)).value, out = found.parameter(2 + 2 * int(k)).value;
    fit.amplitude[orders[k]] = std::hypot(in, out);
    fit.phase[orders[k]] = std::atan2(out, in);
  }
  return fit;
}

/// m, at rest under the force of the load's friction, over a turn of the load.
std::map<double, double> theory(const rig_file::RigFile& file, const model::ToothErrors& errors) {
  model::GearPair gears;
  gears.pinion.teeth = 15, gears.gear.teeth = 280;
  gears.module = 3e-3, gears.pressure_angle = 20 * M_PI / 180, gears.pinion.profile_shift = 0.3;
  const test::PairsAtRest pairs{model::gear_geometry(gears).contact_ratio, 0.1, 2.953e6, 15, 280};
  const double force =
      (file.rig.link.coulomb_friction + file.rig.link.viscous_damping * 0.05) / file.rig.mesh.base_radius;
  constexpr int kPerTooth = 100, kPoints = 280 * kPerTooth;
  std::map<double, double> size;
  for (const double order : {1.0, 280.0 / 15, 280.0}) {
    double in = 0, out = 0, weight = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double turn = double(i) / kPoints, angle = 2 * M_PI * order * turn;
      const double window = 1 - std::cos(2 * M_PI * turn);  // order 18.667 is no whole number
      const double d = order == 1 ? 1 : window;
      const double depth = test::depth_at_rest(pairs, errors, double(i) / kPerTooth, force);
      in += d * depth * std::cos(angle), out += d * depth * std::sin(angle), weight += d;
    }
    size[order] = 2 * std::hypot(in, out) / weight;
  }
  return size;
}

/// The order near one [1/rad], at which a wave leaves least: three points and a parabola, each time closer.
double order_that_fits(const Deflection& d, double order) {
  double step = 0.3;
  for (int i = 0; i < 4; ++i, step /= 4) {
    double left[3];
    for (int k = 0; k < 3; ++k) {
      std::vector<double> orders = kOrders;
      for (double& o : orders) o = o == 280 ? order + (k - 1) * step : o;
      left[k] = std::pow(fit_waves(d, orders).left, 2);
    }
    const double bend = left[0] + left[2] - 2 * left[1];
    if (bend > 0) order += std::clamp(0.5 * (left[0] - left[2]) / bend, -1.0, 1.0) * step;
  }
  return order;
}

TEST(ToothPairsExplained, ByTransmissionErrorsOfTheirOrders) {
  const rig_file::RigFile file =
      rig_file::load_rig_file(test::package_file("config/yumrukcal_2013_pairs.yaml"));
  model::ToothErrors errors;  // those of the file
  errors.slope = 30e-6, errors.crown = 5e-6;
  errors.pinion = {12e-6, 0.5, {}}, errors.gear = {40e-6, 1.0, {}};
  const Deflection shown = deflection_of(file.rig, file.simulation);
  const double r = file.rig.mesh.base_radius;
  const Fit fit = fit_waves(shown, kOrders);
  const std::map<double, double> expected = theory(file, errors);
  // c omega / k = 1.5 % of what the teeth give way by, and the noise of the encoders: 7e-6 / sqrt(12) rad in
  // each of 1e5 samples leaves 1e-8 rad. Three per cent of the wave hold both.
  for (const double order : kOrders)
    EXPECT_NEAR(r * fit.amplitude.at(order), expected.at(order), 0.03 * expected.at(order)) << order;
  // 2 pi of travel and this noise give the order to some 1e-3; the multiples of 280 are further off.
  EXPECT_NEAR(order_that_fits(shown, 280.2), 280, 0.01);

  // The same machine with one mesh, without and with the terms.
  model::Rig one_mesh = file.rig;
  one_mesh.mesh.pairs = nullptr;
  const double before = fit_waves(deflection_of(one_mesh, file.simulation), kOrders).amplitude.at(280);
  EXPECT_LT(before, 0.02 * fit.amplitude.at(280));
  for (const double order : kOrders)
    one_mesh.terms.push_back(model::make_term(
        "transmission_error",
        {{"amplitude", fit.amplitude.at(order)}, {"order", order}, {"phase", fit.phase.at(order)}}));
  const Fit model = fit_waves(deflection_of(one_mesh, file.simulation), kOrders);
  for (const double order : kOrders) {
    EXPECT_NEAR(model.amplitude.at(order), fit.amplitude.at(order), 0.03 * fit.amplitude.at(order)) << order;
    EXPECT_NEAR(std::remainder(model.phase.at(order) - fit.phase.at(order), 2 * M_PI), 0, 0.05) << order;
  }
}

}  // namespace
}  // namespace backlash::identification
