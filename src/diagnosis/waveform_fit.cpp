// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// All choices, tried on simulated machines.
constexpr double kFirstDamping = 1e-2, kLeastDamping = 1e-9, kMostDamping = 1e5;
constexpr double kDampings[] = {30, 1, 0.03, 0.001};
constexpr double kHarder = 1e3;         // times the damping where nothing improves
constexpr double kLongestMove = 1.5;    // spreads, of a value in one step
constexpr double kEnough = 0.05;        // gain of cost below which a stage ends; 1 is a standard error
constexpr double kEnoughOfCost = 1e-5;  // the same, relative
constexpr double kFirstStep = 1e-3;     // spreads
constexpr double kStepPerError = 0.3;   // step of a difference per standard error with all else known
constexpr double kShortestStep = 1e-6, kLongestStep = 1e-2;  // spreads

}  // namespace

/// Normal equations of one window.
struct WaveformFit::Part {
  MatrixXd shared, mixed, own;
  VectorXd toward, own_toward;
  double cost = 0;
};

struct WaveformFit::Trial {
  WaveformPoint point;
  double damping;
};

WaveformFit::WaveformFit(const WaveformData& data, const WaveformPriors& priors, double common)
    : data_(data),
      priors_(priors),
      precision_(waveform_precision(priors, common)),
      steps_(VectorXd::Constant(kGlobalValues, kFirstStep)) {
  for (int k = 0; k < kGlobalValues; ++k)
    if (priors_[static_cast<std::size_t>(k)].fitted) fitted_.push_back(k);
  point.z = VectorXd::Zero(kGlobalValues);
  for (const WaveformStartGuess& guess : data.guesses) point.starts.push_back(guess.value);
}

/// The inverse of 1 + common^2 w w^T, w the symmetry in spreads (Sherman and Morrison).
MatrixXd waveform_precision(const WaveformPriors& priors, double common) {
  VectorXd w = VectorXd::Zero(kGlobalValues);
  for (int k = kHalfGap + 1; k < kGlobalValues; ++k) {
    const WaveformPrior& prior = priors[static_cast<std::size_t>(k)];
    w[k] = prior.power * common / prior.spread;
  }
  const double share = 1 / (1 + w.squaredNorm());
  return MatrixXd::Identity(kGlobalValues, kGlobalValues) - share * w * w.transpose();
}

double WaveformFit::prior_cost(const VectorXd& z) const {
  return z.dot(precision_ * z);
}

double WaveformFit::value(int which, double z) const {
  const WaveformPrior& prior = priors_[static_cast<std::size_t>(which)];
  return prior.factor ? prior.value * std::exp(prior.spread * z) : prior.value + prior.spread * z;
}

int WaveformFit::rows(std::size_t window) const {
  return stage_.lengths[window] * (data_.position.empty() ? 1 : 2);
}

WaveformGrid WaveformFit::grid() const {
  WaveformGrid grid = data_.grid;
  if (stage_.coarse) grid.steps = (grid.steps + 1) / 2;
  return grid;
}

void WaveformFit::put(const VectorXd& z, const WaveformStart& start, std::size_t set,
                      WaveformSets& sets) const {
  for (int k = 0; k < kGlobalValues; ++k) sets[static_cast<std::size_t>(k)][set] = value(k, z[k]);
  for (int k = 0; k < kStartValues; ++k)
    sets[std::size_t{kGlobalValues} + static_cast<std::size_t>(k)][set] = start[k];
}

