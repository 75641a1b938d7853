// SPDX-License-Identifier: BSD-3-Clause
#include "unexplained.h"

#include <algorithm>
#include <cmath>

namespace backlash::changes {
namespace {

struct Windows {
  std::vector<double> begin;          // s
  std::vector<double> squares, rows;  // sums before each, and of all

  double sum(std::size_t from, std::size_t to) const { return squares[to] - squares[from]; }
  double count(std::size_t from, std::size_t to) const { return rows[to] - rows[from]; }
  double sum_of(std::size_t k) const { return k < begin.size() ? sum(k, k + 1) : 0; }
  double count_of(std::size_t k) const { return k < begin.size() ? count(k, k + 1) : 0; }
  double mean_of(std::size_t k) const { return k < begin.size() ? sum_of(k) / count_of(k) : -1; }
};

Windows windows_of(const std::vector<double>& times, const std::vector<double>& squares, double length) {
  Windows w{{}, {0}, {0}};
  for (std::size_t r = 0; r < times.size(); ++r) {
    if (w.begin.empty() || times[r] - w.begin.back() >= length) {
      w.begin.push_back(times[r]);
      w.squares.push_back(w.squares.back());
      w.rows.push_back(w.rows.back());
    }
    w.squares.back() += squares[r];
    ++w.rows.back();
  }
  return w;
}

/// Sums of one value per window before each, and of their squares.
struct Sums {
  explicit Sums(const std::vector<double>& values) {
    for (const double x : values) {
      sum.push_back(sum.back() + x);
      squares.push_back(squares.back() + x * x);
    }
  }
  std::size_t size() const { return sum.size() - 1; }
  double mean(std::size_t from, std::size_t to) const { return (sum[to] - sum[from]) / double(to - from); }
  double mean_outside(std::size_t from, std::size_t to) const {
    return (sum[size()] - sum[to] + sum[from]) / double(size() - to + from);
  }
  /// Inside over outside, in standard errors.
  double difference(std::size_t from, std::size_t to) const {
    const auto in = double(to - from), out = double(size()) - in;
    const double a = mean(from, to), b = mean_outside(from, to);
    const double spread_in = (squares[to] - squares[from]) / in - a * a;
    const double spread_out = (squares[size()] - squares[to] + squares[from]) / out - b * b;
    return (a - b) / std::sqrt(std::max(spread_in / in + spread_out / out, 1e-300));
  }
  std::vector<double> sum = {0}, squares = {0};
};

std::vector<double> means_of(const Windows& w) {
  std::vector<double> means;
  for (std::size_t k = 0; k < w.begin.size(); ++k) means.push_back(w.mean_of(k));
  return means;
}

/// Without the two that are loudest.
double mean_but_two(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (std::size_t k = 0; k + 2 < values.size(); ++k) sum += values[k];
  return sum / double(values.size() - 2);
}

double log_mean(double sum, double rows) {
  return rows > 0 ? rows * std::log(std::max(sum / rows, 1e-300)) : 0;
}

}  // namespace

std::optional<LoudStretch> loud_stretch(const std::vector<double>& times, const std::vector<double>& squares,
                                        const ChangeSettings& settings) {
  const Windows w = windows_of(times, squares, settings.window);
  const std::size_t n = w.begin.size();
  const auto within = static_cast<std::size_t>(std::ceil(settings.margin / settings.window));
  std::optional<LoudStretch> best;
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t loudest = n, next = n;  // windows; n is none
    for (std::size_t j = i + 1; j <= n; ++j) {
      if (w.mean_of(j - 1) > w.mean_of(loudest)) {
        next = loudest;
        loudest = j - 1;
      } else if (w.mean_of(j - 1) > w.mean_of(next)) {
        next = j - 1;
      }
      if (j < i + settings.least_windows) continue;
      const double sum = w.sum(i, j), rows = w.count(i, j);
      const double rest = w.squares[n] - sum, rest_rows = w.rows[n] - rows;
      const double outside = std::max(1.0, rest_rows > 0 ? rest / rest_rows : 0), inside = sum / rows;
      // A push is over within two windows: without the two loudest the others must still be loud.
      const double others = (sum - w.sum_of(loudest) - w.sum_of(next)) /
                            std::max(1.0, rows - w.count_of(loudest) - w.count_of(next));
      if (std::min(inside, others) < settings.unknown_louder * outside) continue;
      const double gain = log_mean(w.squares[n], w.rows[n]) - log_mean(sum, rows) - log_mean(rest, rest_rows);
      if (best && gain <= best->gain) continue;
      best = {
          w.begin[i], j < n ? w.begin[j] : times.back(), (i < within), (j + within > n), inside, sum - rows,
          gain};
    }
  }
  return best;
}

std::optional<LoudStretch> louder_stretch(const std::vector<double>& times,
                                          const std::vector<double>& squares, const Eigen::MatrixXd& motion,
                                          const ChangeSettings& settings) {
  const Windows w = windows_of(times, squares, settings.window);
  const std::vector<double> means = means_of(w);
  const Sums loudness(means);
  const std::size_t n = means.size(), least = settings.louder_windows;
  std::size_t from = 0, to = 0;
  double most = settings.louder_errors;
  for (std::size_t i = 0; i + least <= n; ++i)
    for (std::size_t j = i + least; j <= n && n - j + i >= least; ++j) {
      const double outside = std::max(1.0, loudness.mean_outside(i, j));
      if (loudness.mean(i, j) < settings.louder * outside || loudness.difference(i, j) <= most) continue;
      const auto at = [&](std::size_t k) { return means.begin() + static_cast<std::ptrdiff_t>(k); };
      if (mean_but_two({at(i), at(j)}) < settings.louder * outside) continue;
      most = loudness.difference(i, j);
      from = i, to = j;
    }
  if (to == 0) return std::nullopt;
  for (Eigen::Index c = 0; c < motion.cols(); ++c) {
    const std::vector<double> values(motion.col(c).begin(), motion.col(c).end());
    const Sums moved(means_of(windows_of(times, values, settings.window)));
    if (std::fabs(moved.difference(from, to)) > settings.alike_errors) return std::nullopt;
  }
  const double inside = loudness.mean(from, to);
  const double end = to < n ? w.begin[to] : times.back(), excess = w.sum(from, to) - w.count(from, to);
  return LoudStretch{w.begin[from], end, from == 0, to == n, inside, excess, most};
}

}  // namespace backlash::changes
