// SPDX-License-Identifier: BSD-3-Clause
#include "explainable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "backlash_diagnosis/signal/order_spectrum.h"
#include "backlash_diagnosis/signal/repetition.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "residual_orders.h"

namespace backlash::identification {
namespace {

constexpr double kIndependent =
    0.4;                    // theory: of a period of the cutoff, between independent values of a residual
constexpr int kParts = 20;  // choice: of all samples, whose energies are compared

/// Residual of one channel and the states that it may follow, samples that count, of all records.
struct Samples {
  std::vector<double> residual, measured;
  std::vector<int> block;
  std::vector<double> position, velocity, acceleration, transmitted, path, direction;
  std::vector<std::vector<double>> time;  // per record; -1 in all others
  double floor = 0;                       // sum of squares
};

/// Path since the motor last turned round, beyond the noise of its speed.
std::vector<double> path_since_reversal(const ServoData& d) {
  constexpr double kClear = 4;  // theory: standard deviations
  std::vector<double> path(d.size(), 0.0);
  double from = d.motor.empty() ? 0 : d.motor[0], direction = 0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double v = d.motor_rate[k];
    if (std::fabs(v) > kClear * d.rate_noise && v * direction <= 0) direction = v, from = d.motor[k];
    path[k] = std::fabs(d.motor[k] - from);
  }
  return path;
}

std::size_t stride_of(const std::vector<Predicted>& records, double cutoff,
                      const ExplainableSettings& settings) {
  std::size_t total = 0;
  for (const Predicted& p : records) total += p.data->size();
  const double independent = kIndependent / (cutoff * records.front().data->interval);
  return std::max({std::size_t{1}, std::size_t(independent), total / settings.most_samples + 1});
}

void add_record(const Predicted& record, std::size_t number, bool deflection, double cutoff,
                std::size_t stride, const ExplainableSettings& settings, Samples& s) {
  const ServoData& d = *record.data;
  const ServoPrediction& p = record.prediction;
  const std::vector<double>&measured = deflection ? p.measured_deflection : p.measured_torque,
        &predicted = deflection ? p.deflection : p.torque;
  const std::vector<char>& counts = deflection ? p.settled : p.counts;
  const double floor =
      std::max(deflection ? p.deflection_floor : p.torque_floor, repeated_noise(record, deflection));
  const std::vector<double> path = path_since_reversal(d);
  const std::vector<double> acceleration = d.smooth_acceleration.empty()
                                               ? signal::low_pass(d.motor_acceleration, d.interval, cutoff)
                                               : d.smooth_acceleration;
  for (std::size_t k = 0; k < d.size(); k += stride) {
    if (!counts[k]) continue;
    s.residual.push_back(measured[k] - predicted[k]);
    s.measured.push_back(measured[k]);
    s.block.push_back(int(number) * settings.blocks + int(std::size_t(settings.blocks) * k / d.size()));
    s.position.push_back(d.motor[k]);
    s.velocity.push_back(d.motor_rate[k]);
    s.acceleration.push_back(acceleration[k]);
    s.transmitted.push_back(p.load.mesh_torque[k]);
    s.path.push_back(path[k]);
    s.direction.push_back(d.motor_rate[k] < 0 ? -1 : 1);
    for (std::size_t i = 0; i < s.time.size(); ++i)
      s.time[i].push_back(i == number ? double(k) * d.interval : -1);
    s.floor += floor * floor;
  }
}

Samples samples(const std::vector<Predicted>& records, bool deflection, double cutoff,
                const ExplainableSettings& settings) {
  Samples s;
  s.time.resize(records.size());
  const std::size_t stride = stride_of(records, cutoff, settings);
  for (std::size_t i = 0; i < records.size(); ++i)
    add_record(records[i], i, deflection, cutoff, stride, settings, s);
  return s;
}

Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& parts) {
  Eigen::Index columns = 0;
  for (const Eigen::MatrixXd& p : parts) columns += p.cols();
  Eigen::MatrixXd all(parts.front().rows(), columns);
  columns = 0;
  for (const Eigen::MatrixXd& p : parts) all.middleCols(columns, p.cols()) = p, columns += p.cols();
  return all;
}

