// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/term.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/register_term.h"
#include "terms/terms.h"

namespace backlash::model {

namespace {

std::vector<TermType>& registry() {
  static std::vector<TermType> types = {asymmetric_coulomb_term(),
                                        asymmetric_viscous_term(),
                                        backlash_term(),
                                        backlash_map_term(),
                                        cogging_term(),
                                        delay_term(),
                                        eccentricity_term(),
                                        encoder_scale_term(),
                                        friction_drift_term(),
                                        gravity_term(),
                                        learned_map_term(),
                                        load_dependent_friction_term(),
                                        local_fault_term(),
                                        mesh_hardening_term(),
                                        mesh_hysteresis_term(),
                                        position_dependent_friction_term(),
                                        presliding_term(),
                                        quadratic_drag_term(),
                                        square_root_friction_term(),
                                        radial_compliance_term(),
                                        stribeck_term(),
                                        transmission_error_term(),
                                        varying_backlash_term(),
                                        varying_reduction_ratio_term()};
  return types;
}

}  // namespace

const std::vector<TermType>& term_types() {
  return registry();
}

void register_term(TermType type) {
  for (const TermType& known : registry())
    if (known.id == type.id) throw InvalidParameter("id", type.id, "is a term already");
  registry().push_back(std::move(type));
}

double order_resolution(const MotionRange& range) {
  const double travel = range.to - range.from;
  return travel > 0 ? 2 * M_PI / travel : std::numeric_limits<double>::infinity();
}

const TermType& term_type(const std::string& id) {
  for (const TermType& type : term_types())
    if (type.id == id) return type;
  throw InvalidParameter("id", id, "is not a known term");
}

const TermType& term_type_that(bool (*can)(const TermType&)) {
  for (const TermType& type : term_types())
    if (can(type)) return type;
  throw InvalidParameter("term", "of this kind", "is not in the registry");
}

namespace {

std::shared_ptr<const Term> created(const TermType& type, const ParameterValues& values) {
  std::unique_ptr<Term> term = type.create(values);
  term->id = type.id;
  term->values = values;
  return term;
}

void check(const ParameterSpec& spec, double value) {
  if (!spec.range.contains(value)) throw InvalidParameter(spec.name, value, spec.range.text());
}

void check_choice(const ParameterSpec& spec, const std::string& value) {
  if (std::find(spec.choices.begin(), spec.choices.end(), value) != spec.choices.end()) return;
  throw InvalidParameter(spec.name, value, "must be one of " + joined(spec.choices));
}

}  // namespace

std::shared_ptr<const Term> make_term(const std::string& id, const ParameterValues& given) {
  const TermType& type = term_type(id);
  ParameterValues values = given;
  for (const ParameterSpec& spec : type.parameters)
    if (spec.absent && !values.has(spec.name)) values[spec.name] = *spec.absent;
  for (const ParameterSpec& spec : type.parameters) {
    if (!spec.choices.empty()) {
      check_choice(spec, values.choice(spec.name));
    } else if (spec.list) {
      for (const double value : values.list(spec.name)) check(spec, value);
    } else {
      check(spec, values.at(spec.name));
    }
  }
  return created(type, values);
}

Sensing sensing(const std::vector<std::shared_ptr<const Term>>& terms) {
  Sensing sum;
  for (const auto& term : terms) term->sense(sum);
  return sum;
}

std::shared_ptr<const Term> read_term(const YamlReader& yaml) {
  std::vector<std::string> ids;
  for (const TermType& type : term_types()) ids.push_back(type.id);
  const std::string id = yaml.choice("id", ids);
  const TermType& type = term_type(id);
  try {
    return created(type, read_parameters(yaml, type.parameters));
  } catch (const InvalidParameter& error) {  // of values that do not go together
    yaml.fail(error.name(), error.limit() + ", not " + error.value());
  }
}

}  // namespace backlash::model
