// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/parameter.h"

namespace backlash {

ParameterValues read_parameters(const YamlReader& yaml, const std::vector<ParameterSpec>& specs) {
  ParameterValues values;
  for (const ParameterSpec& spec : specs) {
    if (!spec.choices.empty())
      values.set_choice(spec.name, yaml.choice(spec.name, spec.choices));
    else if (spec.list)
      values.set_list(spec.name, yaml.numbers(spec.name, spec.range));
    else if (spec.absent)
      values[spec.name] = yaml.number_or(spec.name, *spec.absent, spec.range);
    else
      values[spec.name] = yaml.number(spec.name, spec.range);
  }
  return values;
}

}  // namespace backlash
