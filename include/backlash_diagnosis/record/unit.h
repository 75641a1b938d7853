// SPDX-License-Identifier: BSD-3-Clause
// Units that a column of a CSV may have, and which of them a channel can be read from. One table.
#pragma once

#include <string>
#include <string_view>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

enum class Quantity { time, position, velocity, acceleration, effort, current, raw };

struct Unit {
  const char* name;
  Quantity quantity;
  bool angular;   ///< rad, N m and their rates, against m, N; means nothing for time, current and raw
  double factor;  ///< SI value of 1; with `divides` how many of it are 1 in SI
  bool divides;   ///< 3 ms are 3 / 1000 s, which rounds once

  double si(double value) const { return divides ? value / factor : value * factor; }
  bool same_as(const Unit& other) const;  ///< another name for the same
};

/// The unit of that name; nullptr where it is not in the table. `raw` is what a sensor gives (counts, volts),
/// `hh:mm:ss` a time of day.
const Unit* find_unit(std::string_view name);

/// "s, ms, us, ...": all units, or those that a channel can have.
std::string known_units();
std::string known_units(Channel channel, bool linear);

/// Why a column in this unit is not that channel; empty where it is. On a linear axis positions and torques
/// are in m and N. With `scaled`, a scale is declared: raw values, a current as a torque, and what a lever,
/// drum or spindle turns into each other (m and rad, N and N m) are then converted by it.
std::string misfit(const Unit& unit, Channel channel, bool linear, bool scaled);

/// What stands in a header: "Motor speed (rpm)" is the name "Motor speed" in the unit "rpm". Brackets are the
/// last, () or []; `has_unit` is false where there are none.
struct Label {
  std::string_view name, unit;
  bool has_unit = false;
};
Label label_of(std::string_view text);

}  // namespace backlash::record