/// A function of x, and another one for the other direction of motion.
Eigen::MatrixXd with_direction(const std::vector<double>& x, const Samples& s, int knots) {
  const Eigen::MatrixXd hats = signal::hat_functions(x, knots);
  const Eigen::Map<const Eigen::VectorXd> direction(s.direction.data(), Eigen::Index(s.direction.size()));
  return stacked({hats, direction.asDiagonal() * hats});
}

/// The orders of the position that hold most of the residual of these samples.
std::vector<double> orders_of(const Samples& s, const std::vector<Eigen::Index>& rows, double cutoff,
                              std::size_t count) {
  constexpr double kLargest = 4000;  // choice (time): 1/rad
  signal::OrderSamples samples;
  for (const Eigen::Index row : rows) {
    const auto k = std::size_t(row);
    samples.value.push_back(s.residual[k]);
    samples.position.push_back(s.position[k]);
    samples.carrier.push_back(1);
    samples.highest.push_back(highest_order(s.velocity[k], cutoff));
  }
  std::vector<double> orders;
  for (const signal::OrderPeak& peak :
       signal::strongest_orders(signal::order_spectrum(samples, kLargest), count))
    orders.push_back(peak.order);
  return orders;
}

Eigen::MatrixXd waves(const Samples& s, const std::vector<double>& orders) {
  Eigen::MatrixXd out(Eigen::Index(s.position.size()), 2 * Eigen::Index(orders.size()));
  for (std::size_t i = 0; i < orders.size(); ++i)
    for (std::size_t k = 0; k < s.position.size(); ++k) {
      out(Eigen::Index(k), 2 * Eigen::Index(i)) = std::cos(orders[i] * s.position[k]);
      out(Eigen::Index(k), 2 * Eigen::Index(i) + 1) = std::sin(orders[i] * s.position[k]);
    }
  return out;
}

/// Of thousands of orders one always fits noise well: so they are chosen in every other block, and the others
/// judge them.
signal::PredictedShare share_of_waves(const Samples& s, const Eigen::VectorXd& y, double cutoff,
                                      std::size_t count) {
  std::vector<Eigen::Index> halves[2];
  for (std::size_t k = 0; k < s.block.size(); ++k) halves[s.block[k] % 2].push_back(Eigen::Index(k));
  signal::PredictedShare mean;
  for (int half = 0; half < 2; ++half) {
    const std::vector<Eigen::Index>& rows = halves[1 - half];
    const Eigen::MatrixXd features = waves(s, orders_of(s, halves[half], cutoff, count));
    std::vector<int> block;
    for (const Eigen::Index row : rows) block.push_back(s.block[std::size_t(row)] / 2);
    const signal::PredictedShare share = signal::predicted_share(features(rows, Eigen::all), y(rows), block);
    mean.value += 0.5 * share.value, mean.lower += 0.5 * share.lower, mean.upper += 0.5 * share.upper;
    mean.chance = std::max(mean.chance, share.chance);
  }
  return mean;
}

Eigen::MatrixXd of_time(const Samples& s, int knots) {
  std::vector<Eigen::MatrixXd> parts;
  for (const std::vector<double>& time : s.time) {
    Eigen::MatrixXd hats = signal::hat_functions(time, knots);
    for (std::size_t k = 0; k < time.size(); ++k)
      if (time[k] < 0) hats.row(Eigen::Index(k)).setZero();
    parts.push_back(hats);
  }
  const Eigen::MatrixXd all = stacked(parts);
  const Eigen::Map<const Eigen::VectorXd> direction(s.direction.data(), Eigen::Index(s.direction.size()));
  return stacked({all, direction.asDiagonal() * all});
}

/// Functions of two states.
Eigen::MatrixXd pairs(const Samples& s, int knots) {
  const Eigen::MatrixXd q = signal::hat_functions(s.position, knots),
                        v = signal::hat_functions(s.velocity, knots),
                        a = signal::hat_functions(s.acceleration, knots),
                        t = signal::hat_functions(s.transmitted, knots);
  return stacked({signal::row_products(q, v), signal::row_products(v, a), signal::row_products(v, t)});
}

