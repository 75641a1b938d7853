// SPDX-License-Identifier: BSD-3-Clause
// Generalised likelihood ratio over value, onset and shape, from the scores of fitted stretches. The healthy
// values of the record are nuisances: normal about those of the healthy records.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "rig_stretches.h"

namespace backlash::changes {

/// How a value is other over time.
struct RigShape {
  double since = 0, until = std::numeric_limits<double>::infinity();  // s
  bool ramp = false;                                                  // from 0 at `since` to 1 at the end

  double weight(const Stretch& at, double end) const {
    if (at.middle() < since || at.middle() >= until) return 0;
    return ramp ? (at.middle() - since) / (end - since) : 1;
  }
};

struct RigChange {
  std::size_t effect = 0;  // of HealthyRig::effects
  RigShape shape;
  double size = 0, variance = 0;  // of weight 1
  double gain = 0;                // twice the log likelihood ratio, over the inflation of the effect
};

class RigScan {
 public:
  /// `stretches`: judged ones, by time. `probability` of a false alarm in all.
  RigScan(const HealthyRig& rig, std::vector<FittedStretch> stretches, double probability,
          const ChangeSettings& settings);

  /// Several, one after the other, as long as they are believed.
  std::vector<RigChange> run() const;
  /// What all values together explain at a shape, in the unit of a change's gain.
  double all_gain(const RigShape& shape, const std::vector<RigChange>& beside) const;
  RigChange scored(std::size_t effect, const RigShape& shape, const std::vector<RigChange>& beside) const;
  /// From when to when the change may have begun.
  Stretch onset_interval(const RigChange& change, const std::vector<RigChange>& beside) const;
  /// A value that is another one over the whole record, by more than from record to record; nothing: none.
  std::optional<RigChange> different(const std::vector<RigChange>& beside) const;
  /// The last stretch before a time and the first after it.
  const FittedStretch& before(double time) const;
  const FittedStretch& after(double time) const;

  double threshold() const { return threshold_; }
  double end() const { return stretches_.back().at.to; }
  std::size_t size() const { return stretches_.size(); }

 private:
  struct Beside;
  struct Sums;
  Beside system(const std::vector<RigChange>& beside) const;
  Sums sums(const RigShape& shape, const Beside& beside) const;
  RigChange of(std::size_t effect, const RigShape& shape, const Sums& sums) const;
  std::vector<RigShape> shapes() const;
  std::optional<RigChange> best(const std::vector<RigChange>& beside) const;
  bool believed(const RigChange& change) const;
  void find_end(RigChange& change, const std::vector<RigChange>& beside) const;

  const HealthyRig& rig_;
  const std::vector<FittedStretch> stretches_;
  const ChangeSettings& settings_;
  double threshold_;
};

}  // namespace backlash::changes
