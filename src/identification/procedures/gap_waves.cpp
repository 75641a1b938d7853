// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/gap_waves.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/spectrum.h"

namespace backlash::identification {
namespace {

constexpr double kTurn = 2 * M_PI;
constexpr double kLeastTurns = 1.02;   // theory: a turn and some of it twice, else whole orders say it all
constexpr double kCellsPerWave = 6;    // choice: of the highest order
constexpr int kLeastSamples = 3;       // choice: per cell and run
constexpr double kLopsided = 0.25;     // choice: of a cell, between the mean places of both runs
constexpr std::size_t kMostWaves = 8;  // choice
constexpr int kMultiples = 3;          // choice: k, harmonics of the pinion
constexpr int kSides = 2;              // choice: n, to either side
constexpr double kPerLine = 3;         // theory: trial orders per line of the spectrum, 1 / turns
constexpr double kSame = 3;            // theory: standard errors
constexpr double kScale = 1e-3;        // choice: of the order, as far as an encoder's scale may be off
constexpr double kWhole = 0.02;        // choice: orders so near a whole one are the load's

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Separation of the flanks over places that both runs visited.
struct Cells {
  VectorXd place, separation;  // rad
  double width = 0;            // rad
};

struct Mean {
  double load = 0, difference = 0;
  int count = 0;
};

std::map<long, Mean> means_of(const GapRun& run, double width) {
  std::map<long, Mean> means;
  for (std::size_t i = 0; i < run.load.size(); ++i) {
    Mean& m = means[std::lround(run.load[i] / width)];
    m.load += run.load[i], m.difference += run.difference[i], ++m.count;
  }
  return means;
}

Cells cells_of(const GapRun& forward, const GapRun& reverse, double width) {
  const std::map<long, Mean> f = means_of(forward, width), r = means_of(reverse, width);
  std::vector<double> place, separation;
  for (const auto& [cell, a] : f) {
    const auto other = r.find(cell);
    if (other == r.end() || a.count < kLeastSamples || other->second.count < kLeastSamples) continue;
    const Mean& b = other->second;
    if (std::fabs(a.load / a.count - b.load / b.count) > kLopsided * width) continue;
    place.push_back(0.5 * (a.load / a.count + b.load / b.count));
    separation.push_back(a.difference / a.count - b.difference / b.count);
  }
  return {Eigen::Map<VectorXd>(place.data(), Index(place.size())),
          Eigen::Map<VectorXd>(separation.data(), Index(separation.size())), width};
}

/// What a mean over a cell leaves of a wave.
double of_cell(double order, double width) {
  const double half = 0.5 * order * width;
  return half > 0 ? std::sin(half) / half : 1;
}

void put_wave(const Cells& cells, double order, MatrixXd& a, Index column) {
  const double shown = of_cell(order, cells.width);
  a.col(column) = shown * (order * cells.place.array()).sin();
  a.col(column + 1) = shown * (order * cells.place.array()).cos();
}

int whole_orders(const GapWaveSettings& settings) {
  return int(std::ceil(settings.highest_order));
}

/// A wave under way.
struct Trial {
  double order;
  bool free;  // its order is fitted
  int pinion = 0, load = 0;
  double chance = 1;
};

/// Mean, whole orders, waves: sine and cosine.
MatrixXd columns(const Cells& cells, int whole, const std::vector<Trial>& waves) {
  MatrixXd a(cells.place.size(), 1 + 2 * whole + 2 * Index(waves.size()));
  a.col(0).setOnes();
  for (int n = 1; n <= whole; ++n) put_wave(cells, n, a, 2 * n - 1);
  for (std::size_t k = 0; k < waves.size(); ++k)
    put_wave(cells, waves[k].order, a, 1 + 2 * whole + 2 * Index(k));
  return a;
}

/// What is left of the values beside some columns, and by how much less a further order leaves.
class Left {
 public:
  Left(const Cells& cells, const MatrixXd& a) : cells_(cells) {
    q_ = Eigen::HouseholderQR<MatrixXd>(a).householderQ() * MatrixXd::Identity(a.rows(), a.cols());
    left_ = beside(cells.separation);
    correlation_ = signal::correlation_length({left_.begin(), left_.end()});
  }
  double sum() const { return left_.squaredNorm(); }

  double gain(double order) const {
    MatrixXd wave(cells_.place.size(), 2);
    put_wave(cells_, order, wave, 0);
    const double size = wave.squaredNorm();
    wave = beside(wave);
    const Eigen::Matrix2d gram = wave.transpose() * wave;
    // Less than 1e-6 of the wave is beside the whole orders: nothing to tell it by.
    if (!(gram.determinant() > 1e-12 * size * size)) return 0;
    const Eigen::Vector2d along = wave.transpose() * left_;
    return along.dot(gram.inverse() * along);
  }