double unevenness(const std::vector<double>& residual) {
  double parts[kParts] = {}, sum = 0;
  for (std::size_t k = 0; k < residual.size(); ++k) {
    parts[kParts * k / residual.size()] += residual[k] * residual[k];
    sum += residual[k] * residual[k];
  }
  return sum > 0 ? *std::max_element(parts, parts + kParts) * kParts / sum : 0;
}

double root_mean_square(const std::vector<double>& x) {
  return std::sqrt(std::inner_product(x.begin(), x.end(), x.begin(), 0.0) /
                   std::max<double>(1, double(x.size())));
}

double deviation(const std::vector<double>& x) {
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / std::max<double>(1, double(x.size()));
  std::vector<double> y = x;
  for (double& value : y) value -= mean;
  return root_mean_square(y);
}

}  // namespace

double repeated_noise(const Predicted& record, bool deflection) {
  const auto lag = signal::repetition(record.data->motor);
  if (!lag) return 0;
  const ServoPrediction& p = record.prediction;
  std::vector<double> left = deflection ? p.measured_deflection : p.measured_torque;
  const std::vector<double>& predicted = deflection ? p.deflection : p.torque;
  for (std::size_t k = 0; k < left.size(); ++k) left[k] -= predicted[k];
  return signal::repeated_noise(left, deflection ? p.settled : p.counts, *lag);
}

Remainder remainder(const std::vector<Predicted>& records, bool deflection, double cutoff,
                    const ExplainableSettings& settings) {
  const Samples s = samples(records, deflection, cutoff, settings);
  Remainder out;
  if (s.residual.empty()) return out;
  out.rms = root_mean_square(s.residual);
  out.signal = deviation(s.measured);
  out.floor = std::sqrt(s.floor / double(s.residual.size()));
  if (s.residual.size() < settings.least_samples) return out;  // how much is left they say all the same
  out.unevenness = unevenness(s.residual);
  const Eigen::VectorXd y =
      Eigen::Map<const Eigen::VectorXd>(s.residual.data(), Eigen::Index(s.residual.size()));
  std::vector<std::pair<std::string, Eigen::MatrixXd>> states;
  states.emplace_back("motor position", with_direction(s.position, s, settings.knots));
  states.emplace_back("motor velocity", signal::hat_functions(s.velocity, settings.knots));
  states.emplace_back("motor acceleration", with_direction(s.acceleration, s, settings.knots));
  states.emplace_back("transmitted torque", with_direction(s.transmitted, s, settings.knots));
  states.emplace_back("path since the last reversal", with_direction(s.path, s, settings.knots));
  states.emplace_back("time", of_time(s, settings.knots_of_time));
  std::vector<Eigen::MatrixXd> all;
  for (auto& [name, features] : states) {
    out.follows.push_back({name, signal::predicted_share(features, y, s.block)});
    all.push_back(features);
  }
  const signal::PredictedShare of_waves = share_of_waves(s, y, cutoff, settings.orders);
  if (of_waves.lower > 0 && of_waves.value > of_waves.chance) {
    std::vector<Eigen::Index> rows(s.block.size());
    std::iota(rows.begin(), rows.end(), 0);
    const std::vector<double> orders = orders_of(s, rows, cutoff, settings.orders);
    out.follows.push_back({fmt::format("order {:.4g} of the motor position", orders.at(0)), of_waves});
    all.push_back(waves(s, orders));
  }
  all.push_back(pairs(s, settings.knots_of_pair));
  out.explainable = signal::predicted_share(stacked(all), y, s.block);
  std::stable_sort(out.follows.begin(), out.follows.end(),
                   [](const Follows& a, const Follows& b) { return a.share.value > b.share.value; });
  if (out.follows.front().share.lower > out.explainable.lower) out.explainable = out.follows.front().share;
  return out;
}

}  // namespace backlash::identification
