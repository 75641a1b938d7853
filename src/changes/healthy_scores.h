// SPDX-License-Identifier: BSD-3-Clause
// How the scores of effects scatter in the healthy records.
#pragma once

#include <vector>

#include "change_scan.h"

namespace backlash::changes {

class HealthyScores {
 public:
  HealthyScores(const HealthyModel& model, const ChangeSettings& settings);
  /// By how much they scatter, see score_inflation().
  double inflation(const ChangeEffect& effect) const;
  /// The largest gain of its growth to the end of a healthy record, from any onset on.
  double most_growth(const ChangeEffect& effect) const;

 private:
  std::shared_ptr<const std::vector<SampledMotion>> records_;
  std::vector<Eigen::VectorXd> left_;
  std::vector<Background> backgrounds_;  // of each
  double variance_, window_, block_, margin_;
};

}  // namespace backlash::changes
