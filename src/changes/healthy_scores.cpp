// SPDX-License-Identifier: BSD-3-Clause
#include "healthy_scores.h"

#include <algorithm>

namespace backlash::changes {

HealthyScores::HealthyScores(const HealthyModel& model, const ChangeSettings& settings)
    : records_(model.records),
      left_(model.left),
      variance_(model.noise * model.noise),
      window_(settings.window) {}

double HealthyScores::inflation(const ChangeEffect& effect) const {
  double most = 1;
  for (std::size_t r = 0; r < records_->size(); ++r) {
    const SampledMotion& motion = (*records_)[r];
    most = std::max(most,
                    score_inflation(motion, left_[r], *effect_columns(motion, effect), variance_, window_));
  }
  return most;
}

}  // namespace backlash::changes
