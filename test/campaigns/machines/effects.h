// SPDX-License-Identifier: BSD-3-Clause
// What a machine may have that the declared model lacks: the named effects of the dictionary, and such as no
// dictionary holds. Each draws its own strength, noticeable but no larger than in the records of undeclared/.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine.h"
#include "random.h"
#include "run.h"

namespace machines {

struct Circumstances {
  double duration = 30;  // s, of a record
  Travel travel;         // rad, that both records share
  double order = 0;      // 1/rad, of every wave over a position; 0: drawn
  double strength = 1;   // times what is drawn of each effect
};

struct Effect {
  std::string id;
  bool in_dictionary;
  std::vector<std::string> indistinguishable;  // other names for the same from such records
  nlohmann::ordered_json (*add)(Random&, const Circumstances&, Machine&);  // says what it drew
};

const std::vector<Effect>& all_effects();

/// Throws std::invalid_argument for an id that all_effects() lacks.
const Effect& effect(const std::string& id);

}  // namespace machines
