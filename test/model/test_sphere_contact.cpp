// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/sphere_contact.h"

namespace backlash::model {
namespace {

const Sphere kSteel{0.01, 210e9, 0.3};

TEST(SphereContact, EqualSteelSpheres) {
  // E* = 210e9 / (2 * 0.91) = 1.153846e11 Pa, R = 5 mm: 4/3 * 1.153846e11 * sqrt(0.005)
  EXPECT_NEAR(sphere_stiffness(kSteel, kSteel), 1.0878566e10, 5e3);  // rounding of E*
}

// Hertz (1881) in the form of the pressure: a^2 = R d, p0 = 2 E* a / (pi R), F = 2/3 pi a^2 p0.
TEST(SphereContact, ForceIsThatOfTheHertzPressure) {
  const Sphere wall{1e9, 70e9, 0.33};  // as good as flat
  for (const Sphere& other : {kSteel, wall, Sphere{0.03, 110e9, 0.34}}) {
    const double d = 3e-6, radius = 1 / (1 / kSteel.radius + 1 / other.radius);
    const double modulus = 1 / ((1 - 0.3 * 0.3) / 210e9 +
                                (1 - other.poisson_ratio * other.poisson_ratio) / other.youngs_modulus);
    const double a = std::sqrt(radius * d), pressure = 2 * modulus * a / (M_PI * radius);
    const double force = 2.0 / 3 * M_PI * a * a * pressure;
    EXPECT_NEAR(sphere_stiffness(kSteel, other) * std::pow(d, 1.5), force, 1e-13 * force);  // roundings
    EXPECT_DOUBLE_EQ(sphere_stiffness(kSteel, other), sphere_stiffness(other, kSteel));
  }
}

TEST(SphereContact, EquivalentRadiusHoldsTheMass) {
  // 1 kg of steel, 7850 kg/m^3: 1.273885e-4 m^3
  EXPECT_NEAR(equivalent_radius(1, 7850), 0.0312138, 5e-8);
  EXPECT_NEAR(equivalent_radius(4.0 / 3 * M_PI * 1000, 1000), 1, 1e-14);  // rounding
}

TEST(SphereContact, NonsenseIsRefused) {
  EXPECT_THROW(sphere_stiffness(kSteel, {0, 210e9, 0.3}), InvalidParameter);
  EXPECT_THROW(sphere_stiffness({0.01, -1, 0.3}, kSteel), InvalidParameter);
  EXPECT_THROW(sphere_stiffness(kSteel, {0.01, 210e9, 0.6}), InvalidParameter);
  EXPECT_THROW(sphere_stiffness({0.01, std::nan(""), 0.3}, kSteel), InvalidParameter);
  EXPECT_THROW(equivalent_radius(0, 7850), InvalidParameter);
  EXPECT_THROW(equivalent_radius(1, 0), InvalidParameter);
}

}  // namespace
}  // namespace backlash::model
