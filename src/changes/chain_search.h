// SPDX-License-Identifier: BSD-3-Clause
// Changes that several joints of an arm show at once: the scores of the joints add up.
#pragma once

#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "chain_motion.h"
#include "channel_changes.h"

namespace backlash::changes {

/// One joint of an arm: a channel of its own.
struct ArmJoint {
  std::string name;
  std::size_t index = 0;  // in the chain
  HealthyModel model;
  SampledMotion motion;
  std::optional<HealthyScores> scores;
  std::vector<double> chain_inflation;  // of the scores of each of chain_effects()
  std::vector<FoundChange> beside;      // of the chain, as this joint shows them
  std::optional<ChangeSearch> search;   // beside these
  std::vector<FoundChange> found;       // of its own
};

struct FoundChainChange {
  ChainEffect effect;
  std::size_t from = 0, to = 0;  // blocks
  EffectSums::Score score;
  double inflation = 1;
  double low = 0, high = 0;        // s, of the onset
  double error_before = 0;         // N m, rms of all joints without it, while it lasts
  std::vector<std::string> alike;  // others that explain it as well, in words

  /// The size has this error, noise that follows the effect included.
  double error(Eigen::Index i) const { return std::sqrt(inflation * score.covariance(i, i)); }
};

/// "payload at LINK", "encoder_slip of JOINT".
std::string described(const ChainEffect& effect, const arm::Chain& chain);

class ChainSearch {
 public:
  ChainSearch(const std::deque<ArmJoint>& joints, const arm::Chain& chain, const ChangeSettings& settings);

  /// The best change beside those found in the joints and the chain; none where none is believed.
  std::optional<FoundChainChange> best(const std::vector<FoundChainChange>& found) const;

 private:
  /// One effect in all joints.
  struct Sums {
    std::vector<EffectSums> joints;
  };
  Sums sums_of(const ChainEffect& effect) const;
  EffectSums::Score score(const Sums& sums, std::size_t from, std::size_t to,
                          const ChainEffect& effect) const;
  FoundChainChange scanned(std::size_t effect) const;
  std::optional<FoundChainChange> chosen() const;
  bool plausible(const FoundChainChange& f) const;
  double cost(const FoundChainChange& f) const;
  void refine(FoundChainChange& f, const Sums& sums) const;
  void find_end(FoundChainChange& f, const Sums& sums) const;
  void set_onset(FoundChainChange& f, const Sums& sums) const;
  double noisier(const FoundChainChange& f) const;
  bool believed(const FoundChainChange& f) const;
  bool further(const FoundChainChange& f, const std::vector<FoundChainChange>& found) const;

  const std::deque<ArmJoint>& joints_;
  const arm::Chain& chain_;
  const std::vector<ChainEffect> effects_;
  const ChangeSettings& settings_;
  std::vector<Background> backgrounds_;  // of the joints
  std::size_t margin_, blocks_ = 0;
  double rows_ = 0;
};

}  // namespace backlash::changes
