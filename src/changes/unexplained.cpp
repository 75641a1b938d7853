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
      // A push is over within two windows; the others must be loud by themselves.
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

}  // namespace backlash::changes
