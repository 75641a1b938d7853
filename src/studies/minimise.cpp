// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/minimise.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/base/random.h"

namespace backlash::studies {
namespace {

using Point = std::vector<double>;
using Function = std::function<double(const Point&)>;

constexpr double kBestShare = 0.15, kCrossover = 0.9, kLeastStep = 0.4, kMostStep = 0.9;

std::vector<Point> latin_hypercube(std::size_t count, std::size_t dimensions, Random& random) {
  std::vector<Point> points(count, Point(dimensions));
  std::vector<std::size_t> cell(count);
  for (std::size_t d = 0; d < dimensions; ++d) {
    std::iota(cell.begin(), cell.end(), 0);
    for (std::size_t i = count; i > 1; --i) std::swap(cell[i - 1], cell[random.below(i)]);
    for (std::size_t i = 0; i < count; ++i)
      points[i][d] = (static_cast<double>(cell[i]) + random.uniform()) / static_cast<double>(count);
  }
  return points;
}

/// Values of many points, worked on by several threads.
class Evaluator {
 public:
  Evaluator(const Function& function, unsigned threads, long budget, const Progress& progress)
      : function_(function), threads_(threads), budget_(budget), progress_(progress) {}

  std::vector<double> operator()(const std::vector<Point>& points) {
    std::vector<double> values(points.size());
    for_each_in_parallel(
        static_cast<int>(points.size()),
        [&](int i) {
          const double value = function_(points[i]);
          values[i] = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
          tick(values[i]);
        },
        threads_);
    return values;
  }

  long done() const { return done_; }

 private:
  void tick(double value) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stop_) throw Cancelled();
    ++done_;
    best_ = std::min(best_, value);
    if (!progress_) return;
    const double share = std::min(1.0, static_cast<double>(done_) / static_cast<double>(budget_));
    if (progress_(share, fmt::format("{} of {}, best {:.6g}", done_, budget_, best_))) return;
    stop_ = true;  // nobody is asked once more
    throw Cancelled();
  }

  const Function& function_;
  unsigned threads_;
  long budget_, done_ = 0;
  const Progress& progress_;
  double best_ = std::numeric_limits<double>::infinity();
  std::mutex mutex_;
  bool stop_ = false;
};

/// One trial for every member; `order` lists the members from the best on.
std::vector<Point> trials(const std::vector<Point>& members, const std::vector<std::size_t>& order,
                          Random& random) {
  const std::size_t count = members.size(), dimensions = members.front().size();
  const std::size_t elite = std::max<std::size_t>(1, std::lround(kBestShare * static_cast<double>(count)));
  std::vector<Point> result = members;
  for (std::size_t i = 0; i < count; ++i) {
    const Point& best = members[order[random.below(elite)]];
    std::size_t first = i, second = i;
    while (first == i) first = random.below(count);
    while (second == i || second == first) second = random.below(count);
    const double step = kLeastStep + (kMostStep - kLeastStep) * random.uniform();
    const std::size_t always = random.below(dimensions);
    for (std::size_t d = 0; d < dimensions; ++d) {
      const bool moves = random.uniform() < kCrossover || d == always;
      if (!moves) continue;
      const double old = members[i][d];
      const double moved = old + step * (best[d] - old) + step * (members[first][d] - members[second][d]);
      result[i][d] = moved < 0 ? 0.5 * old : moved > 1 ? 0.5 * (old + 1) : moved;
    }
  }
  return result;
}

void check(std::size_t dimensions, const MinimiseSettings& settings) {
  if (dimensions < 1) throw InvalidParameter("dimensions", 0, "must be >= 1");
  if (settings.population < 4) throw InvalidParameter("population", settings.population, "must be >= 4");
  if (settings.budget < settings.population)
    throw InvalidParameter("budget", settings.budget, "must be >= the population");
}

}  // namespace

MinimiseResult minimise(const Function& function, std::size_t dimensions, const MinimiseSettings& settings,
                        const Progress& progress) {
  check(dimensions, settings);
  Random random(settings.seed);
  Evaluator evaluate(function, settings.threads, settings.budget, progress);
  const auto count = static_cast<std::size_t>(settings.population);
  std::vector<Point> members = latin_hypercube(count, dimensions, random);
  std::vector<double> values = evaluate(members);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  MinimiseResult result;
  for (;;) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    result.history.push_back({evaluate.done(), values[order.front()]});
    if (values[order.front()] <= settings.goal || evaluate.done() + settings.population > settings.budget)
      break;
    const std::vector<Point> next = trials(members, order, random);
    const std::vector<double> tried = evaluate(next);
    for (std::size_t i = 0; i < count; ++i)
      if (tried[i] <= values[i]) {
        members[i] = next[i];
        values[i] = tried[i];
      }
  }
  result.x = members[order.front()];
  result.value = values[order.front()];
  result.evaluations = evaluate.done();
  return result;
}

}  // namespace backlash::studies
