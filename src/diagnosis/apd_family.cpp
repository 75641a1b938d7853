// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/apd_family.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/quadratic.h"

namespace backlash::diagnosis {
namespace {

constexpr int kCellsPerSigma = 4;  // of the grid on which distributions are summed
constexpr int kReach = 18;   // cells beyond which a normal distribution is 0 or 1: 4.5 standard deviations
constexpr int kShares = 64;  // places of a centre within its cell that are distinguished
constexpr double kLeastNoise = 2e-4;     // of the range of a distribution, less cannot be seen in it
constexpr double kLevelRatio = 1.03;     // between levels of noise at which a family is kept
constexpr std::size_t kMostLevels = 32;  // half a megabyte each

/// The normal distribution function at the grid's points about its centre, which lies `share` / kShares of a
/// cell beyond the point before it: from kReach cells before that point to kReach + 1 after it.
using Rise = Eigen::Array<double, 2 * kReach + 2, 1>;
const Rise& normal_rise(int share) {
  static const std::vector<Rise> rises = [] {
    std::vector<Rise> all(kShares + 1);
    for (int s = 0; s <= kShares; ++s)
      for (int i = 0; i < Rise::SizeAtCompileTime; ++i)
        all[s][i] = 0.5 * std::erfc(-(i - kReach - double(s) / kShares) / kCellsPerSigma * M_SQRT1_2);
    return all;
  }();
  return rises[share];
}

}  // namespace

Quantiles quantiles_of(std::vector<double> samples) {
  if (samples.empty()) throw InvalidParameter("samples", "none", "a distribution needs at least one");
  std::sort(samples.begin(), samples.end());
  Quantiles q(kQuantiles);
  const double n = static_cast<double>(samples.size());
  for (int k = 0; k < kQuantiles; ++k) {
    const double place = std::clamp(n * (k + 0.5) / kQuantiles - 0.5, 0.0, n - 1);
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    q[k] = i + 1 < samples.size() ? samples[i] + share * (samples[i + 1] - samples[i]) : samples[i];
  }
  return q;
}

// The mixture of equal normal distributions about the exact quantiles, summed on a grid and inverted.
Quantiles with_noise(const Quantiles& exact, double sigma) {
  const double range = exact.back() - exact.front();
  if (!(sigma > kLeastNoise * range)) return exact;
  const double cell = sigma / kCellsPerSigma, lower = exact.front() - (kReach + 1) * cell;
  const auto cells =
      static_cast<Eigen::Index>((exact.back() - lower) / cell) + kReach + 3;  // rounded as below
  Eigen::ArrayXd cumulative = Eigen::ArrayXd::Zero(cells), whole = Eigen::ArrayXd::Zero(cells);
  for (const double centre : exact) {
    const double place = (centre - lower) / cell;
    const auto before = static_cast<Eigen::Index>(place);
    const Rise& rise = normal_rise(static_cast<int>(std::lround((place - double(before)) * kShares)));
    cumulative.segment<Rise::SizeAtCompileTime>(before - kReach) += rise;
    whole[before + kReach + 2] += 1;
  }
  Quantiles noisy(exact.size());
  double before = 0, passed = 0;  // samples up to the last point of the grid, beyond their own rise
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < cells && k < noisy.size(); ++i) {
    passed += whole[i];
    const double now = cumulative[i] + passed;
    for (; k < noisy.size() && now >= static_cast<double>(k) + 0.5; ++k) {
      const double share = (static_cast<double>(k) + 0.5 - before) / (now - before);
      noisy[k] = lower + (static_cast<double>(i - 1) + share) * cell;
    }
    before = now;
  }
  return noisy;
}

