// SPDX-License-Identifier: BSD-3-Clause
// The search for named effects: stage after stage, one effect each.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "candidates.h"
#include "stage.h"
#include "validation.h"

namespace backlash {

/// An effect that was accepted.
struct Accepted {
  Candidate candidate;  // with fitted values
  Gain gain;
  std::vector<std::string> equivalent_to;
  std::vector<Candidate> alternatives;  // those, as fitted
  std::vector<std::string> nearest;     // of a learned map: named effects that explain part of the same
  Machine after;                        // fitted with this effect and those before it
};

constexpr double kNearFloor = 2;       // times the floor: what is left is mostly noise
constexpr double kClearlyRight = 1.3;  // times the floor: no other order, no other set needs to be tried
constexpr double kHalf = 0.5;          // of a residual: an effect that explains less may stand in for another

/// What the term of this id is for the search (model/term.h).
bool is_learned(const std::string& id);
bool is_delay(const std::string& id);
bool stands_in_for_contact_law(const std::string& id);

bool is_friction(const std::string& parameter);

class Search {
 public:
  Search(const Rig& declared, const std::vector<ServoData>& train, double cutoff,
         const TraceSettings& settings, const Progress& progress);

  void run();
  /// The declared machine, fitted.
  const Stage& base() const { return *declared_base_; }
  /// What effects are added to: base(), or the same with other teeth.
  const Stage& start() const { return *base_; }
  bool other_teeth() const { return other_teeth_; }
  const Stage& stage() const { return *stage_; }
  const std::vector<Accepted>& effects() const { return effects_; }
  /// What an effect changes of the signal, of the channel where that is more; all terms of this id together.
  double share(const std::string& id) const;
  /// Parameters of the machine that are held at 0 in stage().
  const std::vector<std::string>& held() const { return held_; }

 private:
  struct Trial {
    Candidate candidate;
    Machine start;
    MachineFit fit;
    double misfit = 0;  // norm of all residuals
  };

  /// Fits the declared machine.
  void fit_base();
  /// Adds named effects until nothing helps.
  void add_effects();
  /// Takes out what the others explain as well.
  void drop_superfluous();
  /// An early effect may have stood in for a later one: where much is left, sets without it are tried.
  void reconsider();
  /// What explains the same alone may explain more, or the same with less, beside the others.
  void try_equivalents();

  /// Where named effects leave much: what a learned map makes of it.
  void add_learned();
  /// Named effects that leave more than they explain may be stand-ins for what has no name.
  void drop_stand_ins();

  /// What hardens may be teeth of another shape than declared, and is then no effect; whether it was.
  bool try_other_teeth();
  void put_on(const Rig& teeth);

  void hold_friction();
  void declare_parameters();
  void start_in_travel();
  double share_done() const;
  void tell_best() const;
  void report(const std::string& phase) const;
  std::vector<std::string> parameter_names() const;
  Machine with_effects(const std::vector<Accepted>& effects) const;
  Stage rough_base() const;
  std::optional<Trial> tried(const Candidate& candidate,
                             double wanted = std::numeric_limits<double>::infinity()) const;
  std::optional<Candidate> neighbour(const Candidate& candidate, std::size_t term, const TermShape& shape,
                                     long step) const;
  std::vector<Trial> tried_best(const std::vector<Candidate>& candidates) const;
  Trial best_neighbour(Trial trial) const;
  bool add_one();
  bool add_map();
  Machine extended(Machine machine, const Candidate& candidate) const;
  double least_gain_in_noise() const;
  bool convinces(const Gain& gain, const Machine& after) const;
  /// Fits with these effects at their own weights; false, and nothing changes, where that fails.
  bool adopt(std::vector<Accepted> effects);
  /// Takes an effect out; what came after it is fitted again, one by one.
  void drop(std::size_t effect);
  bool dropped(std::size_t effect);

  const std::vector<ServoData>& data_;
  double cutoff_;
  TraceSettings settings_;
  const Progress& progress_;
  mutable std::string phase_;  // latest reported
  mutable double done_ = 0;    // share of the work
  MotionRange range_;
  Machine declared_;
  std::optional<Stage> declared_base_, base_, stage_;
  bool other_teeth_ = false, teeth_settled_ = false;
  std::size_t teeth_tried_with_ = 0;  // effects
  std::vector<Accepted> effects_;
  std::vector<std::string> held_;
};

}  // namespace backlash
