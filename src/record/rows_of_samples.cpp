// SPDX-License-Identifier: BSD-3-Clause
// The likeliest rows of samples whose stamps jitter and of which some are lost, by Viterbi's method (1967):
// of all ways to count that lead to a row the one whose stamps are off the least is kept.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "sample_grid.h"

namespace backlash::record {
namespace {

constexpr double kLeastJitter = 0.02;  // of an interval: choice
constexpr double kOutlier = 25;     // squares of jitter: theory, no stamp is off by more than five by chance
constexpr double kLossCost = 10.6;  // theory: -2 ln(1/200), one sample of 200 is lost
constexpr double kHopeless = 100;   // cost beyond the best, from which no way comes back: four outliers
// Theory: a clock is followed within ten samples, critically damped (Kalata 1984), so that a jitter of a
// fifth leaves 0.05 of an interval of its phase.
constexpr double kFollow = 0.1, kFollowRate = kFollow * kFollow / 4;
constexpr double kMostFollowed = 0.5;  // intervals: choice
constexpr double kShortest = 0.1;      // median intervals: choice
constexpr double kShort = 1.25;        // theory: half of what a lost sample adds to two intervals
constexpr int kPairPasses = 3;         // choice: under jitter of a fifth one hundredth is left of the bias

/// A way to count up to a sample.
struct Count {
  std::size_t row = 0;
  double cost = 0;
  double expected = 0,
         interval = 1;     // of the next sample's stamp, and from one to the next: median intervals
  std::size_t before = 0;  // which count of the sample before it comes from
};

/// The way `from`, with its next sample at `time` [median intervals] so many rows on.
Count extended(const Count& from, std::size_t which, double time, std::size_t rows, double jitter) {
  const double off = time - (from.expected + double(rows - 1) * from.interval);
  Count to;
  to.row = from.row + rows, to.before = which;
  if (rows > kForgotten) {
    to.cost = from.cost + kLossCost + off * off;
    to.interval = from.interval, to.expected = time + to.interval;
    return to;
  }
  const double followed = std::clamp(off, -kMostFollowed, kMostFollowed);
  to.cost = from.cost + std::min(kOutlier, std::pow(off / jitter, 2)) + (rows > 1 ? kLossCost : 0);
  const bool near = followed == off;  // what is further off says nothing of the rate
  to.interval = std::max(kShortest, from.interval + (near ? kFollowRate * off : 0));
  to.expected = time - off + kFollow * followed + to.interval;
  return to;
}

std::vector<Count> next_counts(const std::vector<Count>& counts, double time, double jitter) {
  std::vector<Count> next;
  const auto add = [&](const Count& count) {
    const auto same =
        std::find_if(next.begin(), next.end(), [&](const Count& c) { return c.row == count.row; });
    if (same == next.end())
      next.push_back(count);
    else if (count.cost < same->cost)
      *same = count;
  };
  for (std::size_t c = 0; c < counts.size(); ++c) {
    add(extended(counts[c], c, time, 1, jitter));
    const double rows = 1 + std::floor((time - counts[c].expected) / counts[c].interval);
    for (const double each : {rows, rows + 1})
      if (each > 1) add(extended(counts[c], c, time, std::size_t(each), jitter));
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Count& count : next) least = std::min(least, count.cost);
  next.erase(
      std::remove_if(next.begin(), next.end(), [&](const Count& c) { return c.cost > least + kHopeless; }),
      next.end());
  return next;
}

double jitter_of(const std::vector<double>& time, double interval) {
  std::vector<double> off;
  for (std::size_t i = 0; i + 1 < time.size(); ++i)
    off.push_back(std::fabs((time[i + 1] - time[i]) / interval - 1) / std::sqrt(2.0));
  return std::max(kLeastJitter,
                  off.empty() ? 0 : signal::kNormalPerMedianDeviation * signal::median(std::move(off)));
}

/// In intervals, over two: where early and late samples take turns the median of one is that of either. Where
/// many samples are lost the short ones count.
double usual_interval(const std::vector<double>& time, double interval) {
  std::vector<double> pairs;
  for (std::size_t i = 0; i + 2 < time.size(); ++i) pairs.push_back((time[i + 2] - time[i]) / (2 * interval));
  if (pairs.empty()) return 1;
  double usual = signal::quantile(pairs, 0.25);
  for (int pass = 0; pass < kPairPasses; ++pass) {
    std::vector<double> of_two;
    std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(of_two),
                 [&](double pair) { return pair <= kShort * usual; });
    usual = signal::median(std::move(of_two));
  }
  return usual;
}

}  // namespace

std::vector<std::size_t> rows_of_samples(const std::vector<double>& time, double interval) {
  if (time.empty()) return {};
  const double jitter = jitter_of(time, interval);
  std::vector<std::vector<Count>> counts(time.size());
  const double usual = usual_interval(time, interval);
  counts[0] = {{0, 0, usual, usual, 0}};
  for (std::size_t i = 1; i < time.size(); ++i)
    counts[i] = next_counts(counts[i - 1], (time[i] - time[0]) / interval, jitter);
  const std::vector<Count>& last = counts.back();
  auto which = std::size_t(std::min_element(last.begin(), last.end(),
                                            [](const Count& a, const Count& b) { return a.cost < b.cost; }) -
                           last.begin());
  std::vector<std::size_t> rows(time.size());
  for (std::size_t i = time.size(); i-- > 0; which = counts[i][which].before) rows[i] = counts[i][which].row;
  return rows;
}

}  // namespace backlash::record
