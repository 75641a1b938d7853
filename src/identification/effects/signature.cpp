// SPDX-License-Identifier: BSD-3-Clause
#include "signature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {
namespace {

constexpr int kBins = 24,
              kFolds = 12;  // choice: classes of a coordinate; parts of each record, for cross-validation
constexpr int kLargestOrder = 80;      // choice: of the motor position, load side
constexpr double kWorthNaming = 0.05;  // choice: of the variance
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

/// The order of the position that holds most of the residual's square, and its share.
std::pair<int, double> strongest_order(const Samples& s, const std::vector<double>& position) {
  std::pair<int, double> best{0, 0};
  const double total = std::inner_product(s.residual.begin(), s.residual.end(), s.residual.begin(), 0.0);
  for (int n = 1; n <= kLargestOrder; ++n) {
    double ss = 0, cc = 0, sc = 0, rs = 0, rc = 0;
    for (std::size_t k = 0; k < position.size(); ++k) {
      const double a = std::sin(n * position[k]), b = std::cos(n * position[k]);
      ss += a * a, cc += b * b, sc += a * b, rs += a * s.residual[k], rc += b * s.residual[k];
    }
    const double determinant = ss * cc - sc * sc;
    if (!(determinant > 0) || !(total > 0)) continue;
    const double share = (cc * rs * rs - 2 * sc * rs * rc + ss * rc * rc) / determinant / total;
    if (share > best.second) best = {n, share};
  }
  return best;
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
  const auto [order, share] = strongest_order(s, s.coordinates.front().second);
  shares.emplace_back(share, "order " + std::to_string(order) + " of the motor position");
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
