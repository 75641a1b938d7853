// SPDX-License-Identifier: BSD-3-Clause
// A folder with a machine that make_machine drew: its records and its truth.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tools/command_runner.h"

namespace backlash::test {

using Values = std::vector<double>;

inline double rms(const Values& values) {
  double sum = 0;
  for (double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

class MachineFolder : public CommandTest {
 protected:
  Values column(const std::string& name, std::size_t which) const {
    std::istringstream text(read(name));
    std::string line;
    std::getline(text, line);
    Values result;
    while (std::getline(text, line)) {
      std::istringstream cells(line);
      std::string cell;
      for (std::size_t i = 0; i <= which; ++i) std::getline(cells, cell, ',');
      result.push_back(std::stod(cell));
    }
    return result;
  }

  double of(const char* effect, const char* name) const { return truth_["undeclared_effects"][effect][name]; }

  nlohmann::json truth_;
};

}  // namespace backlash::test
