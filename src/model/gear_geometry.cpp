// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/gear_geometry.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::model {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kMostTeeth = 1'000'000;

void require(const std::string& name, double value, const Range& range) {
  if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
}

void check(const std::string& name, const SpurGear& gear) {
  require(name + ".teeth", gear.teeth, Range::between(3, kMostTeeth));
  require(name + ".addendum", gear.addendum, Range::between(0.1, 2));
  require(name + ".profile_shift", gear.profile_shift, Range::between(-1, 1.5));
  require(name + ".thinning", gear.thinning, Range::any());
}

void check(const GearPair& pair) {
  check("pinion", pair.pinion);
  check("gear", pair.gear);
  require("module", pair.module, Range::positive());
  require("pressure_angle", pair.pressure_angle, Range::between(5 * kDegree, 45 * kDegree));
  require("centre_distance_change", pair.centre_distance_change, Range::any());
}

double base_radius(const GearPair& pair, const SpurGear& gear) {
  return 0.5 * pair.module * gear.teeth * std::cos(pair.pressure_angle);
}

double sum_of_base_radii(const GearPair& pair) {
  return base_radius(pair, pair.pinion) + base_radius(pair, pair.gear);
}

/// Unthinned teeth mesh without play where inv(operating angle) is this.
double tight_involute(const GearPair& pair) {
  const double shift = pair.pinion.profile_shift + pair.gear.profile_shift;
  const double value = involute(pair.pressure_angle) +
                       2 * std::tan(pair.pressure_angle) * shift / (pair.pinion.teeth + pair.gear.teeth);
  if (value < 0)
    throw InvalidParameter("profile_shift", shift, "is too negative in sum for these teeth to mesh");
  return value;
}

/// Play along the line of action that thinning alone gives, m.
double thinning_play(const GearPair& pair) {
  return (pair.pinion.thinning + pair.gear.thinning) * std::cos(pair.pressure_angle);
}

double tight_centre_distance(const GearPair& pair) {
  const bool shifted = pair.pinion.profile_shift + pair.gear.profile_shift != 0;
  const double angle = shifted ? inverse_involute(tight_involute(pair)) : pair.pressure_angle;
  return sum_of_base_radii(pair) / std::cos(angle);
}

GearCircles circles(const GearPair& pair, const SpurGear& gear, double operating_angle) {
  GearCircles c;
  c.reference_radius = 0.5 * pair.module * gear.teeth;
  c.base_radius = base_radius(pair, gear);
  c.tip_radius = c.reference_radius + pair.module * (gear.addendum + gear.profile_shift);
  c.operating_radius = c.base_radius / std::cos(operating_angle);
  if (!(c.tip_radius > c.base_radius))
    throw InvalidParameter("addendum", gear.addendum, "puts the tip below the base circle");
  const double thickness =
      pair.module * (M_PI / 2 + 2 * gear.profile_shift * std::tan(pair.pressure_angle)) - gear.thinning;
  const double half_angle =
      0.5 * thickness / c.reference_radius + involute(pair.pressure_angle);  // at the base
  const auto thickness_at = [&](double radius, double angle) {
    return 2 * radius * (half_angle - involute(angle));
  };
  c.operating_tooth_thickness = thickness_at(c.operating_radius, operating_angle);
  c.tip_thickness = thickness_at(c.tip_radius, std::acos(c.base_radius / c.tip_radius));
  return c;
}

/// Distance of the tip circle from the base circle's tangent point along the line of action.
double tip_reach(const GearCircles& c) {
  return std::sqrt(c.tip_radius * c.tip_radius - c.base_radius * c.base_radius);
}

void find_faults(GearGeometry& g) {
  const double tangent = std::tan(g.operating_pressure_angle);
  if (g.contact_ratio < 1)
    g.faults.push_back(
        fmt::format("contact ratio {:.4g} is below 1: contact is interrupted", g.contact_ratio));
  if (g.approach > g.pinion.base_radius * tangent)
    g.faults.emplace_back("interference: the tips of the gear reach below the base circle of the pinion");
  if (g.recess > g.gear.base_radius * tangent)
    g.faults.emplace_back("interference: the tips of the pinion reach below the base circle of the gear");
  if (!(g.pinion.tip_thickness > 0))
    g.faults.emplace_back("the teeth of the pinion are pointed below their tip circle");
  if (!(g.gear.tip_thickness > 0))
    g.faults.emplace_back("the teeth of the gear are pointed below their tip circle");
}

