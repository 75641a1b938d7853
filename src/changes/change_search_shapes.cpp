// SPDX-License-Identifier: BSD-3-Clause
// The part of the search for changes that finds faults at one place, and effects with a speed or way that is
// fitted.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/axis_unit.h"
#include "change_search.h"

namespace backlash::changes {
namespace {

constexpr double kScreened = 0.5;  // - of the threshold, of what is looked at closer. Choice: bumps that the
                                   // filter broadens, and nuisances, make a matched filter miss a part
constexpr double kFactors[] = {1.3, 1.1, 1.03};  // of a scale, then finer ones. Choice
constexpr double kSlope = 0.1;                   // - of a scale, of a difference over it. Choice
constexpr int kRounds = 8;                       // of Gauss-Newton. Simulation: 3 to 5 do
constexpr double kStep = 0.5;                    // widths that one of them goes at most. Choice
constexpr double kBetter = 1e-3;                 // - of the gain, by which another round is worth it. Choice
constexpr double kShape = 0.1;  // - standard error of A and width, as bumps have other shapes. Theory: the
                                // bump that fits a flat one best is sqrt(2) erf(0.97) = 1.17 times as high
constexpr double kOthers =
    0.25;  // - of the gain that another place may have: more is no fault of one. Choice

}  // namespace

/// The likeliest fault of one place, if passes show it.
std::optional<FoundChange> ChangeSearch::best_fault(const Background& b) const {
  std::optional<FoundChange> best;
  const double least = threshold(2);
  for (const ChangeEffect& e : screen_.likeliest(b.left(), b.variance, settings_.margin, kScreened * least)) {
    FoundChange f = scanned(e, b, 5);
    if (f.score.values.size() > 0 && (!best || f.score.gain > best->score.gain)) best = f;
  }
  if (!best) return best;
  refine_fault(*best, b);
  best->inflation = scores_.inflation(best->effect);
  best->gain = best->score.gain / best->inflation;
  if (!repeats(*best, b)) best.reset();
  return best;
}

void ChangeSearch::refine_fault(FoundChange& f, const Background& b) const {
  const ChangeChannel channel = motion_.sampling.channel;
  for (int round = 0; round < kRounds; ++round) {
    const EffectSums::Score whole =
        score_of(*effect_columns(motion_, fault_with_slopes(channel, f.effect, f.score.values)), f, b);
    if (whole.values.size() == 0) return;
    const double before = f.score.gain, width = f.effect.width;
    for (const double share : {1.0, 0.3}) {
      const double most = kStep * width;
      const double place = f.effect.shape + share * std::clamp(whole.values[2], -most, most);
      const double wide = std::clamp(width + share * std::clamp(whole.values[3], -most, most),
                                     screen_.narrowest(), screen_.widest());
      if (take_better(f, local_fault(channel, place, wide), 1, b)) break;
    }
    if (f.score.gain < (1 + kBetter) * before) return;
  }
}

void ChangeSearch::refine_scale(FoundChange& f, const Background& b) const {
  for (const double factor : kFactors)
    for (const double by : {factor, 1 / factor})
      for (int i = 0; i < 3; ++i) {
        ChangeEffect e = f.effect;
        e.shape *= by;
        if (!take_better(f, e, 1, b)) break;
      }
}

/// Columns for a slip or a delay of that size: gravity, or torque over time, is no straight line.
void ChangeSearch::refine_size(FoundChange& f, const Background& b) const {
  if (!f.effect.of_size) return;
  for (int round = 0; round < kRounds && f.score.values.size() > 0; ++round) {
    ChangeEffect e = f.effect;
    e.shape = f.score.values[0];
    if (!take_better(f, e, 1 + kBetter, b)) return;
  }
}

/// With an unknown scale: its slope is one more column.
std::vector<ChangeSize> ChangeSearch::scaled_size(const FoundChange& f, const Background& b, double noisier,
                                                  bool linear) const {
  ChangeEffect more = f.effect, less = f.effect;
  more.shape *= 1 + kSlope;
  less.shape *= 1 - kSlope;
  const Eigen::VectorXd z = *effect_columns(motion_, f.effect);
  Eigen::MatrixXd both(z.size(), 2);
  both << z,
      f.score.values[0] / (2 * kSlope) * (*effect_columns(motion_, more) - *effect_columns(motion_, less));
  const EffectSums::Score s = score_of(both, f, b);
  Eigen::Matrix2d covariance = Eigen::Vector2d(f.score.values.squaredNorm(), 1).asDiagonal();  // not known
  if (s.values.size() == 2) covariance = s.covariance * f.inflation * std::max(1.0, noisier);
  covariance(0, 0) += std::pow(settings_.model_error * f.score.values[0], 2);
  std::vector<ChangeSize> size =
      change_size(f.effect, f.score.values, covariance.topLeftCorner<1, 1>(), linear);
  const ParameterSpec scale = *model::searched_shape(*f.effect.type);
  size.push_back({scale.name,
                  model::axis_unit(scale.unit, linear),
                  {f.effect.shape, f.effect.shape * std::min(1.0, std::sqrt(covariance(1, 1)))}});
  return size;
}

/// Passes show it even without the one that shows most: a push is at one place as well.
bool ChangeSearch::repeats(const FoundChange& f, const Background& b) const {
  const double from = settings_.block * double(f.from), to = settings_.block * double(f.to);
  return f.effect.width < screen_.widest() &&
         repeated_gain(motion_, f.effect, b.left(), from, to) > threshold(2);
}

/// A wave that no effect has shows at several places.
bool ChangeSearch::alone(const FoundChange& f, const Background& b) const {
  const double from = settings_.block * double(f.from), to = settings_.block * double(f.to);
  const double other = screen_.elsewhere(f.effect, left_with(f, b), b.variance, from, to);
  return other / f.inflation < std::max(kOthers * f.gain, kScreened * threshold(2));
}

/// Squares of what is left where the fault shows, and how many rows those are.
double ChangeSearch::left_at(const FoundChange& f, const Eigen::VectorXd& left, double& rows) const {
  double squares = 0;
  rows = 0;
  for (Eigen::Index r = 0; r < motion_.size(); ++r) {
    const double t = motion_.time(r);
    if (t < settings_.block * double(f.from) || t >= settings_.block * double(f.to)) continue;
    if (!shows_fault(f.effect, motion_.moment(r))) continue;
    squares += left[r] * left[r];
    ++rows;
  }
  return squares;
}

std::vector<ChangeSize> ChangeSearch::fault_size(const FoundChange& f, const Background& b,
                                                 const Eigen::VectorXd& left, bool linear) const {
  const ChangeChannel channel = motion_.sampling.channel;
  const ChangeEffect with = fault_with_slopes(channel, f.effect, f.score.values);
  const EffectSums::Score whole = score_of(*effect_columns(motion_, with), f, b);
  double rows = 0;
  const double squares = left_at(f, left, rows), noisier = std::max(1.0, squares / rows / b.variance);
  const double model[] = {f.score.values.norm(), f.score.values.norm(), f.effect.width, f.effect.width};
  const auto error = [&](Eigen::Index i) {
    const double own = kShape * model[i];
    if (whole.values.size() == 0) return model[i];  // the record does not determine place and width
    return std::sqrt(whole.covariance(i, i) * f.inflation * noisier + own * own);
  };
  const std::string unit = model::axis_unit(channel == ChangeChannel::torque ? "N m" : "rad", linear);
  const std::string length = model::axis_unit("rad", linear);
  return {{"forward", unit, {f.score.values[0], error(0)}},
          {"backward", unit, {f.score.values[1], error(1)}},
          {"position", length, {f.effect.shape, error(2)}},
          {"width", length, {f.effect.width, error(3)}}};
}

}  // namespace backlash::changes
