// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/term_columns.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

constexpr double kProbe = 0.25;  // strength of the probes, a power of two: the division is exact
// s, times the speed: ways over which friction builds up after a reversal. Choice.
constexpr double kBristles[] = {0.01, 0.02, 0.05, 0.1, 0.2};

Motion motion_of(const JointMoment& m) {
  return {m.time, m.position, m.speed, m.position, m.speed, m.load};
}

double rubbed(const FrictionLimits& limits, const JointMoment& m) {
  const double both = 0.5 * (limits.forward + limits.backward);
  const double built = limits.presliding > 0 ? 1 - 2 * std::exp(-m.way / limits.presliding) : 1;
  return m.direction * both * built + 0.5 * (limits.forward - limits.backward);
}

/// Shapes that are neither fixed lists nor there only when the effect is found.
std::vector<const TermShape*> refined_shapes(const TermType& type) {
  std::vector<const TermShape*> all;
  for (const TermShape& shape : type.search->shapes)
    if (shape.refined && !shape.later) all.push_back(&shape);
  return all;
}

const ParameterSpec& spec_of(const TermType& type, const std::string& name) {
  return *std::find_if(type.parameters.begin(), type.parameters.end(),
                       [&](const ParameterSpec& spec) { return spec.name == name; });
}

/// With what need not be given. Whichever body a word means, both move as one.
ParameterValues completed(const TermType& type, ParameterValues given) {
  for (const ParameterSpec& spec : type.parameters) {
    if (!spec.choices.empty()) given.set_choice(spec.name, spec.choices.front());
    if (spec.absent && !given.has(spec.name)) given[spec.name] = *spec.absent;
  }
  return given;
}

std::vector<std::shared_ptr<const Term>> probes_of(const TermType& type, ParameterValues values) {
  const TermSearch& search = *type.search;
  if (!type.shapes_friction) values[search.strength] = kProbe;
  if (search.phase.empty()) return {make_term(type.id, values)};
  std::vector<std::shared_ptr<const Term>> all;
  for (const double phase : {M_PI / 2, 0.0}) {
    values[search.phase] = phase;
    all.push_back(make_term(type.id, values));
  }
  return all;
}

/// With a value of every shape, whatever it is.
std::shared_ptr<const Term> any_term(const TermType& type) {
  ParameterValues values;
  for (const ParameterSpec& spec : type.parameters)
    if (spec.choices.empty()) values[spec.name] = spec.range.contains(kProbe) ? kProbe : 1;
  return make_term(type.id, completed(type, values));
}

}  // namespace

namespace {

/// Part of how a machine is built, or never sought.
bool is_built_in(const TermType& type) {
  return !type.search || type.gap_variation != GapVariation::none || type.search->needs_turning_link;
}

}  // namespace

ShownIn shown_in(const TermType& type) {
  if (is_built_in(type)) return ShownIn::neither;
  const std::shared_ptr<const Term> term = any_term(type);
  if (term->loads_flanks() || term->shape_follows_torque()) return ShownIn::neither;
  const Sensing sensed = sensing({term});
  if (sensed.torque_delay != 0) return ShownIn::neither;
  return term->shapes_flanks() || sensed.load_position_gain != 1 ? ShownIn::deflection : ShownIn::torque;
}

ParameterSpec regressed_strength(const TermType& type) {
  if (type.shapes_friction) return {"torque", "N m", Range::not_negative(), "dry friction that builds up"};
  return spec_of(type, type.search->strength);
}

TermColumns::TermColumns(const TermType& type, ParameterValues given)
    : type_(&type), given_(completed(type, std::move(given))), shown_in_(shown_in(type)) {
  if (shown_in_ == ShownIn::neither)
    throw InvalidParameter("id", type.id, "shows neither in the torque nor in the deflection of a joint");
  for (const ParameterSpec& spec : type.parameters) {
    const bool found = !type.shapes_friction && (spec.name == type.search->strength);
    if (found || spec.name == type.search->phase || !spec.choices.empty() || given_.has(spec.name)) continue;
    throw InvalidParameter(spec.name, "nothing", "is needed of " + type.id);
  }
  probes_ = probes_of(type, given_);
  shown_more_ = sensing({probes_.front()}).load_position_gain - 1;
}

