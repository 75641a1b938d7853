// SPDX-License-Identifier: BSD-3-Clause
// What the search for changes of a machine rests on, and where each number comes from.
#pragma once

#include <cstddef>

namespace backlash::changes {

struct ChangeSettings {
  double false_alarms_per_hour = 1.0 / 720;  // 1/h, one a month

  // Signals
  double cutoff = 12;                   // Hz, of torque and columns. Choice: tasks of arms end below
  double cutoff_share = 0.125;          // - of the sampling rate at most. Choice
  double position_cutoff = 20;          // Hz, before it is differentiated. Choice
  double position_cutoff_share = 0.16;  // - of the sampling rate at most. Choice
  double most_rate = 160;               // Hz, that is looked at: faster records are thinned. Choice
  double rate_share = 4.5;              // -, sampling rate that is kept over the cutoff. Theory: above 2
  double slow = 0.05;                   // - of the rms speed: slower counts for nothing. Choice
  double friction_speed = 0.02;         // - of the rms speed, over which dry friction turns. Choice
  double guard = 1.06;                  // / cutoff, about a reversal. Simulation: bristles and filter settle
  double fast = 1.2;                    // - of the fastest healthy speed: no extrapolation. Choice
  double spike =
      30;  // mean differences from the median of three: no noise. Choice: 11 is the most of a million
  double jump = 1.5;            // of the fastest speed, or hardest acceleration, that is extrapolated to: no
                                // motion. Choice: a slip of 0.02 rad at 125 Hz is 2
  std::size_t jump_guard = 6;   // guards about it. Theory: filters have rung out to 1e-10 of it
  double gap = 2.5;             // intervals between samples that are none. Choice
  double longest_gap = 600;     // s. Choice: the machine has another temperature then
  double shortest = 30;         // s, of usable motion in a record. Choice
  double shortest_of_two = 15;  // s, the same of two inertias, between changes of the flank. Choice
  double shortest_of_arm = 8;   // s, the same of a joint of an arm. Choice: what pulls at it is known
  double shortest_pressed = 8;  // s, the same with a flank pressed for certain, for the deflection. Choice

  double least_load = 0.05;  // - of the largest load of the teeth: less presses no flank for certain. Choice

  // The healthy machine
  double least_share = 0.03;  // - of the squares of the residual that a further column explains. Choice
  int most_columns = 8;       // further columns. Choice
  double prior_share = 0.02;  // - of a value, its own spread from day to day. Choice
  double prior_least = 1e-3;  // - of the rms torque. Choice
  double prior_factor = 2;    // -, of the difference between records. Choice: few records
  double drift = 0.1;         // - of dry friction over a record, by temperature. Choice
  // Dry and viscous friction wander from minute to minute. Bittencourt and Axelsson (LiTH-ISY-R-3058) measure
  // more by temperature alone. Choices.
  double wander = 0.03;       // -, of each, standard deviation
  double wander_time = 100;   // s, over which
  double chain_share = 0.02;  // - of what the rest of an arm takes, that a joint may show otherwise. Choice:
                              // torque constants fall by as much as windings warm up by 10 K (magnets 0.1 to
                              // 0.2 %/K)
  double rest = 10;           // s without motion, after which the machine has another temperature. Choice

  // Machines with a torque sensor before the gear: stretches of some reversals that are fitted, each of which
  // takes about a second of a processor. Choices.
  int rig_healthy_stretches = 8;  // of all healthy records
  int rig_stretches = 12;         // spread over the record
  int rig_refinements = 16;       // further ones about onsets, at most: five halves each, and room for more

  // Changes
  double window = 4;   // s, over which scores are summed. Choice: longer than the residual remembers
  double block = 0.2;  // s, resolution of the onset. Choice
  double margin = 8;   // s at either end in which no change begins. Choice
  double least_explained = 0.1;  // - of the squares of the residual after the onset. Choice
  double over_healthy = 2;      // of the largest gain that growth of friction has in a healthy record. Choice
  double least_steadily = 0.5;  // - of a change that shows where friction may not wander. Choice
  double learned_from_one = 2;  // of the threshold, of a joint of an arm of which one record is healthy: how
                                // far another task is from it is not known. Measured: a UR10e needs 1.6
  double least_of_two = 0.003;  // - of the rms target of two inertias, that it explains at least: teeth that
                                // ring and cross the gap leave as much. Choice
  double errors_of_side = 4;    // standard errors of the share of friction that loads the teeth. Choice
  double worst_side = 0.4;      // -, of that share from 0 or 1, with its errors. Choice: 0.5 is neither
  double undone = 0.3;          // - of a change's size, that one which takes it back may leave. Choice
  double same_event = 5;        // s: two that begin so close may be one whose shape is another. Choice
  double least_beside = 0.25;   // - of the gain of the other that a second one of an event has. Choice
  double errors_of_mass = 4;    // standard errors, by which a payload has a mass. Choice
  double largest_slip = 0.3;    // rad, of an encoder. Theory: its sine is 1.5 % smaller
  double farthest_centre = 2;   // m from its joint, that a payload's centre may be. Choice
  int most_changes = 4;         // Choice
  double onset_drop = 8;        // of twice the log likelihood, as wide as the onset is uncertain. Simulation
  double onset_least = 0.1;     // s, half of the narrowest interval. Choice
  // Squares of the residual over those of the healthy machine, of what no effect explains: beyond it the
  // answer is "cannot tell", or a change. Choices. Simulation of healthy machines in other tasks: one inertia
  // 2, two 5.
  double unknown_louder = 4, unknown_of_two = 16;
  // The same of a long stretch over the rest of the record, in motion alike: too little to be a change, too
  // much to be healthy. Choices.
  double louder = 1.5;              // - of the squares
  double louder_errors = 6;         // standard errors that this differs by
  double alike_errors = 3;          // standard errors that means of the motion may differ by
  std::size_t louder_windows = 16;  // of the stretch, and of the rest
  std::size_t least_windows = 4;    // that it lasts. Choice: a push is no change of the machine
  double same_link = 0.3;  // - of the squares left by which a payload at another link does better. Choice
  double distinguished =
      8;  // of twice the log likelihood, by which effects are distinguished. Theory: 2.8 deviations
  double alike = 0.97;        // - of the best gain: effects that fit alike. Choice
  double model_error = 0.03;  // - of a size, as the shape of an effect is an idealisation. Choice
};

}  // namespace backlash::changes
