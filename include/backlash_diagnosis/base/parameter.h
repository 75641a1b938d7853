// SPDX-License-Identifier: BSD-3-Clause
// Named physical parameters: how contact laws and terms declare what they need, so that one loader checks
// them all.
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash {

/// One parameter of a contact law or term: its key in the rig file, SI unit and valid range.
struct ParameterSpec {
  std::string name;
  std::string unit;
  Range range;
  std::string meaning;
  bool list = false;                            // of numbers, each in the range
  std::vector<std::string> choices = {};        // not empty: one of these words instead of a number
  std::optional<double> absent = std::nullopt;  // of a number that need not be given
};

/// Values by name: a number, a list of numbers or a word.
class ParameterValues {
 public:
  ParameterValues() = default;
  ParameterValues(std::initializer_list<std::pair<const std::string, double>> numbers) : numbers_(numbers) {}

  bool has(const std::string& name) const { return numbers_.count(name) > 0; }
  double at(const std::string& name) const { return numbers_.at(name); }
  double& operator[](const std::string& name) { return numbers_[name]; }
  const std::vector<double>& list(const std::string& name) const { return lists_.at(name); }
  void set_list(const std::string& name, std::vector<double> values) { lists_[name] = std::move(values); }
  const std::string& choice(const std::string& name) const { return choices_.at(name); }
  void set_choice(const std::string& name, std::string value) { choices_[name] = std::move(value); }

  friend bool operator==(const ParameterValues& a, const ParameterValues& b) {
    return a.numbers_ == b.numbers_ && a.lists_ == b.lists_ && a.choices_ == b.choices_;
  }

 private:
  std::map<std::string, double> numbers_;
  std::map<std::string, std::vector<double>> lists_;
  std::map<std::string, std::string> choices_;
};

/// Reads exactly the parameters of `specs` from `yaml`; BadData for an absent, wrong or out-of-range value.
ParameterValues read_parameters(const YamlReader& yaml, const std::vector<ParameterSpec>& specs);

}  // namespace backlash
