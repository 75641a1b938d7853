#include "backlash_diagnosis/model/term.h"

#include "backlash_diagnosis/base/error.h"
#include "terms/terms.h"

namespace backlash {

const std::vector<TermType>& term_types() {
  static const std::vector<TermType> types = {
      backlash_map_term(),           eccentricity_term(),       gravity_term(),
      radial_compliance_term(),      transmission_error_term(), varying_backlash_term(),
      varying_reduction_ratio_term()};
  return types;
}

std::shared_ptr<const Term> read_term(const YamlReader& yaml) {
  std::vector<std::string> ids;
  for (const TermType& type : term_types()) ids.push_back(type.id);
  const std::string id = yaml.choice("id", ids);
  for (const TermType& type : term_types()) {
    if (type.id != id) continue;
    try {
      return type.create(read_parameters(yaml, type.parameters));
    } catch (const InvalidParameter& error) {  // of values that do not go together
      yaml.fail(error.name(), error.limit() + ", not " + error.value());
    }
  }
  yaml.fail("id", "is not a known term");  // choice() has refused it already
}

}  // namespace backlash
