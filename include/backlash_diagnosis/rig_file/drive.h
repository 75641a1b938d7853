// SPDX-License-Identifier: BSD-3-Clause
// What turns in a drive, and how often per turn of the load: a part shows in a residual by the order of its
// turns (Randall 1982, J. Mech. Des. 104:259: mesh frequencies and their multiples).
//
// With R motor turns per turn of the load, p pole pairs, stages of z1 driving z2 teeth:
//   motor R, its magnets R p, wave generator 2 R (two lobes: two passes of the teeth per turn)
//   teeth of a stage s z1, the shaft behind it s z1 / z2, s: turns of the shaft before it, R at first
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/parameter.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::rig_file {

/// The section `drive:` of a rig file; all of it optional.
struct Drive {
  struct Stage {
    long driving = 0, driven = 0;  // teeth
  };
  double reduction_ratio = 0;  // motor turns per load turn; 0: not stated
  std::vector<Stage> stages;   // from the motor to the load
  long pole_pairs = 0;         // of the motor; 0: not stated
  bool wave_generator = false;
};

struct TurningPart {
  std::string name;  // "once per motor turn"
  double order;      // per turn of the load
};

/// `otherwise`: the ratio where the drive states none. Throws BadData for teeth that contradict the ratio.
Drive read_drive(const YamlReader& drive, double otherwise);

/// All that turns, the fastest last; empty of a drive that states no ratio.
std::vector<TurningPart> turning_parts(const Drive& drive);

/// Which of the parts an order can be, a line of some 100 characters: "once per motor turn, 110; not ...".
/// A part is meant where the order, within twice its standard error and a thousandth, is its order or up to
/// the sixth multiple. Empty where the drive states no parts.
std::string part_of_order(const Drive& drive, double order, double standard_error);

}  // namespace backlash::rig_file
