// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/stiffness_variation.h"

#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

GearPair read_gear_pair(const YamlReader& yaml) {
  GearPair pair;
  pair.pinion.teeth = static_cast<int>(yaml.integer("pinion_teeth", 3, 1'000'000));
  pair.gear.teeth = static_cast<int>(yaml.integer("gear_teeth", 3, 1'000'000));
  pair.module = yaml.number("module", Range::positive());
  pair.pressure_angle = yaml.number("pressure_angle_deg", Range::between(5, 45)) * M_PI / 180;
  pair.pinion.addendum = pair.gear.addendum = yaml.number("addendum", Range::between(0.1, 2));
  pair.centre_distance_change = yaml.number_or("centre_distance_change", 0, Range::any());
  pair.pinion.thinning = yaml.number_or("pinion_thinning", 0, Range::any());
  pair.gear.thinning = yaml.number_or("gear_thinning", 0, Range::any());
  pair.pinion.profile_shift = yaml.number_or("pinion_shift", 0, Range::between(-1, 1.5));
  pair.gear.profile_shift = yaml.number_or("gear_shift", 0, Range::between(-1, 1.5));
  return pair;
}

MeshStiffnessSettings read_settings(const YamlReader& yaml) {
  MeshStiffnessSettings settings;
  settings.law = yaml.choice("law", mesh_stiffness_laws());
  settings.transition = yaml.number("transition", Range::between(0, 0.5));
  settings.face_width = 1;  // these cancel in the factor, but for the ratio of contact to bending
  settings.youngs_modulus = 206e9;
  settings.poisson_ratio = 0.3;
  if (settings.law == "hertz_bending") {
    settings.youngs_modulus = yaml.number("youngs_modulus", Range::positive());
    settings.poisson_ratio = yaml.number("poisson_ratio", Range::between(0, 0.5));
  }
  return settings;
}

}  // namespace

double MeshCycle::sum_of_phases() const {
  const GearGeometry& g = stiffness.geometry();
  const double thickness =
      g.pinion.operating_tooth_thickness * g.pinion.base_radius / g.pinion.operating_radius;
  return (thickness + 2 * g.approach) / g.base_pitch;
}

StiffnessVariation::StiffnessVariation(MeshCycle cycle)
    : cycle_(std::move(cycle)), reverse_(cycle_.sum_of_phases()) {}

StiffnessVariation::StiffnessVariation(MeshStiffness stiffness, double offset)
    : StiffnessVariation(MeshCycle{std::move(stiffness), offset}) {}

double StiffnessVariation::factor(double travel, double side) const {
  const double phase = cycle_.phase(travel);
  return cycle_.stiffness.stiffness(side > 0 ? phase : reverse_ - phase) / cycle_.stiffness.mean();
}

MeshCycle read_mesh_cycle(const YamlReader& yaml, double base_radius) {
  const YamlReader gears = yaml.map("gear_pair");
  const GearPair pair = read_gear_pair(gears);
  const MeshStiffnessSettings settings = read_settings(yaml);
  const double offset = yaml.number("phase", Range::between(0, 1));
  if (std::isnan(base_radius)) yaml.fail("gear_pair", "a mesh without base_radius has no mesh phase");
  try {
    MeshStiffness stiffness(pair, settings);
    const double radius = stiffness.geometry().gear.base_radius;
    if (!(std::fabs(radius - base_radius) <= 1e-3 * base_radius))
      gears.fail("gear_teeth", "the gear has base radius " + std::to_string(radius) + " m, the mesh " +
                                   std::to_string(base_radius) + " m");
    return {std::move(stiffness), offset};
  } catch (const InvalidParameter& error) {
    yaml.fail("gear_pair", error.what());
  }
}

std::shared_ptr<const StiffnessVariation> read_stiffness_variation(const YamlReader& yaml,
                                                                   double base_radius) {
  return std::make_shared<StiffnessVariation>(read_mesh_cycle(yaml, base_radius));
}

}  // namespace backlash::model
