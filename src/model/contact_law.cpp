// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/contact_law.h"

#include "backlash_diagnosis/base/error.h"
#include "contact/laws.h"

namespace backlash::model {
namespace {

const ContactLawType* find(const std::string& name) {
  for (const ContactLawType& type : contact_laws())
    if (type.name == name) return &type;
  return nullptr;
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const ContactLawType& type : contact_laws()) all.push_back(type.name);
  return all;
}

}  // namespace

const std::vector<ContactLawType>& contact_laws() {
  static const std::vector<ContactLawType> laws = {
      linear_contact(),       power_law_contact(),           hunt_crossley_contact(),
      kelvin_voigt_contact(), herbert_mcwhannell_contact(),  yang_sun_contact(),
      jankowski_contact(),    lankarani_nikravesh_contact(), stereomechanical_contact(),
      foundation_contact(),   hertz_in_series_contact()};
  return laws;
}

ContactSpec read_contact_spec(const YamlReader& yaml) {
  const ContactLawType& type = *find(yaml.choice("law", names()));
  return {type.name, read_parameters(yaml, type.parameters)};
}

std::shared_ptr<const ContactLaw> make_contact_law(const std::string& name, const ParameterValues& values) {
  const ContactLawType* type = find(name);
  if (!type) throw InvalidParameter("contact.law", name, "is not a known contact law");
  for (const ParameterSpec& spec : type->parameters) {
    if (!values.has(spec.name))
      throw InvalidParameter("contact." + spec.name, "absent", "is required by " + name);
    if (const double value = values.at(spec.name); !spec.range.contains(value))
      throw InvalidParameter("contact." + spec.name, value, spec.range.text() + " " + spec.unit);
  }
  std::unique_ptr<ContactLaw> law = type->create(values);
  law->made_of = {name, values};
  return law;
}

}  // namespace backlash::model
