// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/gap_waves.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <numeric>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "gap_cells.h"

namespace backlash::identification {
namespace {

constexpr double kTurn = 2 * M_PI;
constexpr double kLeastTurns = 1.02;   // theory: a turn and some of it twice, else whole orders say it all
constexpr double kCellsPerWave = 6;    // choice: of the highest order
constexpr std::size_t kMostWaves = 8;  // choice
constexpr int kMultiples = 3;          // choice: k, harmonics of the pinion
constexpr int kSides = 2;              // choice: n, to either side
constexpr double kPerLine = 3;         // theory: trial orders per line of the spectrum, 1 / turns
constexpr double kSame = 3;            // theory: standard errors
constexpr double kScale = 1e-3;        // choice: of the order, as far as an encoder's scale may be off
constexpr double kBeside = 1e-6;       // choice: share of a wave beside the whole orders, to know it by
constexpr double kWhole = 0.02;        // choice: orders so near a whole one are the load's

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

MatrixXd columns(const GapCells& cells, const MatrixXd& base, const std::vector<Trial>& waves) {
  const Index per = columns_per_wave(cells);
  MatrixXd a(base.rows(), base.cols() + per * Index(waves.size()));
  a.leftCols(base.cols()) = base;
  for (std::size_t k = 0; k < waves.size(); ++k)
    put_wave(cells, waves[k].order, a, base.cols() + per * Index(k));
  return a;
}

/// P(F > f); 1 where there is too little to judge by.
double f_tail(double f, double of_wave, double freedom) {
  if (!(f > 0) || !(freedom > 2)) return 1;
  return cdf(complement(boost::math::fisher_f(of_wave, freedom), std::min(f, 1e100)));
}

/// What is left of the values beside some columns, and by how much less a further order leaves.
class RestBeside {
 public:
  RestBeside(const GapCells& cells, const MatrixXd& a) : cells_(cells) {
    q_ = signal::orthonormal_basis(a);
    left_ = beside(cells.value);
    correlation_ = signal::correlation_length({left_.begin(), left_.end()});
  }
  double sum() const { return left_.squaredNorm(); }

  double gain(double order) const {
    MatrixXd wave(cells_.place.size(), columns_per_wave(cells_));
    put_wave(cells_, order, wave, 0);
    wave.colwise().normalize();
    wave = beside(wave);
    const MatrixXd gram = signal::gram(wave);
    if (!(signal::symmetric_eigenvalues(gram)[0] > kBeside)) return 0;
    const VectorXd along = wave.transpose() * left_;
    return along.dot(signal::solve_symmetric(gram, along).col(0));
  }

  /// Chance of this gain by noise alone, with `tried` orders.
  double chance(double gain, double tried) const {
    const double per = double(columns_per_wave(cells_));
    const double rows = cells_.freedom() - double(q_.cols()) - per - 1;
    const double variance = std::max(sum() - gain, 1e-300) / rows;
    return std::min(1.0, tried * f_tail(gain / (per * variance * correlation_), per, rows / correlation_));
  }

 private:
  template <typename Matrix>
  Matrix beside(const Matrix& m) const {
    return m - q_ * (q_.transpose() * m);
  }
  const GapCells& cells_;
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
  Search(const GapCells& cells, const GapWaveSettings& settings)
      : cells_(cells),
        turns_(cells.turns),
        settings_(settings),
        base_(base_columns(cells, whole_orders(settings))),
        per_(columns_per_wave(cells)),
        declared_(orders_of(settings.drive, settings.highest_order)) {}

  /// Orders that the two runs do not show alike.
  const std::vector<double>& doubtful() const { return doubtful_; }

  std::vector<GapWave> run() {
    while (waves_.size() < kMostWaves && (add(declared()) || add(free()))) {
    }
    return found();
  }

 private:
  RestBeside left(const std::vector<Trial>& waves) const { return {cells_, columns(cells_, base_, waves)}; }

  /// By a wave that the runs cannot distinguish from this order.
  bool taken(double order) const {
    return std::any_of(waves_.begin(), waves_.end(),
                       [&](const Trial& w) { return std::fabs(w.order - order) < 0.5 / turns_; });
  }

  /// The best of the drive's orders that are left.
  std::optional<Trial> declared() const {
    const RestBeside rest = left(waves_);
    std::optional<Trial> best;
    double most = 0;
    for (const Trial& t : declared_) {
      const double gain = taken(t.order) ? 0 : rest.gain(t.order);
      if (gain > most) most = gain, best = t;
    }
    if (best) best->chance = rest.chance(most, double(declared_.size()));
    return best;
  }

