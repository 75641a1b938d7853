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
  /// Whether an effect of these values over a whole record is one that a healthy record has as well: its own
  /// values there, beside the same others, are the same by `threshold` (of twice the log likelihood ratio,
  /// scores inflated). Also where none of them shows it: then the motion is another one, and nobody knows the
  /// machine there.
  bool is_healthy(const ChangeEffect& effect, const EffectSums::Score& found, double inflation,
                  double threshold, const std::vector<ChangeEffect>& beside) const;

 private:
  std::shared_ptr<const std::vector<SampledMotion>> records_;
  std::vector<Eigen::VectorXd> left_;
  std::vector<Background> backgrounds_;  // of each
  double variance_, window_, block_, margin_;
};

}  // namespace backlash::changes
