// SPDX-License-Identifier: BSD-3-Clause
// Every number that steers the search for missing effects, one struct per step. Each with its unit and its
// origin: theory, simulation (tried on simulated machines whose truth is known) or choice (what is asked for,
// or the time that the search may take).
#pragma once

#include <cstddef>
#include <cstdint>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/identification/fit/fit_settings.h"

namespace backlash::identification {

/// Which candidates there are, from sensitivities alone.
struct ScreenSettings {
  double probe =
      0.02;  // theory: of a strength that shows clearly, for differences above the noise of the simulation
  double least_own =
      1e-3;  // theory: of a sensitivity, to be left after what the machine's own parameters explain
  std::size_t peaks = 4;  // choice (time): of the spectrum of the residual, orders that are tried
};

/// Which candidates are fitted with the machine, and how.
struct TrialSettings {
  std::size_t most = 6;       // choice (time): candidates
  double worth_trying = 0.2;  // choice: of the best predicted gain
  double least_predicted =
      0.3;  // simulation: of the gain that is asked for; sensitivities mislead by so much
  double tie =
      0.005;  // choice: of the residuals: then the term with the fewest shapes, gravity before cogging
};

/// When an effect is believed (least gains: TraceSettings).
struct AcceptanceSettings {
  int blocks = 12;                // choice: of each record, each left out once
  double least_in_noise = 0.006;  // choice: gain that always is enough in a residual that is mostly noise
  double sure = 5.5;      // theory: standard deviations that noise does not reach in a thousand trials
  double near_floor = 2;  // choice: times the floor: what is left is mostly noise
  double noise = 0.01;  // choice: of the signal: a floor above it may hide something, what is below may stay
};

/// When a set of effects is good enough, or another is better.
struct RevisionSettings {
  double at_floor =
      1.03;  // theory: times the floor, which is itself known to some per cent: nothing can be found
  double clearly_right = 1.3;  // simulation: times the floor: no other order, no other set needs to be tried
  double clearly_less = 0.9;   // choice: of a residual: worth another set of effects
  double as_good = 1.02;       // choice: of a residual: then fewer parameters are better
  double alike = 0.8;          // choice: of the best gain: another name for the same
  double half = 0.5;           // choice: of a residual: an effect that explains less may stand in for another
};

/// Learned maps, where no named effect explains what is left.
struct MapSettings {
  double something_left = 1.25;  // simulation: times the floor
  std::size_t trials = 2;        // choice (time): maps that are fitted with the machine
  std::size_t nearest = 3;       // choice: named effects that are reported beside a map
  double probe = 0.05;           // theory: of a strength that shows clearly, as ScreenSettings::probe
  double tail = 0.002;           // choice: of the samples, beyond the outer points
  double ridge = 1e-6;           // theory: of the mean squared sensitivity: decides what nothing else does
  int blocks = 12;               // choice: of each record, for cross-validation
  double smoothest = 1e5,
         roughest = 1e-4;  // choice: of the mean squared sensitivity, weights of curvature that are tried
};

/// What the unseen record must bear out.
struct BeliefSettings {
  int blocks = 20;                 // choice: of the record, drawn with replacement: several reversals each
  int draws = 400;                 // choice (time)
  std::uint64_t seed = 1;          // choice
  double risk = 0.05;              // choice: beyond both ends of an interval
  double least_part = 0.1;         // choice: of what lies above the noise, that an effect must explain
  double least_part_of_map = 0.5;  // choice: the same, of a map, which can take any shape
  // Of the other channel's error; by more it may get worse by a part of what this one gains, each in its
  // noise: the fit weighs both. Choices.
  double worse = 0.05, price = 0.1;
  double least_z = 4;  // choice: of a strength, standard errors
  // Where more is left than so many times the noise: of a strength, in a part of the records that holds this
  // share of what the effect does, and shows it within this error: as far off, by so many standard errors, is
  // another effect. Choices.
  double beyond_noise = 2, least_constant = 0.5, least_share = 0.1, part_error = 0.3, clearly = 3;
};

/// What a residual may still follow (explainable.h).
struct ExplainableSettings {
  int blocks = 12;  // choice: of each record, each predicted from the others
  int knots = 24, knots_of_pair = 7,
      knots_of_time = 6;            // choice: of a function of one state, of two, of time
  std::size_t orders = 4;           // choice: waves over the position
  std::size_t most_samples = 6000;  // choice (time)
  std::size_t least_samples = 200;  // choice: fewer show nothing
  double near_zero = 0.1;           // choice: share of a residual: less is nothing that matters
  double worth_saying = 0.01;  // choice: of the signal: what is smaller lies within what any model neglects
  double far = 10, worth_saying_far = 0.001;  // simulation: the same, of what is so many times the floor
  double part_of_explained = 0.3;             // choice: of what effects explain: they must not leave as much
  double worth_naming = 0.05;                 // choice: share of a residual, of a single state
  double clear = 2;   // choice: times the floor of the sensors, beyond which noise needs a word
  double uneven = 4;  // theory: coloured noise with ten values in a part stays below
  // Choices: of what follows nothing, times the floor, and of the signal; the same far beyond the floor.
  double beyond = 4, much = 0.07, very_far = 20, much_very_far = 0.02;
};

struct SearchSettings {
  explicit SearchSettings(const TraceSettings& trace = {}) : asked(trace) {
    fit.cutoff = trace.cutoff;
    // The search makes hundreds of fits, each from the end of another: fewer steps and starts are enough
    // (time).
    fit.iterations = 12;
    fit.other_starts = 4;
    fit.tolerance = 1e-5;
    fit.calibration_delay =
        0.5;  // theory: samples, as far as a held torque may be misjudged; more is an effect
  }

  TraceSettings asked;
  FitSettings fit;
  ScreenSettings screen;
  TrialSettings trials;
  AcceptanceSettings acceptance;
  RevisionSettings revision;
  MapSettings maps;
  BeliefSettings belief;
  double shape_of_friction = 0.01;  // choice: of the signal: less is how friction begins, not an effect
  double shape_of_all_torque =
      0.03;  // choice: the same of one inertia, whose torque is friction for the most part
  ExplainableSettings explainable;
};

}  // namespace backlash::identification
