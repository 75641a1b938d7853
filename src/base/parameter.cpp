#include "backlash_diagnosis/base/parameter.h"

namespace backlash {

ParameterValues read_parameters(const YamlReader& yaml, const std::vector<ParameterSpec>& specs) {
  ParameterValues values;
  for (const ParameterSpec& spec : specs) {
    if (spec.list)
      values.set_list(spec.name, yaml.numbers(spec.name, spec.range));
    else
      values[spec.name] = yaml.number(spec.name, spec.range);
  }
  return values;
}

}  // namespace backlash