  /// Chance of this gain by noise alone, with `tried` orders.
  double chance(double gain, double tried) const {
    const double rows = double(left_.size()) - double(q_.cols()) - 3;  // order, sine, cosine
    const double freedom = rows / correlation_;
    if (!(freedom > 2) || !(gain > 0)) return 1;
    const double variance = std::max(sum() - gain, 1e-300) / rows;
    const double f = gain / (2 * variance * correlation_);
    return std::min(1.0, tried * std::pow(1 + 2 * f / freedom, -freedom / 2));
  }

 private:
  template <typename Matrix>
  Matrix beside(const Matrix& m) const {
    return m - q_ * (q_.transpose() * m);
  }
  const Cells& cells_;
  MatrixXd q_;
  VectorXd left_;
  double correlation_ = 1;
};

/// k R + n of the drive, n = 0 first.
std::vector<Trial> orders_of(const rig_file::Drive* drive, double highest) {
  std::vector<Trial> orders;
  if (!drive || drive->stages.empty()) return orders;
  const rig_file::Drive::Stage& last = drive->stages.back();
  const double ratio = double(last.driven) / double(last.driving);
  for (int side = 0; side <= kSides; ++side)
    for (int k = 1; k <= kMultiples; ++k)
      for (const int n : {side, -side}) {
        const double order = k * ratio + n;
        const bool of_load = std::fabs(order - std::round(order)) < kWhole;
        if (order > 0 && order <= highest && !of_load && (n != 0 || side == 0)) {
          orders.push_back({order, false, k, n, 1});
          if (side == 0) break;
        }
      }
  return orders;
}

class Search {
 public:
  Search(const Cells& cells, double turns, const GapWaveSettings& settings)
      : cells_(cells),
        turns_(turns),
        settings_(settings),
        whole_(whole_orders(settings)),
        told_(orders_of(settings.drive, settings.highest_order)) {}

  std::vector<GapWave> run() {
    while (waves_.size() < kMostWaves && (add(told()) || add(free()))) {
    }
    return found();
  }

 private:
  Left left(const std::vector<Trial>& waves) const { return {cells_, columns(cells_, whole_, waves)}; }

  /// The best of the drive's orders that are left.
  std::optional<Trial> told() const {
    const Left rest = left(waves_);
    std::optional<Trial> best;
    double most = 0;
    for (const Trial& t : told_) {
      const bool taken = std::any_of(waves_.begin(), waves_.end(), [&](const Trial& w) {
        return std::fabs(w.order - t.order) < 0.5 / turns_;
      });
      const double gain = taken ? 0 : rest.gain(t.order);
      if (gain > most) most = gain, best = t;
    }
    if (best) best->chance = rest.chance(most, double(told_.size()));
    return best;
  }

  /// The best of all orders, whole ones of the load left out.
  std::optional<Trial> free() const {
    const Left rest = left(waves_);
    const double step = 1 / (kPerLine * turns_);
    double best = 0, most = 0;
    for (double order = 1; order <= settings_.highest_order; order += step) {
      const double gain = rest.gain(order);
      if (gain > most) most = gain, best = order;
    }
    if (most == 0) return std::nullopt;
    for (double reach = step; reach > 1e-4 * step; reach *= 0.5)
      for (const double order : {best - 0.5 * reach, best + 0.5 * reach})
        if (const double gain = rest.gain(order); gain > most) most = gain, best = order;
    const double lines = settings_.highest_order * turns_;
    return Trial{best, true, 0, 0, rest.chance(most, kPerLine * lines)};
  }

  bool add(const std::optional<Trial>& trial) {
    if (!trial || trial->chance > settings_.false_alarm) return false;
    waves_.push_back(*trial);
    if (!trial->free) doubt_told();
    const GapWave wave = found_in(fitted(), waves_.size() - 1);
    // A free order that may be a whole one is the load's: the map over its turn has it.
    const double off = std::fabs(wave.order.value - std::round(wave.order.value));
    const bool whole = waves_.back().free && off < std::max(kWhole, kSame * wave.order.standard_error);
    if (whole || !(wave.amplitude.value > least_)) {
      waves_.pop_back();
      return false;
    }
    return true;
  }

  /// Whether the record says that the last wave, of the drive, has another order: then that, without a name.
  void doubt_told() {
    const Trial told = waves_.back();
    waves_.back().free = true;
    const signal::Measured order = found_in(fitted(), waves_.size() - 1).order;
    if (!(std::fabs(order.value - told.order) > std::max(kSame * order.standard_error, kScale * told.order)))
      waves_.back() = told;
    else
      waves_.back().pinion = waves_.back().load = 0;
  }

