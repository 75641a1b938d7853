#include "backlash_diagnosis/base/parameter.h"

namespace backlash {

ParameterValues read_parameters(const YamlReader& yaml, const std::vector<ParameterSpec>& specs) {
  ParameterValues values;
  for (const ParameterSpec& spec : specs) values[spec.name] = yaml.number(spec.name, spec.range);
  return values;
}

}  // namespace backlash
