// SPDX-License-Identifier: BSD-3-Clause
#include "chain_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "onset_threshold.h"

namespace backlash::changes {
namespace {

/// One standard deviation of what a body that an arm carries is at most: what the motion does not show then
/// stays 0. Choice: the largest arms of this kind carry some 10 kg, half a metre out.
Eigen::VectorXd largest_body() {
  Eigen::VectorXd sd(10);
  sd << 10, 5, 5, 5, 2, 2, 2, 2, 2, 2;
  return sd;
}

}  // namespace

std::string described(const ChainEffect& effect, const arm::Chain& chain) {
  const arm::Joint& joint = chain.joints[effect.joint];
  return effect.id + (effect.values > 1 ? " at " + joint.link : " of " + joint.name);
}

ChainSearch::ChainSearch(const std::deque<ArmJoint>& joints, const arm::Chain& chain,
                         const ChangeSettings& settings)
    : joints_(joints),
      chain_(chain),
      effects_(chain_effects(chain.size())),
      settings_(settings),
      margin_(static_cast<std::size_t>(settings.margin / settings.block)) {
  for (const ArmJoint& j : joints_) {
    backgrounds_.push_back(j.search->background(j.found));
    const std::size_t blocks = j.search->blocks();
    blocks_ = blocks_ == 0 ? blocks : std::min(blocks_, blocks);
    rows_ += double(j.motion.size());
  }
}

ChainSearch::Sums ChainSearch::sums_of(const ChainEffect& effect) const {
  Sums sums;
  for (std::size_t j = 0; j < joints_.size(); ++j)
    sums.joints.emplace_back(joints_[j].motion, *effect_columns(joints_[j].motion, effect.at_joint()),
                             backgrounds_[j], settings_.block, false);
  return sums;
}

EffectSums::Score ChainSearch::score(const Sums& sums, std::size_t from, std::size_t to,
                                     const ChainEffect& effect) const {
  EffectSums::Normal all{Eigen::VectorXd::Zero(effect.values),
                         Eigen::MatrixXd::Zero(effect.values, effect.values),
                         Eigen::VectorXd::Zero(effect.values)};
  for (std::size_t j = 0; j < sums.joints.size(); ++j) {
    const EffectSums::Normal one = sums.joints[j].normal(from, to, backgrounds_[j]);
    all.own += one.own;
    all.information += one.information;
    all.moment += one.moment;
  }
  if (effect.values == 1) return EffectSums::score(all);
  if (!(all.own[0] > 0)) return {};
  EffectSums::Score score;
  const Eigen::VectorXd sd = largest_body();
  Eigen::MatrixXd scaled = sd.asDiagonal() * all.information * sd.asDiagonal();
  scaled += Eigen::MatrixXd::Identity(sd.size(), sd.size());
  const Eigen::LDLT<Eigen::MatrixXd> solver(scaled);
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(sd.size(), sd.size()));
  score.covariance = sd.asDiagonal() * inverse * sd.asDiagonal();
  score.values = score.covariance * all.moment;
  score.gain = all.moment.dot(score.values);
  return std::isfinite(score.gain) && score.gain >= 0 ? score : EffectSums::Score();
}

FoundChainChange ChainSearch::scanned(std::size_t effect) const {
  FoundChainChange best{effects_[effect], 0, blocks_, {}, {}, 1, 0, 0, {}};
  for (const ArmJoint& j : joints_) best.inflation = std::max(best.inflation, j.chain_inflation[effect]);
  const Sums sums = sums_of(best.effect);
  // From the first sample on: the arm came in with another tool.
  best.score = score(sums, 0, blocks_, best.effect);
  for (std::size_t k = margin_; k + margin_ < blocks_; k += 5) {
    EffectSums::Score s = score(sums, k, blocks_, best.effect);
    if (s.gain <= best.score.gain) continue;
    best.from = k;
    best.score = std::move(s);
  }
  return best;
}

void ChainSearch::refine(FoundChainChange& f, const Sums& sums) const {
  f.score = score(sums, f.from, f.to, f.effect);
  for (std::size_t k = margin_; k + margin_ / 2 < f.to; ++k) {
    EffectSums::Score s = score(sums, k, f.to, f.effect);
    if (s.gain <= f.score.gain) continue;
    f.from = k;
    f.score = std::move(s);
  }
}

double ChainSearch::noisier(const FoundChainChange& f) const {
  double squares = 0;
  for (const Background& b : backgrounds_) squares += b.left().squaredNorm() / b.variance;
  return std::max(1.0, (squares - f.score.gain) / rows_);
}

