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

  struct Found {
    std::vector<RigChange> changes;
    std::vector<RigChange> different;  // from the beginning of the record: no changes in it
    std::vector<RigChange> beside(std::size_t but) const;  // all but one of the changes
    std::vector<RigChange> all() const;
  };
  /// Several, one after the other, as long as they are believed.
  Found run() const;
  /// Where all values together are others that no found change is; nothing: nowhere.
  std::optional<RigShape> unexplained(const Found& found) const;
  /// What all values together explain at a shape, in the unit of a change's gain.
  double all_gain(const RigShape& shape, const std::vector<RigChange>& beside) const;
  RigChange scored(std::size_t effect, const RigShape& shape, const std::vector<RigChange>& beside) const;
  /// From when to when the change may have begun.
  Stretch onset_interval(const RigChange& change, const std::vector<RigChange>& beside) const;
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
  void unite(Found& found) const;
  bool near(double onset, const std::vector<RigChange>& changes) const;
  void find_end(RigChange& change, const std::vector<RigChange>& beside) const;

  const HealthyRig& rig_;
  const std::vector<FittedStretch> stretches_;
  const ChangeSettings& settings_;
  double probability_, threshold_;
};

}  // namespace backlash::changes