void WaveformFit::residuals(std::size_t window, const WaveformMotion& motion, std::size_t set,
                            double* to) const {
  const auto first = static_cast<std::size_t>(data_.windows[window].first);
  const auto length = static_cast<std::size_t>(stage_.lengths[window]);
  for (std::size_t i = 0; i < length; ++i) {
    const bool seen = i >= static_cast<std::size_t>(data_.unseen) && !data_.lost[first + i];
    *to++ = seen ? (data_.torque[first + i] - motion.torque[i][set]) / stage_.noise[kTorqueChannel] : 0;
  }
  if (data_.position.empty()) return;
  for (std::size_t i = 0; i < length; ++i)
    *to++ = data_.lost[first + i]
                ? 0
                : (data_.position[first + i] - motion.position[i][set]) / stage_.noise[kPositionChannel];
}

double WaveformFit::start_cost(std::size_t window, const WaveformStart& start) const {
  const WaveformStartGuess& guess = data_.guesses[window];
  return (start - guess.value).cwiseQuotient(guess.spread).squaredNorm();
}

WaveformFit::Part WaveformFit::linearise(std::size_t window) const {
  const auto shared = static_cast<int>(moving_.size()), all = shared + data_.starts;
  const int sides = stage_.central ? 2 : 1, runs = 1 + sides * all;
  const WaveformStartGuess& guess = data_.guesses[window];
  const auto step_of = [&](int k) {
    return k < shared ? steps_[moving_[static_cast<std::size_t>(k)]] : guess.step[k - shared];
  };
  MatrixXd columns(rows(window), runs);
  WaveformSets sets;
  WaveformMotion motion;
  for (int first = 0; first < runs; first += kWaveformSets) {
    for (int i = 0; i < kWaveformSets; ++i) {
      VectorXd z = point.z;
      WaveformStart start = point.starts[window];
      const int run = first + i, k = (run - 1) / sides;
      if (run > 0 && run < runs) {
        const double step = (run - 1) % sides == 0 ? step_of(k) : -step_of(k);
        (k < shared ? z[moving_[static_cast<std::size_t>(k)]] : start[k - shared]) += step;
      }
      put(z, start, static_cast<std::size_t>(i), sets);
    }
    move_waveform(data_.windows[window], grid(), stage_.lengths[window], sets, motion);
    for (int i = 0; i < kWaveformSets && first + i < runs; ++i)
      residuals(window, motion, static_cast<std::size_t>(i), columns.col(first + i).data());
  }
  MatrixXd slopes(rows(window), all);
  for (int k = 0; k < all; ++k)
    slopes.col(k) =
        (columns.col(1 + sides * k) - columns.col(stage_.central ? 2 + 2 * k : 0)) / (sides * step_of(k));
  const MatrixXd normal = signal::gram(slopes);
  const VectorXd toward = -signal::transposed_product(slopes, columns.col(0));
  Part part{normal.topLeftCorner(shared, shared),
            normal.topRightCorner(shared, data_.starts),
            normal.bottomRightCorner(data_.starts, data_.starts),
            toward.head(shared),
            toward.tail(data_.starts),
            columns.col(0).squaredNorm() + start_cost(window, point.starts[window])};
  const WaveformStart weight = guess.spread.cwiseAbs2().cwiseInverse();
  part.own.diagonal() += weight.head(data_.starts);
  part.own_toward -= weight.cwiseProduct(point.starts[window] - guess.value).head(data_.starts);
  return part;
}

