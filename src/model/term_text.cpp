// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/term_text.h"

#include <vector>

#include "backlash_diagnosis/base/text.h"

namespace backlash::model {
namespace {

std::string value_text(const ParameterSpec& spec, const ParameterValues& values) {
  if (!spec.choices.empty()) return values.choice(spec.name);
  if (!spec.list) return to_text(values.at(spec.name));
  std::vector<std::string> numbers;
  for (const double value : values.list(spec.name)) numbers.push_back(to_text(value));
  return "[" + joined(numbers) + "]";
}

}  // namespace

std::string term_text(const Term& term) {
  std::string text = "  - id: " + term.id + "\n";
  for (const ParameterSpec& spec : term_type(term.id).parameters) {
    text += "    " + spec.name + ": " + value_text(spec, term.values);
    if (spec.choices.empty()) text += "  # " + spec.unit;
    text += "\n";
  }
  return text;
}

}  // namespace backlash::model
