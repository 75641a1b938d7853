// SPDX-License-Identifier: BSD-3-Clause
#include "found_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "../fit/valley.h"
#include "backlash_diagnosis/model/term_columns.h"
#include "learned.h"
#include "unseen_gain.h"

namespace backlash::identification {
namespace {

/// Of a learned map: where its coordinate reaches and how large it gets.
void describe_map(const model::Term& term, std::vector<signal::Measured>& fitted, FoundEffect& effect) {
  const model::TermMap& map = *model::term_type(term.id).map;
  const model::MapKind& kind = kind_of(term.values);
  effect.words = {{map.acts_on, kind.acts_on}, {map.coordinate, kind.coordinate}};
  effect.curve_x = term.values.list(map.points);
  effect.curve_y = term.values.list(map.values);
  const std::string &x = kind.coordinate, &unit = kind.coordinate_unit;
  const auto largest = std::max_element(effect.curve_y.begin(), effect.curve_y.end(),
                                        [](double a, double b) { return std::fabs(a) < std::fabs(b); });
  const signal::Measured at_largest{*largest,
                                    fitted[std::size_t(largest - effect.curve_y.begin())].standard_error};
  effect.parameters = {{x + "_from", unit, {effect.curve_x.front(), 0}},
                       {x + "_to", unit, {effect.curve_x.back(), 0}},
                       {"largest", kind.unit, at_largest}};
  fitted.erase(fitted.begin(), fitted.begin() + long(effect.curve_y.size()));
}

/// Parameters and words of an effect's term; what was not fitted but chosen among values has the error 0, an
/// order that the travel does not resolve a part of the resolution.
void describe(const model::Term& term, const Candidate& candidate, std::size_t t, const std::string& suffix,
              std::vector<signal::Measured>& fitted, FoundEffect& effect) {
  const model::TermType& type = model::term_type(term.id);
  if (type.map) return describe_map(term, fitted, effect);
  const model::TermSearch& search = *type.search;
  std::map<std::string, signal::Measured> found;
  const auto take = [&](const std::string& name) {
    found[name] = fitted.front();
    fitted.erase(fitted.begin());
  };
  take(search.strength);
  if (!search.phase.empty()) take(search.phase);
  for (const model::TermShape& shape : search.shapes)
    if (shape.wave && t < candidate.held_orders.size())
      found[shape.name] = {term.values.at(shape.name), candidate.held_orders[t]};
  for (const model::TermShape* shape : fitted_shapes(candidate, t)) take(shape->name);
  for (const ParameterSpec& spec : type.parameters) {
    if (!spec.choices.empty()) {
      effect.words[spec.name + suffix] = term.values.choice(spec.name);
      continue;
    }
    const auto at = found.find(spec.name);
    const signal::Measured m =
        at != found.end() ? at->second : signal::Measured{term.values.at(spec.name), 0};
    effect.parameters.push_back({spec.name + suffix, spec.unit, m});
  }
}

/// Each other effect that reaches most of the gain, once, and what is none and looks the same.
std::vector<std::string> ids_of(const Effect& effect) {
  std::vector<std::string> ids;
  for (const Fitted& alternative : effect.alternatives) {
    const std::string& id = alternative.candidate.id;
    if (id != effect.candidate.id && std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
  }
  for (const std::string& other : model::looks_like(model::term_type(effect.candidate.id)))
    ids.push_back(other);
  return ids;
}

}  // namespace

std::size_t fitted_count(const Candidate& candidate, std::size_t t) {
  const model::TermType& type = model::term_type(candidate.id);
  if (type.map) return candidate.terms[t].list(type.map->values).size();
  return (type.search->phase.empty() ? 1 : 2) + fitted_shapes(candidate, t).size();
}

FittedValues fitted_values(const BandFit& fitted, std::size_t declared) {
  MachineFit fit = fitted.fit;
  judge_errors(fit, fitted.start, fitted.records);
  const Unknowns unknowns(fitted.start);
  FittedValues out;
  for (std::size_t i = 0; i < fitted.start.parameters.size(); ++i) {
    const signal::Measured m = unknowns.parameter(fit, i);
    if (i < declared)
      out.machine[fitted.start.parameters[i].name] = m;
    else
      out.effects.push_back(m);
  }
  return out;
}

void allow_for_valley(FittedValues& values, const BandFit& fitted, const FitSettings& settings) {
  BandFit best = fitted;  // the machine itself stays: the unseen record was judged by it
  const std::map<std::string, double> valley = search_valley(best, settings);
  if (valley.empty()) return;
  for (const FitParameter& p : fitted.start.parameters)
    if (const auto at = values.machine.find(p.name); at != values.machine.end())
      at->second.standard_error = std::hypot(at->second.standard_error, valley.at(p.name),
                                             p.get(best.fit.machine.rig) - p.get(fitted.fit.machine.rig));
}

std::vector<FoundEffect> found_effects(const Hypothesis& h, std::vector<signal::Measured> fitted,
                                       const std::vector<ServoPrediction>& on_test,
                                       const BeliefSettings& settings) {
  std::vector<FoundEffect> all;
  const auto error = [](const ServoPrediction& p, const std::string& channel) {
    return channel == "torque" ? p.torque_error.error : p.deflection_error.error;
  };
  std::size_t place = h.declared->rig.terms.size();
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    const Effect& accepted = h.effects[i];
    auto step = std::find_if(all.begin(), all.end(),
                             [&](const FoundEffect& e) { return e.id == accepted.candidate.id; });
    if (step == all.end()) {
      FoundEffect e;
      e.id = accepted.candidate.id;
      e.channel = accepted.gain.deflection ? "deflection" : "torque";
      e.evidence = accepted.gain.evidence;
      e.equivalent_to = ids_of(accepted);
      e.nearest = accepted.nearest;
      e.test_error_before = error(on_test[i], e.channel);
      step = all.insert(all.end(), e);
    }
    step->test_error_after = error(on_test[i + 1], step->channel);
    step->test_gain = test_gain(left(on_test[i], accepted.gain.deflection, settings),
                                left(on_test[i + 1], accepted.gain.deflection, settings), settings);
    for (std::size_t t = 0; t < accepted.candidate.terms.size(); ++t, ++place) {
      step->terms.push_back(place);
      const std::size_t number = step->terms.size();
      describe(*h.fitted->fit.machine.rig.terms[place], accepted.candidate, t,
               number > 1 ? "_" + std::to_string(number) : "", fitted, *step);
    }
  }
  return all;
}

}  // namespace backlash::identification
