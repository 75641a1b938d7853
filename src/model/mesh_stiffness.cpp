// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/mesh_stiffness.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::model {
namespace {

using PairStiffness = std::function<double(double life)>;

// Of rigid teeth. Below one the next pair takes up at the depth that the gears have run ahead by; real teeth
// then touch with their tips first, off the line of action. A choice that keeps that part of the cycle short.
constexpr double kLeastContactRatio = 0.9;
constexpr double kLifeStep = 1e-5;  // theory: differences, the laws are smooth over a whole life
constexpr double kNewtonPerMicrometreMillimetre = 1e9;  // N/(um mm) in Pa

void require(const std::string& name, double value, const Range& range) {
  if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
}

PairStiffness step(const MeshStiffnessSettings& s) {
  const double k = s.face_width * hertz_stiffness(s.youngs_modulus, s.poisson_ratio);
  return [k](double) { return k; };
}

/// c' of ISO 6336-1:2006, method B (Eqs. for q' and c'_th with C_M = 0.8, C_R = C_B = 1) per face width, Pa.
double single_stiffness(const GearPair& pair, double youngs_modulus) {
  const bool pinion_small = pair.pinion.teeth <= pair.gear.teeth;
  const SpurGear& small = pinion_small ? pair.pinion : pair.gear;
  const SpurGear& large = pinion_small ? pair.gear : pair.pinion;
  const double x1 = small.profile_shift, x2 = large.profile_shift;
  require("profile_shift", x1 + x2, Range::between(-0.5, 2));
  if (x1 < x2) throw InvalidParameter("profile_shift", x1, "must not be less at the smaller gear");
  const double compliance = 0.04723 + 0.15551 / small.teeth + 0.25791 / large.teeth - 0.00635 * x1 -
                            0.11654 * x1 / small.teeth - 0.00193 * x2 - 0.24188 * x2 / large.teeth +
                            0.00529 * x1 * x1 + 0.00182 * x2 * x2;  // um mm / N
  return 0.8 / compliance * kNewtonPerMicrometreMillimetre * (youngs_modulus / 206e9);
}

PairStiffness lin_parker(const GearPair& pair, const MeshStiffnessSettings& s) {
  const double most = s.face_width * single_stiffness(pair, s.youngs_modulus);
  return [most](double t) { return most * (0.55 + 1.8 * t * (1 - t)); };
}

PairStiffness hertz_bending(const GearPair& pair, const GearGeometry& g, const MeshStiffnessSettings& s) {
  if (!Range::between(180e9, 220e9).contains(s.youngs_modulus))
    throw InvalidParameter("youngs_modulus", s.youngs_modulus,
                           "must be >= 1.8e11 and <= 2.2e11 Pa: the bending polynomial holds for steel");
  const double hertz = hertz_stiffness(s.youngs_modulus, s.poisson_ratio);
  const double tangent = std::tan(g.operating_pressure_angle), width = s.face_width;
  const auto compliance = [=](double life) {  // per face width, 1/Pa
    const double after_pitch_point = life * g.length_of_contact - g.approach;
    const double r1 = std::hypot(g.pinion.base_radius, g.pinion.base_radius * tangent + after_pitch_point);
    const double r2 = std::hypot(g.gear.base_radius, g.gear.base_radius * tangent - after_pitch_point);
    return 1 / bending_stiffness(pair.pinion, pair.module, r1) +
           1 / bending_stiffness(pair.gear, pair.module, r2) + 1 / hertz;
  };
  compliance(0),
      compliance(1);  // the polynomial is linear in the radius: it holds in between if it holds at the ends
  return [=](double life) { return width / compliance(life); };
}

PairStiffness pair_stiffness(const GearPair& pair, const GearGeometry& geometry,
                             const MeshStiffnessSettings& s) {
  require("face_width", s.face_width, Range::positive());
  require("youngs_modulus", s.youngs_modulus, Range::positive());
  require("poisson_ratio", s.poisson_ratio, Range::between(0, 0.5));
  require("transition", s.transition, Range::between(0, 0.5));
  // A contact ratio below one alone is a mesh that lets go once per cycle.
  const bool interrupted = geometry.faults.size() == 1 && geometry.contact_ratio < 1 &&
                           geometry.contact_ratio >= kLeastContactRatio;
  if (!geometry.faults.empty() && !interrupted)
    throw InvalidParameter("gear_pair", joined(geometry.faults), "has no regular mesh");
  if (s.law == "step") return step(s);
  if (s.law == "lin_parker") return lin_parker(pair, s);
  if (s.law == "hertz_bending") return hertz_bending(pair, geometry, s);
  throw InvalidParameter("law", s.law, "must be one of " + joined(mesh_stiffness_laws()));
}

/// 0 before, 1 after, over `width` around zero.
double ramp(double x, double width) {
  if (x >= 0.5 * width) return 1;
  if (x <= -0.5 * width) return 0;
  const double t = x / width + 0.5;
  return t * t * (3 - 2 * t);
}

double ramp_slope(double x, double width) {
  if (std::fabs(x) >= 0.5 * width) return 0;
  const double t = x / width + 0.5;
  return 6 * t * (1 - t) / width;
}

/// Simpson's rule; 0 for an empty interval.
double integral(const std::function<double(double)>& f, double from, double to) {
  constexpr int kPanels = 200;  // even
  if (!(to > from)) return 0;
  const double h = (to - from) / kPanels;
  double sum = f(from) + f(to);
  for (int i = 1; i < kPanels; ++i) sum += (i % 2 ? 4 : 2) * f(from + i * h);
  return sum * h / 3;
}

}  // namespace