bool ChainSearch::believed(const FoundChainChange& f) const {
  const double hours = settings_.block * double(blocks_) / 3600;
  const double probability =
      std::clamp(settings_.false_alarms_per_hour * hours / double(effects_.size()), 1e-14, 0.1);
  const double fewest = double(margin_);
  const double threshold =
      gain_by_chance(probability, double(f.effect.values), fewest, std::max(fewest, double(blocks_)));
  return f.score.gain / (f.inflation * noisier(f)) > threshold;
}

/// An end, where the record with it is explained clearly better: what was taken is put down again.
void ChainSearch::find_end(FoundChainChange& f, const Sums& sums) const {
  FoundChainChange ended = f;
  for (int round = 0; round < 3; ++round) {
    for (std::size_t k = ended.from + margin_ / 2; k + margin_ / 2 < blocks_; ++k) {
      EffectSums::Score s = score(sums, ended.from, k, f.effect);
      if (s.gain <= ended.score.gain) continue;
      ended.to = k;
      ended.score = std::move(s);
    }
    if (ended.to == f.to) return;
    refine(ended, sums);
  }
  if (ended.score.gain > (1 + settings_.least_beside) * f.score.gain) f = ended;
}

void ChainSearch::set_onset(FoundChainChange& f, const Sums& sums) const {
  const double drop = settings_.onset_drop * f.inflation * noisier(f);
  std::size_t low = f.from, high = f.from;
  for (std::size_t k = 0; k < f.to; ++k) {
    if (score(sums, k, f.to, f.effect).gain < f.score.gain - drop) continue;
    low = std::min(low, k);
    high = std::max(high, k);
  }
  if (low <= margin_) low = 0;
  const double least = settings_.block + settings_.onset_least;
  f.low = std::max(0.0, settings_.block * double(low) - least);
  f.high = settings_.block * double(high) + least;
}

/// A body that an arm may carry or have lost: its mass is known, its centre within reach. A slip is small
/// enough for its sine to be a straight line.
bool ChainSearch::plausible(const FoundChainChange& f) const {
  if (f.score.values.size() == 0) return false;
  if (f.effect.values == 1) return std::fabs(f.score.values[0]) < settings_.largest_slip;
  const Eigen::VectorXd& x = f.score.values;
  return std::fabs(x[0]) > settings_.errors_of_mass * f.error(0) &&
         x.segment(1, 3).norm() < settings_.farthest_centre * std::fabs(x[0]);
}

/// By how much a further value fits noise better: Schwarz 1978, Annals of Statistics 6:461.
double ChainSearch::cost(const FoundChainChange& f) const {
  return double(f.effect.values) * f.inflation * std::log(rows_);
}

/// Of those that explain it alike the one with fewer values, then the first: the last link.
std::optional<FoundChainChange> ChainSearch::chosen() const {
  std::vector<FoundChainChange> all;
  double most = 0, squares = 0;
  for (const Background& b : backgrounds_) squares += b.misfit();
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    FoundChainChange f = scanned(i);
    if (!plausible(f)) continue;
    most = std::max(most, f.score.gain - cost(f));
    all.push_back(std::move(f));
  }
  const auto is_alike = [&](const FoundChainChange& f) {
    const double gain = f.score.gain - cost(f);
    return gain > 0 && gain >= settings_.alike * most &&
           squares - most > (1 - settings_.same_link) * (squares - gain);
  };
  const FoundChainChange* best = nullptr;
  for (const FoundChainChange& f : all)
    if (is_alike(f) && (!best || f.effect.values < best->effect.values)) best = &f;
  if (!best) return std::nullopt;
  FoundChainChange out = *best;
  for (const FoundChainChange& f : all)
    if (is_alike(f) && &f != best) out.alike.push_back(described(f.effect, chain_));
  return out;
}

/// A change of its own, not what the shape of an earlier one leaves.
bool ChainSearch::further(const FoundChainChange& f, const std::vector<FoundChainChange>& found) const {
  return std::all_of(found.begin(), found.end(), [&](const FoundChainChange& other) {
    const double apart = std::fabs(double(f.from) - double(other.from)) * settings_.block;
    return apart >= settings_.same_event || f.score.gain >= settings_.least_beside * other.score.gain;
  });
}

std::optional<FoundChainChange> ChainSearch::best(const std::vector<FoundChainChange>& earlier) const {
  std::optional<FoundChainChange> found = chosen();
  if (!found) return std::nullopt;
  const Sums sums = sums_of(found->effect);
  refine(*found, sums);
  if (!believed(*found) || !further(*found, earlier)) return std::nullopt;
  find_end(*found, sums);
  if (!plausible(*found)) return std::nullopt;
  set_onset(*found, sums);
  return found;
}

}  // namespace backlash::changes