NoisyFamily::NoisyFamily(const ApdFamily& family, double sigma)
    : count_(family.members.size()), phases_(family.members.front().size()) {
  members_.resize(kQuantiles, static_cast<Eigen::Index>(count_ * phases_));
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t phase = 0; phase < phases_; ++phase) {
      const Quantiles noisy = with_noise(family.members[i][phase], sigma);
      members_.col(column(i, phase)) = Eigen::Map<const Eigen::VectorXd>(noisy.data(), kQuantiles);
    }
  middle_ = members_.rowwise().mean();
  members_.colwise() -= middle_;
  square_ = members_.colwise().squaredNorm();
  neighbours_ = Eigen::VectorXd::Zero(members_.cols());
  for (Eigen::Index k = 0; k + 1 < members_.cols(); ++k)
    neighbours_[k] = members_.col(k).dot(members_.col(k + 1));
}

ApdFamily::ApdFamily() : compared(std::make_shared<NoisyFamilies>()) {}

std::shared_ptr<const NoisyFamily> NoisyFamilies::at(const ApdFamily& family, double sigma) {
  const bool none = !(sigma > 0);
  const double step = std::log(kLevelRatio);
  const long level = none ? std::numeric_limits<long>::min() : std::lround(std::log(sigma) / step);
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known =
      std::find_if(cached_.begin(), cached_.end(), [&](const CachedFamily& k) { return k.level == level; });
  if (known != cached_.end()) {
    cached_.splice(cached_.begin(), cached_, known);
  } else {
    cached_.push_front(
        {level, std::make_shared<NoisyFamily>(family, none ? 0 : std::exp(double(level) * step))});
    if (cached_.size() > kMostLevels) cached_.pop_back();
  }
  return cached_.front().family;
}

// Squares of differences from products of the members with the record: those among the members are known
// already.
FamilyDistance::FamilyDistance(const NoisyFamily& family, const Quantiles& observed) {
  const Eigen::VectorXd own = Eigen::Map<const Eigen::VectorXd>(observed.data(), kQuantiles) - family.middle_;
  const Eigen::VectorXd shared = family.members_.transpose() * own;
  const double own_square = own.squaredNorm();
  phases_ = family.phases_;
  parabolas_.reserve((family.count_ - 1) * phases_);
  for (std::size_t i = 0; i + 1 < family.count_; ++i)
    for (std::size_t phase = 0; phase < family.phases_; ++phase) {
      const Eigen::Index k = family.column(i, phase);
      const double at_start = own_square - 2 * shared[k] + family.square_[k];
      const double apart = family.square_[k] - 2 * family.neighbours_[k] + family.square_[k + 1];
      const double cross = own_square - shared[k] - shared[k + 1] + family.neighbours_[k];
      parabolas_.push_back({apart / kQuantiles, 2 * (cross - at_start) / kQuantiles, at_start / kQuantiles});
    }
  smallest_.distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < parabolas_.size(); ++k) {
    const double share = parabolas_[k].lowest(), distance = parabolas_[k].at(share);
    if (distance < smallest_.distance) smallest_ = {distance, k / phases_, share};
  }
  smallest_.distance = std::max(0.0, smallest_.distance);
}

double FamilyDistance::Parabola::lowest() const {
  if (a > 0) return std::clamp(-b / (2 * a), 0.0, 1.0);
  return a + b < 0 ? 1 : 0;
}

double FamilyDistance::at(std::size_t segment, double share) const {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t phase = 0; phase < phases_; ++phase)
    smallest = std::min(smallest, parabolas_[segment * phases_ + phase].at(share));
  return std::max(0.0, smallest);
}

std::vector<std::pair<double, double>> FamilyDistance::within(std::size_t segment, double limit) const {
  std::vector<std::pair<double, double>> all;
  for (std::size_t phase = 0; phase < phases_; ++phase) {
    const Parabola& p = parabolas_[segment * phases_ + phase];
    if (p.at(p.lowest()) > limit) continue;  // most
    for (const auto& interval : signal::quadratic_at_most_zero(p.a, p.b, p.c - limit))
      all.push_back(interval);
  }
  return all;
}

}  // namespace backlash::diagnosis