  /// The best of all orders, whole ones of the load left out.
  std::optional<Trial> free() const {
    const RestBeside rest = left(waves_);
    const double step = 1 / (kPerLine * turns_);
    double best = 0, most = 0;
    for (double order = 1; order <= settings_.highest_order; order += step) {
      const double gain = taken(order) ? 0 : rest.gain(order);
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
    try {
      if (!trial->free) doubt_declared();
      const signal::Measured order = found_in(fitted(), waves_.size() - 1).order;
      // A free order that may be a whole one is the load's: the map over its turn has it.
      const double off = std::fabs(order.value - std::round(order.value));
      if (!waves_.back().free || off > std::max(kWhole, kSame * order.standard_error)) return true;
    } catch (const CannotIdentify&) {
    }
    waves_.pop_back();
    return false;
  }

  /// Whether the record says that the last wave, of the drive, has another order: then that, without a name.
  void doubt_declared() {
    const Trial named = waves_.back();
    waves_.back().free = true;
    const signal::Measured order = found_in(fitted(), waves_.size() - 1).order;
    if (!(std::fabs(order.value - named.order) >
          std::max(kSame * order.standard_error, kScale * named.order)))
      waves_.back() = named;
    else
      waves_.back().pinion = waves_.back().load = 0;
  }

  /// Derivative of the values over the order of the wave, from its columns in `a` and their sizes.
  VectorXd slope_over_order(const MatrixXd& a, const VectorXd& size, std::size_t wave) const {
    Eigen::ArrayXd slope = Eigen::ArrayXd::Zero(a.rows());
    for (Index c = base_.cols() + per_ * Index(wave), end = c + per_; c < end; c += 2)
      slope += size[c] * a.col(c + 1).array() - size[c + 1] * a.col(c).array();
    return (cells_.place.array() - cells_.place.mean()) * slope;
  }

  /// Of runs apart, whether both show the wave with one order: gap and centre line with orders of their own,
  /// so near that they look like one, would each spoil the other.
  bool runs_agree(std::size_t wave) const {
    if (!cells_.apart) return true;
    MatrixXd a = columns(cells_, base_, waves_);
    const VectorXd size = signal::solve_least_squares(a, cells_.value).x,
                   slope = slope_over_order(a, size, wave);
    const Index linear = a.cols();
    a.conservativeResize(Eigen::NoChange, linear + 2);
    a.col(linear) = slope;
    a.col(linear + 1) = 2 * cells_.share.array() * slope.array();
    const signal::Measured apart = signal::fit_linear(a, cells_.value).parameter(linear + 1);
    return std::fabs(apart.value) <= kSame * std::sqrt(correlation_) * apart.standard_error;
  }

  /// All waves, and the slope over each free order; refines those.
  signal::LeastSquaresFit fitted() {
    signal::LeastSquaresFit fit;
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
      MatrixXd a = columns(cells_, base_, waves_);
      const Index linear = a.cols();
      std::vector<std::size_t> free;
      for (std::size_t k = 0; k < waves_.size(); ++k)
        if (waves_[k].free) free.push_back(k);
      const VectorXd size = signal::solve_least_squares(a, cells_.value).x;
      a.conservativeResize(Eigen::NoChange, linear + Index(free.size()));
      for (std::size_t i = 0; i < free.size(); ++i) {
        a.col(linear + Index(i)) = slope_over_order(a, size, free[i]);
      }
      fit = signal::fit_linear(a, cells_.value);
      correlation_ = signal::correlation_length({fit.residuals.begin(), fit.residuals.end()});
      fit.covariance *= correlation_;
      if (round == kRounds - 1) break;
      for (std::size_t i = 0; i < free.size(); ++i)
        waves_[free[i]].order += std::clamp(fit.values[linear + Index(i)], -0.3 / turns_, 0.3 / turns_);
    }
    return fit;
  }

  GapWave found_in(const signal::LeastSquaresFit& fit, std::size_t k) const {
    const Index at = base_.cols() + per_ * Index(k);
    Index slope = base_.cols() + per_ * Index(waves_.size());
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
    if (!cells_.apart) return w;  // else the gap's part of it
    const Eigen::Vector2d both(s, c);
    const double freedom = (cells_.freedom() - double(fit.values.size())) / correlation_;
    w.chance = std::max(w.chance, f_tail(0.5 * both.dot(covariance.inverse() * both), 2, freedom));
    return w;
  }

  std::vector<GapWave> found() {
    std::vector<GapWave> all;
    if (waves_.empty()) return all;
    const signal::LeastSquaresFit fit = fitted();
    for (std::size_t k = 0; k < waves_.size(); ++k) {
      const GapWave wave = found_in(fit, k);
      if (wave.chance > settings_.false_alarm || !(wave.amplitude.value > settings_.least_amplitude))
        continue;
      if (runs_agree(k))
        all.push_back(wave);
      else
        doubtful_.push_back(wave.order.value);
    }
    std::sort(all.begin(), all.end(),
              [](const GapWave& a, const GapWave& b) { return a.order.value < b.order.value; });
    return all;
  }

  const GapCells& cells_;
  double turns_;
  GapWaveSettings settings_;
  MatrixXd base_;
  Index per_;
  std::vector<Trial> declared_, waves_;
  double correlation_ = 1;  // of the last fit
  std::vector<double> doubtful_;
};

/// Of the load, until the same teeth of the last stage meet again; 0: not declared.
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
  GapCells cells = shared_cells(forward, reverse, width);
  if (cells.turns < kLeastTurns) cells = separate_cells(forward, reverse, width);
  result.turns = cells.turns;
  const bool pinion = result.turns_to_meet > 0;
  if (result.turns < kLeastTurns) {
    if (pinion)
      result.warnings.push_back(fmt::format(
          "the runs cover {:.3g} turns of the load: what of the gap turns with the pinion needs more "
          "than {:.3g}",
          result.turns, kLeastTurns));
    return result;
  }
  Search search(cells, settings);
  result.waves = search.run();
  for (const double order : search.doubtful())
    result.warnings.push_back(fmt::format(
        "order {:.4g} turns with another part than the load; whether with the gap or the centre line "
        "alone is unknown, as the runs share no place",
        order));
  if (pinion && result.turns_to_meet > result.turns + 0.05)
    result.warnings.push_back(fmt::format(
        "the same teeth meet again after {:.4g} turns of the load, the runs share {:.3g}: the map "
        "over both gears holds there, beyond it as a series",
        result.turns_to_meet, result.turns));
  return result;
}

}  // namespace backlash::identification
