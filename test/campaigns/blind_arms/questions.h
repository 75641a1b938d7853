// SPDX-License-Identifier: BSD-3-Clause
// What the package is asked of the drawn arms, and how its answers are counted.
#pragma once

#include <cstdint>
#include <string>

namespace blind_arms {

struct Options {
  std::string ask = "encoders";  // encoders, motors, changes, effects
  std::string kind = "all";
  std::uint64_t seed = 1000;
  int arms = 10;
  double duration = 40;  // s, of each record
  std::string out;       // folder of the records
  std::string json;      // file of the answers
};

/// Return how many answers were wrong and sure.
int ask_plays(const Options& options);
int ask_changes(const Options& options);  // and effects

}  // namespace blind_arms
