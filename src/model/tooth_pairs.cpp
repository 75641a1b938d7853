// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/tooth_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

/// The tooth that comes `index` teeth after tooth 0.
long tooth_of(long index, long teeth) {
  const long rest = index % teeth;
  return rest < 0 ? rest + teeth : rest;
}

double stands_back(const PitchErrors& errors, long index, int teeth) {
  const long tooth = tooth_of(index, teeth);
  const auto own = errors.of_tooth.find(tooth);
  return (errors.runout == 0 ? 0
                             : errors.runout * std::sin(2 * M_PI * double(tooth) / teeth + errors.phase)) +
         (own == errors.of_tooth.end() ? 0 : own->second);
}

double most_of(const PitchErrors& errors) {
  double own = 0;
  for (const auto& [tooth, error] : errors.of_tooth) own = std::max(own, std::fabs(error));
  return std::fabs(errors.runout) + own;
}

/// The largest -e of a flank's form over the travel that counts: of a parabola at an end or at the vertex.
double most_of_form(const ToothErrors& errors, double from, double to) {
  const auto form = [&](double t) {
    return errors.slope * (t - 0.5) + errors.crown * std::pow(2 * t - 1, 2);
  };
  double least = std::min({0.0, form(from), form(to)});
  if (errors.crown != 0)
    least = std::min(least, form(std::clamp(0.5 - errors.slope / (8 * errors.crown), from, to)));
  return -least;
}

PitchErrors read_pitch_errors(const YamlReader& yaml, long teeth) {
  PitchErrors errors;
  errors.runout = yaml.number_or("runout", 0, Range::not_negative());
  errors.phase = errors.runout > 0 ? yaml.number("phase", Range::any()) : 0;
  if (yaml.has("teeth"))
    for (const YamlReader& tooth : yaml.maps("teeth")) {
      const long number = tooth.integer("tooth", 0, teeth - 1);
      if (!errors.of_tooth.emplace(number, tooth.number("error", Range::any())).second)
        tooth.fail("tooth", "is named twice");
    }
  return errors;
}

}  // namespace

ToothPairs::ToothPairs(MeshCycle cycle, ToothErrors errors)
    : cycle_(std::move(cycle)),
      sum_of_phases_(cycle_.sum_of_phases()),
      errors_(std::move(errors)),
      pinion_teeth_(cycle_.stiffness.pinion_teeth()),
      gear_teeth_(cycle_.stiffness.gear_teeth()) {
  const double transition = cycle_.stiffness.transition(), eps = cycle_.stiffness.geometry().contact_ratio;
  if (!(transition > 0))
    throw InvalidParameter("transition", transition, "must be > 0: the force of a pair would jump");
  const double beyond = 0.5 * transition / eps;
  protrusion_ = most_of_form(errors_, -beyond, 1 + beyond) + most_of(errors_.pinion) + most_of(errors_.gear);
}

double ToothPairs::pitch_error(long pair, int side) const {
  const long pinion = side > 0 ? pair : -pair, gear = side > 0 ? pair : 1 - pair;
  return side *
         (stands_back(errors_.pinion, pinion, pinion_teeth_) + stands_back(errors_.gear, gear, gear_teeth_));
}

template <typename Use>
void ToothPairs::each_pair(double travel, int side, const Use& use) const {
  const MeshStiffness& mesh = cycle_.stiffness;
  const double eps = mesh.geometry().contact_ratio, half = 0.5 * mesh.transition();
  const double phase = side > 0 ? cycle_.phase(travel) : sum_of_phases_ - cycle_.phase(travel);
  const double per_metre = side / mesh.geometry().base_pitch;  // of the pair's travel
  for (double pair = std::floor(phase + half); phase - pair < eps + half; pair -= 1) {
    const double u = phase - pair, stiffness = mesh.of_pair(u);
    if (!(stiffness > 0)) continue;
    const double t = u / eps, from_middle = 2 * t - 1;
    use(Pair{stiffness / mesh.mean(), mesh.slope_of_pair(u) / mesh.mean() * per_metre,
             errors_.slope * (t - 0.5) + errors_.crown * from_middle * from_middle +
                 pitch_error(std::lround(pair), side),
             (errors_.slope + 4 * errors_.crown * from_middle) / eps * per_metre});
  }
}

ToothPairs::Push ToothPairs::push(const Place& place, const ContactLaw& law) const {
  Push sum;
  each_pair(place.travel, place.side, [&](const Pair& pair) {
    const double depth = place.depth - pair.error;
    if (!(depth > 0)) return;
    const double force = pair.weight * law.force(depth, place.rate - pair.error_slope * place.travel_rate, 0);
    sum.force += force;
    sum.spared += force * pair.error_slope - pair.weight_slope * law.elastic_energy(depth);
  });
  return sum;
}

double ToothPairs::elastic_energy(const Place& place, const ContactLaw& law) const {
  double sum = 0;
  each_pair(place.travel, place.side, [&](const Pair& pair) {
    if (place.depth > pair.error) sum += pair.weight * law.elastic_energy(place.depth - pair.error);
  });
  return sum;
}

std::shared_ptr<const ToothPairs> read_tooth_pairs(const YamlReader& yaml, double base_radius) {
  MeshCycle cycle = read_mesh_cycle(yaml, base_radius);
  ToothErrors errors;
  if (const auto given = yaml.optional_map("errors")) {
    errors.slope = given->number_or("slope", 0, Range::any());
    errors.crown = given->number_or("crown", 0, Range::any());
    if (const auto pinion = given->optional_map("pinion"))
      errors.pinion = read_pitch_errors(*pinion, cycle.stiffness.pinion_teeth());
    if (const auto gear = given->optional_map("gear"))
      errors.gear = read_pitch_errors(*gear, cycle.stiffness.gear_teeth());
  }
  try {
    return std::make_shared<ToothPairs>(std::move(cycle), std::move(errors));
  } catch (const InvalidParameter& error) {
    yaml.fail("transition", error.what());
  }
}

}  // namespace backlash::model
