// SPDX-License-Identifier: BSD-3-Clause
#include "fit_parameter.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/finding.h"
#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::identification {
namespace {

constexpr double kDeclaredStiffness = 3;  // choice: factor, one standard deviation of a declared stiffness
constexpr double kUsualSkew = 1e-3;       // s, choice: scale of the skew of two encoders

}  // namespace

FitParameter machine_parameter(const std::string& name, const model::Rig& rig) {
  const rig_file::RigParameter& p = rig_file::servo_parameter(name);
  if (const double value = p.get(rig); p.positive() && !(value > 0))
    throw InvalidParameter(name, value, "must be > 0");
  const double scale = p.kind == rig_file::ParameterKind::encoder_skew ? kUsualSkew : 1;
  return {p.name, p.unit, p.positive(), scale, p.get, p.set};
}

std::vector<std::function<double(const model::Rig&)>> rows_as_declared(const model::Rig& declared) {
  std::vector<std::function<double(const model::Rig&)>> rows;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    const double value = p.get(declared);
    if (!rig_file::shown_by_deflection(p) || !p.positive() || !(value > 0)) continue;
    if (p.kind == rig_file::ParameterKind::stiffness) {
      rows.emplace_back([get = p.get, value](const model::Rig& rig) {
        return std::log(get(rig) / value) / std::log(kDeclaredStiffness);
      });
      continue;
    }
    rows.emplace_back([get = p.get, value](const model::Rig& rig) {
      return (get(rig) / value - 1) / kDeclaredUncertainty;
    });
  }
  return rows;
}

FitParameter term_parameter(std::size_t term, const std::string& name, const model::Rig& rig, double scale) {
  const std::string id = rig.terms.at(term)->id;
  for (const ParameterSpec& spec : model::term_type(id).parameters) {
    if (spec.name != name) continue;
    // A step of the fit beyond the range of the term goes to its bound.
    const auto set = [term, name, most = spec.range.upper](model::Rig& changed, double value) {
      ParameterValues values = changed.terms[term]->values;
      values[name] = std::min(value, most);
      changed.terms[term] = model::make_term(changed.terms[term]->id, values);
    };
    const bool positive = spec.range.lower == 0 && rig.terms[term]->values.at(name) > 0;
    return {name,
            spec.unit,
            positive,
            scale,
            [term, name](const model::Rig& r) { return r.terms[term]->values.at(name); },
            set};
  }
  throw InvalidParameter(name, id, "is not a parameter of this term");
}

FitParameter list_parameter(std::size_t term, const std::string& name, std::size_t index, double scale) {
  const auto set = [term, name, index](model::Rig& changed, double value) {
    ParameterValues values = changed.terms[term]->values;
    std::vector<double> list = values.list(name);
    list[index] = value;
    values.set_list(name, list);
    changed.terms[term] = model::make_term(changed.terms[term]->id, values);
  };
  return {name,
          "",
          false,
          scale,
          [term, name, index](const model::Rig& rig) { return rig.terms[term]->values.list(name)[index]; },
          set};
}

}  // namespace backlash::identification
