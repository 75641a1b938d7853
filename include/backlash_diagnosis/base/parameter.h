// Named physical parameters: how contact laws and terms declare what they need, so that one loader checks them all.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash {

/// One parameter of a contact law or term: its key in the rig file, SI unit and valid range.
struct ParameterSpec {
  std::string name;
  std::string unit;
  Range range;
  std::string meaning;
};

using ParameterValues = std::map<std::string, double>;

/// Reads exactly the parameters of `specs` from `yaml`; BadData for an absent, wrong or out-of-range value.
ParameterValues read_parameters(const YamlReader& yaml, const std::vector<ParameterSpec>& specs);

}  // namespace backlash
