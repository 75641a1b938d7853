// SPDX-License-Identifier: BSD-3-Clause
#include "healthy_scores.h"

#include <Eigen/Dense>
#include <algorithm>

namespace backlash::changes {
HealthyScores::HealthyScores(const HealthyModel& model, const ChangeSettings& settings)
    : records_(model.records),
      left_(model.left),
      variance_(model.noise * model.noise),
      window_(settings.window),
      block_(settings.block),
      margin_(settings.margin) {
  for (const SampledMotion& motion : *records_)
    backgrounds_.push_back(background_of(model, motion, settings));
}

double HealthyScores::inflation(const ChangeEffect& effect) const {
  double most = 1;
  for (std::size_t r = 0; r < records_->size(); ++r) {
    const SampledMotion& motion = (*records_)[r];
    most = std::max(most,
                    score_inflation(motion, left_[r], *effect_columns(motion, effect), variance_, window_));
  }
  return most;
}

double HealthyScores::most_growth(const ChangeEffect& effect) const {
  const auto margin = static_cast<std::size_t>(margin_ / block_);
  double most = 0;
  for (std::size_t r = 0; r < records_->size(); ++r) {
    const SampledMotion& motion = (*records_)[r];
    const EffectSums sums(motion, *effect_columns(motion, effect), backgrounds_[r], block_, effect.ramp);
    for (std::size_t k = margin; k + margin < sums.blocks(); ++k)
      most = std::max(most, sums.score(k, sums.blocks(), backgrounds_[r]).gain);
  }
  return most;
}

bool HealthyScores::is_healthy(const ChangeEffect& effect, const EffectSums::Score& found, double inflation,
                               double threshold, const std::vector<ChangeEffect>& beside) const {
  bool shown = false;
  for (std::size_t r = 0; r < records_->size(); ++r) {
    const SampledMotion& motion = (*records_)[r];
    Background b = backgrounds_[r];
    for (const ChangeEffect& other : beside) b.add_unknown(*effect_columns(motion, other));
    if (!beside.empty()) b.solve();
    const EffectSums sums(motion, *effect_columns(motion, effect), b, block_, effect.ramp);
    const EffectSums::Score own = sums.score(0, sums.blocks(), b);
    if (own.values.size() != found.values.size()) continue;
    shown = true;
    const Eigen::VectorXd by = found.values - own.values;
    const Eigen::MatrixXd covariance = found.covariance + own.covariance;
    if (by.dot(covariance.ldlt().solve(by)) < inflation * threshold) return true;
  }
  return !shown;
}

}  // namespace backlash::changes