const std::vector<std::string>& mesh_stiffness_laws() {
  static const std::vector<std::string> laws = {"step", "lin_parker", "hertz_bending"};
  return laws;
}

double hertz_stiffness(double youngs_modulus, double poisson_ratio) {
  return M_PI * youngs_modulus / (4 * (1 - poisson_ratio * poisson_ratio));
}

double bending_stiffness(const SpurGear& gear, double module, double radius) {
  require("teeth", gear.teeth, Range::between(12, 100));
  require("profile_shift", gear.profile_shift, Range::between(-0.6, 0.6));
  const double n = gear.teeth, x = gear.profile_shift;
  const double a0 = 3.867 + n * (1.612 + n * (-0.02916 + n * 0.0001553));
  const double a1 = 17.06 + n * (0.7289 + n * (-0.01728 + n * 0.0000999));
  const double a2 = 2.637 + n * (-1.222 + n * (0.02217 + n * -0.0001179));
  const double a3 = -6.330 + n * (-1.033 + n * (0.02068 + n * -0.0001130));
  const double height = (radius - 0.5 * module * n) / ((1 + x) * module);
  const double stiffness = (a0 + a1 * x) + (a2 + a3 * x) * height;
  if (!(stiffness > 0))
    throw InvalidParameter("radius", radius, "is beyond the range of the bending polynomial");
  return stiffness * kNewtonPerMicrometreMillimetre;
}

MeshStiffness::MeshStiffness(const GearPair& pair, const MeshStiffnessSettings& settings)
    : geometry_(gear_geometry(pair)),
      pinion_teeth_(pair.pinion.teeth),
      gear_teeth_(pair.gear.teeth),
      transition_(settings.transition),
      pair_stiffness_(pair_stiffness(pair, geometry_, settings)) {
  // What the cycle sums up over all pairs is one pair over its whole life; smooth between these places.
  const double half = 0.5 * transition_, eps = geometry_.contact_ratio;
  const double places[] = {-half, 0, half, eps - half, eps, eps + half};
  const auto loaded = [this](double travel) { return of_pair(travel); };
  mean_ = 0;
  for (int i = 0; i < 5; ++i) {
    // Inside by a hair, so that a jump at the end of an interval belongs to the other side.
    const double hair = 1e-12 * (places[i + 1] - places[i]);
    mean_ += integral(loaded, places[i] + hair, places[i + 1] - hair);
  }
}

double MeshStiffness::of_pair(double travel) const {
  const double eps = geometry_.contact_ratio;
  const double share = ramp(travel, transition_) * (1 - ramp(travel - eps, transition_));
  return share > 0 ? share * pair_stiffness_(std::clamp(travel / eps, 0.0, 1.0)) : 0;
}

double MeshStiffness::slope_of_pair(double travel) const {
  const double eps = geometry_.contact_ratio;
  const double in = ramp(travel, transition_), out = 1 - ramp(travel - eps, transition_);
  if (!(in * out > 0)) return 0;
  const double share_slope =
      ramp_slope(travel, transition_) * out - in * ramp_slope(travel - eps, transition_);
  const double from = std::clamp(travel / eps - kLifeStep, 0.0, 1.0),
               to = std::clamp(travel / eps + kLifeStep, 0.0, 1.0);
  double slope = share_slope * pair_stiffness_(std::clamp(travel / eps, 0.0, 1.0));
  if (travel > 0 && travel < eps)
    slope += in * out * (pair_stiffness_(to) - pair_stiffness_(from)) / ((to - from) * eps);
  return slope;
}

double MeshStiffness::stiffness(double phase) const {
  double sum = 0;
  for (double travel = phase - std::floor(phase) - 1; travel < geometry_.contact_ratio + 0.5; travel += 1)
    sum += of_pair(travel);
  return sum;
}

int MeshStiffness::pairs(double phase) const {
  return static_cast<int>(std::ceil(geometry_.contact_ratio - (phase - std::floor(phase))));
}

}  // namespace backlash::model
