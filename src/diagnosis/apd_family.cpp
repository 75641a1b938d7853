#include "backlash_diagnosis/diagnosis/apd_family.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/quadratic.h"

namespace backlash {
namespace {

constexpr double kReach = 4.5;         // standard deviations beyond which a normal distribution is 0 or 1
constexpr double kCellsPerSigma = 4;   // of the grid on which distributions are summed
constexpr double kLevelRatio = 1.03;      // between levels of noise at which a family is kept
constexpr std::size_t kMostLevels = 32;   // half a megabyte each
constexpr double kMostCells = 20'000;  // where noise is tiny against the range

/// Normal distribution function within +-kReach, interpolated in a table to 2e-7.
double normal_distribution(double z) {
  constexpr int kSteps = 2000;
  static const std::vector<double> table = [] {
    std::vector<double> values(kSteps + 2);
    for (int i = 0; i < kSteps + 2; ++i)
      values[i] = 0.5 * std::erfc(-(2.0 * i / kSteps - 1) * kReach * M_SQRT1_2);
    return values;
  }();
  const double place = std::clamp((z / kReach + 1) * (0.5 * kSteps), 0.0, static_cast<double>(kSteps));
  const int i = static_cast<int>(place);
  return table[i] + (place - i) * (table[i + 1] - table[i]);
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
  if (!(sigma > 0)) return exact;
  const double lower = exact.front() - kReach * sigma, range = exact.back() - exact.front() + 2 * kReach * sigma;
  const double cell = std::max(sigma / kCellsPerSigma, range / kMostCells);
  const auto cells = static_cast<std::size_t>(std::ceil(range / cell)) + 1;
  std::vector<double> cumulative(cells + 1, 0), whole(cells + 2, 0);
  for (const double centre : exact) {
    const auto begin = static_cast<std::size_t>(std::max(0.0, (centre - kReach * sigma - lower) / cell));
    const auto end = std::min(cells + 1, static_cast<std::size_t>((centre + kReach * sigma - lower) / cell) + 1);
    for (std::size_t i = begin; i < end; ++i)
      cumulative[i] += normal_distribution((lower + static_cast<double>(i) * cell - centre) / sigma);
    whole[end] += 1;
  }
  double passed = 0;
  for (std::size_t i = 0; i <= cells; ++i) cumulative[i] += passed += whole[i];
  Quantiles noisy(exact.size());
  std::size_t i = 1;
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const double wanted = static_cast<double>(k) + 0.5;
    while (i < cells && cumulative[i] < wanted) ++i;
    const double step = cumulative[i] - cumulative[i - 1];
    const double share = step > 0 ? std::clamp((wanted - cumulative[i - 1]) / step, 0.0, 1.0) : 0.5;
    noisy[k] = lower + (static_cast<double>(i - 1) + share) * cell;
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
  for (Eigen::Index k = 0; k + 1 < members_.cols(); ++k) neighbours_[k] = members_.col(k).dot(members_.col(k + 1));
}

ApdFamily::ApdFamily() : compared(std::make_shared<NoisyFamilies>()) {}

std::shared_ptr<const NoisyFamily> NoisyFamilies::at(const ApdFamily& family, double sigma) {
  const bool none = !(sigma > 0);
  const double step = std::log(kLevelRatio);
  const long level = none ? std::numeric_limits<long>::min() : std::lround(std::log(sigma) / step);
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.level == level; });
  if (known != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, known);
  } else {
    kept_.push_front({level, std::make_shared<NoisyFamily>(family, none ? 0 : std::exp(double(level) * step))});
    if (kept_.size() > kMostLevels) kept_.pop_back();
  }
  return kept_.front().family;
}

// Squares of differences from products of the members with the record: those among the members are known already.
FamilyDistance::FamilyDistance(const NoisyFamily& family, const Quantiles& observed) {
  const Eigen::VectorXd own = Eigen::Map<const Eigen::VectorXd>(observed.data(), kQuantiles) - family.middle_;
  const Eigen::VectorXd shared = family.members_.transpose() * own;
  const double own_square = own.squaredNorm();
  parabolas_.resize(family.count_ - 1);
  for (std::size_t i = 0; i + 1 < family.count_; ++i)
    for (std::size_t phase = 0; phase < family.phases_; ++phase) {
      const Eigen::Index k = family.column(i, phase);
      const double at_start = own_square - 2 * shared[k] + family.square_[k];
      const double apart = family.square_[k] - 2 * family.neighbours_[k] + family.square_[k + 1];
      const double cross = own_square - shared[k] - shared[k + 1] + family.neighbours_[k];
      parabolas_[i].push_back({apart / kQuantiles, 2 * (cross - at_start) / kQuantiles, at_start / kQuantiles});
    }
  smallest_.distance = parabolas_[0][0].at(0);
  for (std::size_t i = 0; i < parabolas_.size(); ++i)
    for (const Parabola& p : parabolas_[i]) {
      const double lowest = p.a > 0 ? std::clamp(-p.b / (2 * p.a), 0.0, 1.0) : 0;
      for (const double share : {0.0, lowest, 1.0})
        if (p.at(share) < smallest_.distance) smallest_ = {std::max(0.0, p.at(share)), i, share};
    }
}

double FamilyDistance::at(std::size_t segment, double share) const {
  double smallest = parabolas_[segment][0].at(share);
  for (const Parabola& p : parabolas_[segment]) smallest = std::min(smallest, p.at(share));
  return std::max(0.0, smallest);
}

std::vector<std::pair<double, double>> FamilyDistance::within(std::size_t segment, double limit) const {
  std::vector<std::pair<double, double>> all;
  for (const Parabola& p : parabolas_[segment])
    for (const auto& interval : not_positive(p.a, p.b, p.c - limit)) all.push_back(interval);
  return all;
}

}  // namespace backlash