void remark_undercut(const GearPair& pair, const std::string& name, const SpurGear& gear,
                     const SpurGear& mate, std::vector<std::string>& remarks) {
  const double sine = std::sin(pair.pressure_angle);
  const double least = 2 * (mate.addendum - gear.profile_shift) / (sine * sine);
  if (gear.teeth < least)
    remarks.push_back(fmt::format(
        "undercut: a rack as deep as the mate cuts into the involute of the {} ({} teeth, limit {:.4g})",
        name, gear.teeth, least));
}

}  // namespace

double involute(double angle) {
  return std::tan(angle) - angle;
}

double inverse_involute(double value) {
  if (!(value >= 0) || !std::isfinite(value))
    throw InvalidParameter("involute", value, "must be >= 0 and finite");
  // tan(a) - a >= a^3/3 and tan(a) <= value + pi/2 both bound the root from above; from there Newton's steps
  // on this convex function only fall, until rounding stops them.
  double angle = std::min(std::cbrt(3 * value), std::atan(value + M_PI / 2));
  while (angle > 0) {
    const double slope = std::tan(angle) * std::tan(angle);
    const double next = angle - (involute(angle) - value) / slope;
    if (!(next < angle)) break;
    angle = next;
  }
  return std::max(angle, 0.0);
}

GearGeometry gear_geometry(const GearPair& pair) {
  check(pair);
  GearGeometry g;
  const double sum = sum_of_base_radii(pair);
  g.tight_centre_distance = tight_centre_distance(pair);
  g.centre_distance = g.tight_centre_distance + pair.centre_distance_change;
  if (!(g.centre_distance > sum))
    throw InvalidParameter("centre_distance_change", pair.centre_distance_change,
                           "leaves no room for the base circles");
  g.operating_pressure_angle = std::acos(sum / g.centre_distance);
  g.pinion = circles(pair, pair.pinion, g.operating_pressure_angle);
  g.gear = circles(pair, pair.gear, g.operating_pressure_angle);
  g.base_pitch = M_PI * pair.module * std::cos(pair.pressure_angle);
  g.backlash = 2 * sum * (involute(g.operating_pressure_angle) - tight_involute(pair)) + thinning_play(pair);
  if (std::fabs(g.backlash) < 1e-13 * sum) g.backlash = 0;  // rounding of the centre distance
  if (g.backlash < 0)
    throw InvalidParameter(
        "centre_distance_change", pair.centre_distance_change,
        fmt::format("jams the teeth: they overlap by {:.4g} m along the line of action", -g.backlash));
  g.pitch_circle_backlash = g.backlash / std::cos(g.operating_pressure_angle);
  const double tangent = std::tan(g.operating_pressure_angle);
  g.approach = tip_reach(g.gear) - g.gear.base_radius * tangent;
  g.recess = tip_reach(g.pinion) - g.pinion.base_radius * tangent;
  g.length_of_contact = g.approach + g.recess;
  g.contact_ratio = g.length_of_contact / g.base_pitch;
  find_faults(g);
  remark_undercut(pair, "pinion", pair.pinion, pair.gear, g.remarks);
  remark_undercut(pair, "gear", pair.gear, pair.pinion, g.remarks);
  return g;
}

double centre_distance_change_for(GearPair pair, double backlash) {
  pair.centre_distance_change = 0;
  check(pair);
  require("backlash", backlash, Range::not_negative());
  const double sum = sum_of_base_radii(pair);
  const double value = tight_involute(pair) + (backlash - thinning_play(pair)) / (2 * sum);
  if (!(value > 0))
    throw InvalidParameter("backlash", backlash, "is less than thinning leaves at any centre distance");
  return sum / std::cos(inverse_involute(value)) - tight_centre_distance(pair);
}

}  // namespace backlash::model
