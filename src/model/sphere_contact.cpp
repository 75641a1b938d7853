// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/sphere_contact.h"

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::model {
namespace {

void require(const std::string& name, double value, const Range& range) {
  if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
}

/// (2.26), times pi.
double compliance(const Sphere& sphere) {
  require("radius", sphere.radius, Range::positive());
  require("youngs_modulus", sphere.youngs_modulus, Range::positive());
  require("poisson_ratio", sphere.poisson_ratio, Range::between(0, 0.5));
  return (1 - sphere.poisson_ratio * sphere.poisson_ratio) / sphere.youngs_modulus;
}

}  // namespace

double sphere_stiffness(const Sphere& first, const Sphere& second) {
  const double compliances = compliance(first) + compliance(second);
  return 4 / (3 * compliances) * std::sqrt(first.radius / (first.radius + second.radius) * second.radius);
}

double equivalent_radius(double mass, double density) {
  require("mass", mass, Range::positive());
  require("density", density, Range::positive());
  return std::cbrt(3 * mass / (4 * M_PI * density));
}

}  // namespace backlash::model
