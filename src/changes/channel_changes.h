// SPDX-License-Identifier: BSD-3-Clause
// What all channels share, be they of a joint or of the joints of an arm: how the scores of the effects that
// are tried scatter, and what is told of what they leave.
#pragma once

#include <string>
#include <vector>

#include "change_search.h"

namespace backlash::changes {

/// "37 s"
std::string whole_seconds(double time);

/// How the scores of effects scatter in the healthy records.
class HealthyScores {
 public:
  HealthyScores(const HealthyModel& model, const ChangeSettings& settings);
  double inflation(const ChangeEffect& effect) const;

 private:
  std::shared_ptr<const std::vector<SampledMotion>> records_;
  std::vector<Eigen::VectorXd> left_;
  double variance_, window_;
};

/// What no effect explains is no health. `of_two`: inertias.
void tell_unexplained(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                      const ChangeSettings& settings, Changes& out);

/// What is over soon is no change of the machine, whatever it looks like: a push, or a fault that few passes
/// show.
void take_out_short(const ChangeSettings& settings, Changes& out);

}  // namespace backlash::changes
