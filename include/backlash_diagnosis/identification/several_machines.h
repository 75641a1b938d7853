// SPDX-License-Identifier: BSD-3-Clause
// Records that contradict each other and not the model: the declared machine meets each by itself, with
// values of its own, and not all together. They are of different machines, of one that has changed between
// them, or of one with an effect that none of them shows by itself.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

/// What the declared machine makes of a record alone.
struct RecordAlone {
  std::string record;                              // its name
  std::map<std::string, signal::Measured> values;  // of the machine
  double left = 0;                                 // times the noise, of the channel of which more is left
};

struct SeveralMachines {
  std::vector<RecordAlone> records;
  double together = 0;             // times the noise, what is left of all records together
  std::vector<std::string> names;  // of the values that clearly differ, the clearest first
};

struct SeveralSettings {
  double at_noise = 1.3;       // simulation: times the noise: a record that is met
  double much_less = 0.2;      // choice: of what all records together leave: met as well
  double least_change = 0.02;  // choice: of a value
  double least_z = 5;          // choice: standard errors
};

/// Whether so much may be left of a record alone, where all together leave `together` times the noise.
bool is_met(double left, double together, const SeveralSettings& settings = {});

/// Nothing where a record is not met by itself, or no value that all of them determine clearly differs.
std::optional<SeveralMachines> several_machines(std::vector<RecordAlone> records, double together,
                                                const SeveralSettings& settings = {});

/// Widens the errors of values that stand for all of them: as unsure as theirs are apart.
void allow_for_several(const SeveralMachines& several, std::map<std::string, signal::Measured>& parameters);

/// In one or two sentences, without the last full stop. `units` as in the rig file; `linear`: of an axis.
std::string description(const SeveralMachines& several, const std::map<std::string, std::string>& units,
                        bool linear);

}  // namespace backlash::identification