double TermColumns::torque(const Term& term, const JointMoment& m) const {
  EndTorques ends;
  term.add(motion_of(m), ends);
  if (!term.has_dry_friction()) return -(ends.motor + ends.load);
  const double friction = type_->shapes_friction ? kProbe : 0;
  EndFriction sum;
  sum.motor.forward = sum.motor.backward = friction;
  term.add_friction(motion_of(m), sum);
  return -(ends.motor + ends.load) + rubbed(sum.motor, m) + rubbed(sum.load, m) - m.direction * friction;
}

double TermColumns::ahead(const Term& term, const JointMoment& m) const {
  FlankShift shift;
  term.shape({m.position, m.position, 0, m.load, m.side < 0 ? -1 : 1}, shift);
  return m.side * shift.opening - shown_more_ * m.position;
}

double TermColumns::at(std::size_t column, const JointMoment& moment) const {
  const Term& term = *probes_[column];
  return (shown_in_ == ShownIn::torque ? torque(term, moment) : ahead(term, moment)) / kProbe;
}

bool TermColumns::follows_load() const {
  return probes_.front()->follows_mesh_torque();
}

bool TermColumns::follows_time() const {
  const JointMoment early{1, 1, 1, 1, 1}, late{2, 1, 1, 1, 1};
  return at(0, early) != at(0, late);
}

bool TermColumns::is_constant() const {
  const JointMoment forward{1, 1, 1, 1, 1, 1, 1}, backward{2, 2, -2, -1, -2, 2, -1};
  return at(0, forward) == at(0, backward);
}

bool TermColumns::rubs() const {
  if (!probes_.front()->has_dry_friction()) return false;
  if (type_->shapes_friction) return true;
  EndFriction sum;
  probes_.front()->add_friction(motion_of({1, 0, 1, 1, 1}), sum);
  return sum.motor.forward == sum.motor.backward && sum.load.forward == sum.load.backward;
}

std::vector<std::string> looks_like(const TermType& type) {
  const bool plain =
      shown_in(type) == ShownIn::torque && !searched_shape(type) && type.search->shapes.empty();
  if (!plain || !TermColumns(type, {}).is_constant()) return {};
  return {"torque_offset", "external_torque"};
}

std::optional<ParameterSpec> searched_shape(const TermType& type) {
  if (type.shapes_friction) return spec_of(type, type.search->strength);
  const std::vector<const TermShape*> all = refined_shapes(type);
  if (all.size() != 1) return std::nullopt;
  return spec_of(type, all.front()->name);
}

bool has_order(const TermType& type) {
  const std::vector<const TermShape*> all = refined_shapes(type);
  return all.size() == 1 && all.front()->wave;
}

std::vector<SearchedTerm> searched_terms(ShownIn channel, const MotionRange& range) {
  std::vector<SearchedTerm> all;
  for (const TermType& type : term_types()) {
    if (is_built_in(type) || shown_in(type) != channel) continue;
    if (!type.shapes_friction && refined_shapes(type).size() > 1) continue;
    SearchedTerm term{&type, {}, {}};
    if (type.shapes_friction)
      for (const double time : kBristles) term.shapes.push_back(time * range.speed);
    std::vector<SearchedTerm> variants{term};
    for (const TermShape& shape : type.search->shapes) {
      if (shape.later || (type.shapes_friction && shape.refined)) {
        for (SearchedTerm& v : variants) v.given[shape.name] = 0;
      } else if (shape.refined) {
        if (!shape.wave)
          for (SearchedTerm& v : variants) v.shapes = shape.values(range);
      } else {
        std::vector<SearchedTerm> more;
        for (const SearchedTerm& v : variants)
          for (const double value : shape.values(range)) more.emplace_back(v).given[shape.name] = value;
        variants = std::move(more);
      }
    }
    all.insert(all.end(), variants.begin(), variants.end());
  }
  return all;
}

std::shared_ptr<const Term> term_of(const SearchedTerm& searched, double strength) {
  ParameterValues given = searched.given;
  if (const auto shape = searched_shape(*searched.type); shape && !searched.shapes.empty())
    given[shape->name] = searched.shapes.front();
  ParameterValues values = completed(*searched.type, given);
  values[searched.type->search->strength] = strength;
  return make_term(searched.type->id, values);
}

}  // namespace backlash::model