  /// All waves, and the slope over each free order; refines those.
  signal::LeastSquaresFit fitted() {
    signal::LeastSquaresFit fit;
    for (int turn = 0; turn < 3; ++turn) {
      MatrixXd a = columns(cells_, whole_, waves_);
      const Index first = 1 + 2 * whole_, linear = a.cols();
      std::vector<std::size_t> free;
      for (std::size_t k = 0; k < waves_.size(); ++k)
        if (waves_[k].free) free.push_back(k);
      const VectorXd size = a.colPivHouseholderQr().solve(cells_.separation);
      a.conservativeResize(Eigen::NoChange, linear + Index(free.size()));
      for (std::size_t i = 0; i < free.size(); ++i) {
        const Index at = first + 2 * Index(free[i]);
        a.col(linear + Index(i)) = (cells_.place.array() - cells_.place.mean()) *
                                   (size[at] * a.col(at + 1).array() - size[at + 1] * a.col(at).array());
      }
      fit = signal::fit_linear(a, cells_.separation);
      least_ = settings_.least_amplitude * std::fabs(fit.values[0]);
      const double root = signal::correlation_length({fit.residuals.begin(), fit.residuals.end()});
      fit.covariance *= root;
      if (turn == 2) break;
      for (std::size_t i = 0; i < free.size(); ++i)
        waves_[free[i]].order += std::clamp(fit.values[linear + Index(i)], -0.3 / turns_, 0.3 / turns_);
    }
    return fit;
  }

  GapWave found_in(const signal::LeastSquaresFit& fit, std::size_t k) const {
    const Index at = 1 + 2 * whole_ + 2 * Index(k);
    Index slope = 1 + 2 * whole_ + 2 * Index(waves_.size());
    for (std::size_t i = 0; i < k; ++i) slope += waves_[i].free;
    GapWave w;
    w.order = waves_[k].free ? fit.parameter(slope) : signal::Measured{0, 0};
    w.order.value = waves_[k].order;
    const double s = fit.values[at], c = fit.values[at + 1], size = std::hypot(s, c);
    const Eigen::Matrix2d covariance = fit.covariance.block<2, 2>(at, at);
    const Eigen::Vector2d along(s / size, c / size), across(-c / size, s / size);
    w.amplitude = {size, std::sqrt(along.dot(covariance * along))};
    w.phase = {std::atan2(c, s), std::sqrt(across.dot(covariance * across)) / size};
    // The slope is taken about the middle of the travel: at 0 an error of the order turns the phase.
    w.phase.standard_error = std::hypot(w.phase.standard_error, w.order.standard_error * cells_.place.mean());
    w.pinion = waves_[k].pinion, w.load = waves_[k].load;
    w.chance = waves_[k].chance;
    return w;
  }

  std::vector<GapWave> found() {
    std::vector<GapWave> all;
    if (waves_.empty()) return all;
    const signal::LeastSquaresFit fit = fitted();
    for (std::size_t k = 0; k < waves_.size(); ++k) all.push_back(found_in(fit, k));
    std::sort(all.begin(), all.end(),
              [](const GapWave& a, const GapWave& b) { return a.order.value < b.order.value; });
    return all;
  }

  const Cells& cells_;
  double turns_;
  GapWaveSettings settings_;
  int whole_;  // orders 1, 2, ... of the load
  std::vector<Trial> told_, waves_;
  double least_ = 0;  // rad, amplitude
};

/// Of the load, until the same teeth of the last stage meet again; 0: not told.
double turns_to_meet(const rig_file::Drive* drive) {
  if (!drive || drive->stages.empty()) return 0;
  const rig_file::Drive::Stage& last = drive->stages.back();
  return double(last.driving) / double(std::gcd(last.driving, last.driven));
}

}  // namespace

double GapWaves::at(double position) const {
  double sum = 0;
  for (const GapWave& w : waves)
    sum += w.amplitude.value * std::sin(w.order.value * position + w.phase.value);
  return sum;
}

GapWaves find_gap_waves(const GapRun& forward, const GapRun& reverse, const GapWaveSettings& settings) {
  if (!(settings.highest_order > 0))
    throw InvalidParameter("highest_order", settings.highest_order, "must be > 0");
  if (!(settings.false_alarm > 0)) throw InvalidParameter("false_alarm", settings.false_alarm, "must be > 0");
  GapWaves result;
  result.turns_to_meet = turns_to_meet(settings.drive);
  const double width = kTurn / (kCellsPerWave * settings.highest_order);
  const Cells cells = cells_of(forward, reverse, width);
  result.turns = double(cells.place.size()) * width / kTurn;
  const bool told = result.turns_to_meet > 0;
  if (result.turns < kLeastTurns ||
      cells.place.size() < 2 * (1 + 2 * whole_orders(settings) + 3 * Index(kMostWaves))) {
    if (told)
      result.warnings.push_back(
          fmt::format("both runs share {:.3g} turns of the load, each at its own place: what of the gap "
                      "turns with the pinion "
                      "needs more than {:.3g}",
                      result.turns, kLeastTurns));
    return result;
  }
  result.waves = Search(cells, result.turns, settings).run();
  if (told && result.turns_to_meet > result.turns + 0.05)
    result.warnings.push_back(fmt::format(
        "the same teeth meet again after {:.4g} turns of the load, the runs share {:.3g}: the map "
        "over both gears holds there, beyond it as a series",
        result.turns_to_meet, result.turns));
  return result;
}

}  // namespace backlash::identification
