// SPDX-License-Identifier: BSD-3-Clause
#include "signature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "residual_orders.h"

namespace backlash::identification {
namespace {

constexpr int kBins = 24,
              kFolds = 12;  // choice: classes of a coordinate; parts of each record, for cross-validation
constexpr double kLargestOrder = 4000;  // choice (time): of the motor position, load side
constexpr double kWorthNaming = 0.05;   // choice: of the variance
constexpr double kWorthSaying =
    0.01;  // choice: of the signal: what is smaller lies within what any model neglects
constexpr std::size_t kMostNames = 3;  // choice

/// Residual of one channel and what it may follow, samples that count, of all records.
struct Samples {
  std::vector<double> residual;
  std::vector<int> fold;
  std::vector<std::pair<std::string, std::vector<double>>> coordinates;
  double rms = 0;
};

Samples samples(const Machine& machine, const RecordSet& records, bool deflection) {
  Samples s;
  s.coordinates = {{"motor position", {}}, {"motor velocity", {}},     {"motor acceleration", {}},
                   {"applied torque", {}}, {"transmitted torque", {}}, {"time", {}}};
  for (std::size_t i = 0; i < records.records().size(); ++i) {
    const PreparedServo& record = records.records()[i];
    const ServoData& d = record.data();
    const ServoResiduals r = record.residuals(machine.rig, machine.calibrations[i]);
    const std::vector<double>& channel = deflection ? r.deflection : r.torque;
    for (std::size_t k = 0; k < d.size(); ++k) {
      if (!(deflection ? record.settled : record.counts)[k]) continue;
      s.residual.push_back(channel[k]);
      s.fold.push_back(int(std::min<std::size_t>(kFolds - 1, kFolds * k / d.size())));
      const double values[] = {d.motor[k],  d.motor_rate[k],  d.motor_acceleration[k],
                               d.torque[k], r.mesh_torque[k], double(k) * d.interval};
      for (std::size_t c = 0; c < s.coordinates.size(); ++c) s.coordinates[c].second.push_back(values[c]);
    }
  }
  const double square = std::inner_product(s.residual.begin(), s.residual.end(), s.residual.begin(), 0.0);
  s.rms = std::sqrt(square / std::max<double>(1, double(s.residual.size())));
  return s;
}

/// Share of the residual's square that the means over classes of the coordinate predict in folds left out.
double followed(const Samples& s, const std::vector<double>& x) {
  const auto [low, high] = signal::extent(x);
  if (!(high > low)) return 0;
  std::vector<double> sum(kBins * kFolds, 0.0), count(kBins * kFolds, 0.0);
  std::vector<int> bin(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    bin[k] = std::min(kBins - 1, int(kBins * (x[k] - low) / (high - low)));
    sum[bin[k] * kFolds + s.fold[k]] += s.residual[k];
    count[bin[k] * kFolds + s.fold[k]] += 1;
  }
  std::vector<double> all(kBins, 0.0), n(kBins, 0.0);
  for (int b = 0; b < kBins; ++b)
    for (int f = 0; f < kFolds; ++f) all[b] += sum[b * kFolds + f], n[b] += count[b * kFolds + f];
  double left = 0, total = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const int at = bin[k] * kFolds + s.fold[k];
    const double others = n[bin[k]] - count[at];
    const double mean = others > 0 ? (all[bin[k]] - sum[at]) / others : 0;
    left += std::pow(s.residual[k] - mean, 2);
    total += s.residual[k] * s.residual[k];
  }
  return total > 0 ? std::max(0.0, 1 - left / total) : 0;
}

/// The order of the motor position that holds most of the residual's square; nothing where no order is seen.
std::optional<signal::OrderPeak> strongest_order(const Samples& s, double cutoff) {
  const std::vector<double>&position = s.coordinates[0].second, &speed = s.coordinates[1].second;
  signal::OrderSamples samples{s.residual, position, std::vector<double>(position.size(), 1.0), {}};
  for (const double v : speed) samples.highest.push_back(highest_order(v, cutoff));
  const auto peaks = signal::strongest_orders(signal::order_spectrum(samples, kLargestOrder), 1);
  return peaks.empty() ? std::nullopt : std::make_optional(peaks.front());
}

}  // namespace

std::optional<Unexplained> signature(const Machine& machine, const RecordSet& records, double clear) {
  Misfit left = records.misfit(machine);
  if (left.torque_share < kWorthSaying) left.torque = 0;
  if (left.deflection_share < kWorthSaying) left.deflection = 0;
  if (std::max(left.torque, left.deflection) < clear) return std::nullopt;
  const bool deflection = left.deflection > left.torque;
  const Samples s = samples(machine, records, deflection);
  std::vector<std::pair<double, std::string>> shares;
  for (const auto& [name, values] : s.coordinates) shares.emplace_back(followed(s, values), name);
  if (const auto peak = strongest_order(s, records.records().front().cutoff))
    shares.emplace_back(peak->share, fmt::format("order {:.4g} of the motor position", peak->order));
  std::stable_sort(shares.begin(), shares.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  Unexplained u{deflection ? "deflection" : "torque",
                fmt::format("{:.3g} {} rms, {:.1f} times the noise floor", s.rms,
                            model::axis_unit(deflection ? "rad" : "N m", machine.rig.linear),
                            deflection ? left.deflection : left.torque)};
  if (shares.front().first < kWorthNaming) {
    u.signature += "; follows no coordinate";
    return u;
  }
  u.signature += "; follows";
  for (std::size_t i = 0; i < kMostNames && shares[i].first >= kWorthNaming; ++i)
    u.signature += fmt::format("{} {} ({:.0f} % of its variance)", i ? "," : "", shares[i].second,
                               100 * shares[i].first);
  return u;
}

}  // namespace backlash::identification
