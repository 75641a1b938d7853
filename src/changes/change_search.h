// SPDX-License-Identifier: BSD-3-Clause
// Which changes one channel of a record shows: the best effect and onset, again and again beside those that
// were found, as long as they are believed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/changes/changes.h"
#include "change_scan.h"
#include "healthy_scores.h"
#include "local_fault.h"
#include "unexplained.h"

namespace backlash::changes {

struct FoundChange {
  ChangeEffect effect;
  std::size_t from = 0, to = 0;  // blocks
  EffectSums::Score score;
  double inflation = 1, gain = 0;
  std::vector<std::string> alike;
};

/// One channel of a record against a healthy machine.
class ChangeSearch {
 public:
  /// `beside`: changes that another channel shows, of which this one may show any share.
  ChangeSearch(const HealthyModel& model, const SampledMotion& motion, std::vector<ChangeEffect> candidates,
               const HealthyScores& scores, const std::vector<FoundChange>& beside,
               const ChangeSettings& settings, const Progress& progress);

  const HealthyModel& model() const { return model_; }
  std::vector<FoundChange> run();
  /// The best change beside those that were found, if it is believed. What the record has from its beginning
  /// is no change from then on.
  std::optional<FoundChange> next(const std::vector<FoundChange>& found);
  void add(FoundChange next, std::vector<FoundChange>& found) const;
  Background background(const std::vector<FoundChange>& others) const;
  /// Squares [(N m)^2] that it leaves of these blocks, and of how many rows.
  double left_after(const Background& b, std::size_t from, std::size_t to, double& rows) const;
  std::size_t blocks() const { return blocks_; }
  double threshold(Eigen::Index values) const;
  std::size_t windows() const;
  Change change_of(const FoundChange& found, const std::vector<FoundChange>& all, bool linear) const;
  /// There is a change most like a fault at one place, in which other effects have a share.
  bool like_fault() const { return like_fault_; }
  /// What is left beside these is louder than the healthy machine leaves.
  std::optional<LoudStretch> loud(const std::vector<FoundChange>& all) const;
  /// The same over the rest of the record, in motion alike, where nothing was found.
  std::optional<LoudStretch> louder() const;
  Change unknown(const LoudStretch& stretch) const;
  const std::vector<std::string>& different() const { return different_; }
  /// So many columns of a background are of the machine itself and what it may wander by.
  Eigen::Index own() const { return beside_column_; }
  /// Values of the columns that stand beside, `found` being so.
  std::vector<signal::Measured> beside(const std::vector<FoundChange>& found) const;

 private:
  std::vector<double> times() const;
  /// `apart`: what is left there is of another variance, and determines the values of the rest as little.
  std::vector<double> squares_over_healthy(const std::vector<FoundChange>& all,
                                           const std::optional<LoudStretch>& apart = std::nullopt) const;
  Eigen::MatrixXd found_columns(const FoundChange& f) const;
  std::optional<FoundChange> best(const Background& b) const;
  bool leaves_more(const FoundChange& f, const FoundChange& most, const Background& b) const;
  FoundChange scanned(const ChangeEffect& e, const Background& b, std::size_t step) const;
  Eigen::VectorXd left_with(const FoundChange& f, const Background& b) const;
  Eigen::VectorXd values_without_wander(const FoundChange& f, const Background& b) const;
  bool needs_wander(const FoundChange& f, const Background& b) const;
  bool believed(const FoundChange& f, const Background& b) const;
  bool begins_before(const FoundChange& f, const Background& b) const;
  void differ(FoundChange f);
  bool further(const FoundChange& next, const std::vector<FoundChange>& found) const;
  EffectSums::Score score_of(const Eigen::MatrixXd& columns, const FoundChange& f, const Background& b) const;
  bool take_better(FoundChange& f, const ChangeEffect& e, double times, const Background& b) const;
  void refine(FoundChange& f, const Background& b) const;
  void refine_order(FoundChange& f, const Background& b) const;
  void refine_size(FoundChange& f, const Background& b) const;
  void refine_scale(FoundChange& f, const Background& b) const;
  void add_inertia(FoundChange& f, const Background& b) const;
  // Faults at a place
  std::optional<FoundChange> best_fault(const Background& b) const;
  void refine_fault(FoundChange& f, const Background& b) const;
  bool repeats(const FoundChange& f, const Background& b) const;
  bool alone(const FoundChange& f, const Background& b) const;
  double left_at(const FoundChange& f, const Eigen::VectorXd& left, double& rows) const;
  std::vector<ChangeSize> scaled_size(const FoundChange& f, const Background& b, double noisier,
                                      bool linear) const;
  std::vector<ChangeSize> fault_size(const FoundChange& f, const Background& b, const Eigen::VectorXd& left,
                                     bool linear) const;
  void find_end(FoundChange& f, const Background& b) const;
  void unite(std::vector<FoundChange>& found) const;
  EffectSums sums_of(const FoundChange& f, const Background& b) const;
  void refine_onset(FoundChange& f, const EffectSums& sums, const Background& b) const;
  void onset_interval(const FoundChange& f, const EffectSums& sums, const Background& b,
                      Change& change) const;
  void onset_with_left(const FoundChange& f, const Background& b, Change& change) const;

  const HealthyModel& model_;
  const SampledMotion& motion_;
  const std::vector<ChangeEffect> candidates_;
  const HealthyScores& scores_;
  const FaultScreen screen_;
  const ChangeSettings& settings_;
  const Progress& progress_;
  const std::vector<FoundChange> beside_;
  Whitened first_;
  Eigen::Index beside_column_ = 0;      // the first of what stands beside
  std::vector<ChangeEffect> lasting_;   // that the record has from its beginning, also as healthy ones have
  std::vector<std::string> different_;  // effects that the record has from its beginning
  bool like_fault_ = false;
  std::optional<FoundChange> left_by_shape_;  // the likeliest beside those found, too little to be reported
  const std::size_t margin_, blocks_;
};

}  // namespace backlash::changes