/// The step of a damping; shared values first, then those of each window that follow from them.
WaveformFit::Trial WaveformFit::trial(const std::vector<Part>& parts, double damping) const {
  const auto shared = static_cast<Eigen::Index>(moving_.size());
  MatrixXd normal = precision_(moving_, moving_);
  const VectorXd pull = precision_ * point.z;
  VectorXd toward = -pull(moving_);
  for (std::size_t w = 0; w < parts.size(); ++w)
    if (used(w)) normal += parts[w].shared;
  normal.diagonal() *= 1 + damping;
  std::vector<MatrixXd> own(parts.size());
  for (std::size_t w = 0; w < parts.size(); ++w) {
    if (!used(w)) continue;
    own[w] = parts[w].own;
    own[w].diagonal() *= 1 + damping;
    MatrixXd right(data_.starts, shared + 1);
    right << parts[w].mixed.transpose(), parts[w].own_toward;
    const MatrixXd solved = signal::solve_symmetric(own[w], right);
    normal -= parts[w].mixed * solved.leftCols(shared);
    toward += parts[w].toward - parts[w].mixed * solved.col(shared);
  }
  VectorXd move = shared > 0 ? VectorXd(signal::solve_symmetric(normal, toward)) : VectorXd();
  move = move.cwiseMax(-kLongestMove).cwiseMin(kLongestMove);
  Trial result{point, damping};
  for (Eigen::Index k = 0; k < shared; ++k) result.point.z[moving_[static_cast<std::size_t>(k)]] += move[k];
  for (std::size_t w = 0; w < parts.size(); ++w)
    if (used(w))
      result.point.starts[w].head(data_.starts) +=
          signal::solve_symmetric(own[w], parts[w].own_toward - parts[w].mixed.transpose() * move).col(0);
  return result;
}

/// The start values of a window for each trial, one step of Gauss and Newton nearer to their best for its
/// shared values, where that is better; the costs.
std::vector<double> WaveformFit::settle(std::size_t window, std::vector<Trial>& trials) const {
  const auto starts = static_cast<std::size_t>(data_.starts), each = 1 + starts;
  const WaveformStartGuess& guess = data_.guesses[window];
  const std::size_t count = trials.size();
  MatrixXd r(rows(window), count * each), better(rows(window), count);
  const auto move = [&](const auto& start_of, MatrixXd& to) {
    WaveformSets sets;
    WaveformMotion motion;
    const auto runs = static_cast<std::size_t>(to.cols());
    for (std::size_t first = 0; first < runs; first += kWaveformSets) {
      for (std::size_t i = 0; i < kWaveformSets; ++i) {
        const std::size_t run = std::min(first + i, runs - 1);
        put(trials[run * count / runs].point.z, start_of(run), i, sets);
      }
      move_waveform(data_.windows[window], grid(), stage_.lengths[window], sets, motion);
      for (std::size_t i = 0; i < kWaveformSets && first + i < runs; ++i)
        residuals(window, motion, i, to.col(static_cast<Eigen::Index>(first + i)).data());
    }
  };
  move(
      [&](std::size_t run) {
        WaveformStart start = trials[run / each].point.starts[window];
        const auto k = static_cast<Eigen::Index>(run % each) - 1;
        if (k >= 0) start[k] += guess.step[k];
        return start;
      },
      r);
  const WaveformStart weight = guess.spread.cwiseAbs2().cwiseInverse();
  std::vector<WaveformStart> next;
  std::vector<double> costs;
  for (std::size_t i = 0; i < count; ++i) {
    const auto base = static_cast<Eigen::Index>(i * each);
    const WaveformStart& start = trials[i].point.starts[window];
    const MatrixXd slopes = (r.middleCols(base + 1, data_.starts).colwise() - r.col(base)) *
                            guess.step.head(data_.starts).cwiseInverse().asDiagonal();
    MatrixXd normal = signal::gram(slopes);
    normal.diagonal() += weight.head(data_.starts);
    const VectorXd toward = -signal::transposed_product(slopes, r.col(base)) -
                            weight.cwiseProduct(start - guess.value).head(data_.starts);
    next.push_back(start);
    next.back().head(data_.starts) += signal::solve_symmetric(normal, toward).col(0);
    costs.push_back(r.col(base).squaredNorm() + start_cost(window, start));
  }
  move([&](std::size_t run) { return next[run]; }, better);
  for (std::size_t i = 0; i < count; ++i) {
    const double cost = better.col(static_cast<Eigen::Index>(i)).squaredNorm() + start_cost(window, next[i]);
    if (!(cost < costs[i])) continue;
    costs[i] = cost;
    trials[i].point.starts[window] = next[i];
  }
  return costs;
}

