// SPDX-License-Identifier: BSD-3-Clause
// The part of the search for changes that finds where they begin and end.
#include <algorithm>
#include <cmath>

#include "change_search.h"

namespace backlash::changes {

void ChangeSearch::refine_onset(FoundChange& f, const EffectSums& sums, const Background& b) const {
  f.score = sums.score(f.from, f.to, b);
  for (std::size_t k = margin_; k + margin_ / 2 < f.to; ++k) {
    EffectSums::Score s = sums.score(k, f.to, b);
    if (s.gain <= f.score.gain) continue;
    f.from = k;
    f.score = std::move(s);
  }
}

/// An end, where the record with it is explained clearly better.
void ChangeSearch::find_end(FoundChange& f, const Background& b) const {
  const EffectSums sums = sums_of(f, b);
  FoundChange ended = f;
  for (int round = 0; round < 3; ++round) {
    for (std::size_t k = ended.from + margin_ / 2; k + margin_ / 2 < blocks_; ++k) {
      EffectSums::Score s = sums.score(ended.from, k, b);
      if (s.gain <= ended.score.gain) continue;
      ended.to = k;
      ended.score = std::move(s);
    }
    if (ended.to == f.to) return;
    refine(ended, b);
  }
  const double more = (ended.score.gain - f.score.gain) / f.inflation;
  if (more > threshold(1) && ended.score.gain > (1 + settings_.least_beside) * f.score.gain) f = ended;
}

/// Whether it may have begun before the record did.
bool ChangeSearch::begins_before(const FoundChange& f, const Background& b) const {
  Change change;
  onset_interval(f, sums_of(f, b), b, change);
  return change.since_from <= motion_.start;
}

void ChangeSearch::onset_interval(const FoundChange& f, const EffectSums& sums, const Background& b,
                                  Change& change) const {
  double rows = 0;
  // What the shape of the effect leaves widens the interval like noise.
  const double squares = left_after(b, f.from, f.to, rows) - f.score.gain * b.variance;
  const double noisier = std::max(1.0, squares / std::max(rows, 1.0) / b.variance);
  const double drop = settings_.onset_drop * f.inflation * noisier;
  std::size_t low = f.from, high = f.from;
  for (std::size_t k = 0; k < f.to; ++k) {
    if (sums.score(k, f.to, b).gain < f.score.gain - drop) continue;
    low = std::min(low, k);
    high = std::max(high, k);
  }
  if (low <= margin_) low = 0;
  const double since = settings_.block * double(f.from);
  change.since = motion_.start + since;
  change.since_from =
      motion_.start + std::max(0.0, settings_.block * double(low) - settings_.block - settings_.onset_least);
  change.since_to = motion_.start + settings_.block * double(high) + settings_.block + settings_.onset_least;
}

/// The onset of a change whose shape leaves something, or that comes with a second, too small to be reported:
/// estimated with both together, and with one.
void ChangeSearch::onset_with_left(const FoundChange& f, const Background& b, Change& change) const {
  if (!left_by_shape_ || f.effect.ramp || left_by_shape_->effect.ramp) return;
  const double apart = std::fabs(double(left_by_shape_->from) - double(f.from)) * settings_.block;
  if (apart >= settings_.same_event) return;
  const Eigen::MatrixXd own = *effect_columns(motion_, f.effect),
                        left = *effect_columns(motion_, left_by_shape_->effect);
  Eigen::MatrixXd both(own.rows(), own.cols() + left.cols());
  both << own, left;
  const EffectSums sums(motion_, both, b, settings_.block, false);
  FoundChange together = f;
  together.inflation = std::max(f.inflation, left_by_shape_->inflation);
  together.score = {};
  refine_onset(together, sums, b);
  if (together.score.values.size() == 0) return;
  Change of_both;
  onset_interval(together, sums, b, of_both);
  change.since = of_both.since;
  change.since_from = std::min(change.since_from, of_both.since_from);
  change.since_to = std::max(change.since_to, of_both.since_to);
}

}  // namespace backlash::changes