std::vector<double> WaveformFit::costs(std::vector<Trial>& trials) const {
  std::vector<std::vector<double>> of(data_.windows.size());
  for_each_in_parallel(static_cast<int>(of.size()), [&](int index) {
    const auto w = static_cast<std::size_t>(index);
    if (used(w)) of[w] = settle(w, trials);
  });
  std::vector<double> sums;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    double sum = prior_cost(trials[i].point.z);
    for (const std::vector<double>& each : of)
      if (!each.empty()) sum += each[i];
    sums.push_back(std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity());
  }
  return sums;
}

/// One linearisation, and the best of several dampings. False where none improves.
bool WaveformFit::iterate() {
  std::vector<Part> parts(data_.windows.size());
  for_each_in_parallel(static_cast<int>(parts.size()), [&](int w) {
    if (used(static_cast<std::size_t>(w)))
      parts[static_cast<std::size_t>(w)] = linearise(static_cast<std::size_t>(w));
  });
  ++iterations_;
  const auto shared = static_cast<Eigen::Index>(moving_.size());
  cost_ = prior_cost(point.z);
  information_ = precision_(moving_, moving_);
  VectorXd alone = VectorXd::Ones(shared);
  for (std::size_t w = 0; w < parts.size(); ++w) {
    if (!used(w)) continue;
    cost_ += parts[w].cost;
    alone += parts[w].shared.diagonal();
    information_ +=
        parts[w].shared - parts[w].mixed * signal::solve_symmetric(parts[w].own, parts[w].mixed.transpose());
  }
  for (Eigen::Index k = 0; k < shared; ++k)
    steps_[moving_[static_cast<std::size_t>(k)]] =
        std::clamp(kStepPerError / std::sqrt(alone[k]), kShortestStep, kLongestStep);
  std::vector<Trial> trials;
  for (const double factor : kDampings) trials.push_back(trial(parts, damping_ * factor));
  const std::vector<double> all = costs(trials);
  const auto best = static_cast<std::size_t>(std::min_element(all.begin(), all.end()) - all.begin());
  gain_ = cost_ - all[best];
  if (!(gain_ > 0)) return false;
  point = trials[best].point;
  damping_ = std::max(kLeastDamping, trials[best].damping);
  cost_ = all[best];
  return true;
}

double WaveformFit::run(const Stage& stage) {
  stage_ = stage;
  moving_ = stage.starts_only ? std::vector<int>() : fitted_;
  damping_ = kFirstDamping;
  for (int i = 0; i < stage.iterations && damping_ < kMostDamping; ++i) {
    if (!iterate())
      damping_ *= kHarder;
    else if (gain_ < kEnough + kEnoughOfCost * cost_)
      break;
  }
  return cost_;
}

MatrixXd WaveformFit::covariance() const {
  return signal::symmetric_inverse(information_);
}

std::vector<double> WaveformFit::residual(std::size_t window, WaveformChannel channel) const {
  WaveformSets sets;
  WaveformMotion motion;
  for (std::size_t i = 0; i < kWaveformSets; ++i) put(point.z, point.starts[window], i, sets);
  const WaveformWindow& w = data_.windows[window];
  const int length = stage_.lengths[window];
  move_waveform(w, grid(), length, sets, motion);
  const auto& measured = channel == kTorqueChannel ? data_.torque : data_.position;
  const auto& moved = channel == kTorqueChannel ? motion.torque : motion.position;
  std::vector<double> r;
  for (std::size_t i = 0; i < static_cast<std::size_t>(length); ++i)
    r.push_back((channel == kTorqueChannel && i < static_cast<std::size_t>(data_.unseen)) ||
                        data_.lost[static_cast<std::size_t>(w.first) + i]
                    ? 0
                    : measured[static_cast<std::size_t>(w.first) + i] - moved[i][0]);
  return r;
}

}  // namespace backlash::diagnosis
