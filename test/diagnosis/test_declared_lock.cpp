// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/diagnosis/declared_lock.h"

namespace backlash::diagnosis {
namespace {

// By hand: a gap of 8 e. At x the spring holds k x^2 / 2 = T x^2 / (2 e); it got T (e + 8 e + x) + T e / 2.
TEST(DeclaredLock, MostTravelIsThatOfAllWork) {
  const double e = 0.002, b = 8 * e, x = (most_locked_travel(b, e) - b) / 2;
  EXPECT_NEAR(x * x / (2 * e), e + b + x + e / 2, 1e-15);  // rounding
  EXPECT_NEAR(most_locked_travel(b, 0), b, 1e-15);         // rigid
}

record::Record swinging(double travel, double torque) {
  record::Record record;
  for (int i = 0; i < 1000; ++i) {
    record.time.push_back(1e-3 * i);
    record.column(record::Channel::motor_position).push_back(0.5 * travel * std::sin(0.1 * i));
    record.column(record::Channel::motor_torque).push_back(torque * std::cos(0.1 * i));
  }
  return record;
}

TEST(DeclaredLock, RefusesOnlyWhatNoPlayAndNoSpringExplain) {
  const DeclaredLock lock{[](double torque) { return torque / 30; }, 0.01};
  const double allowed = most_locked_travel(0.03, 2 * 0.05 / 30);  // thrice the play, twice as soft
  // The sampled sines reach 1 within 0.2 %.
  EXPECT_FALSE(lock_contradicted(swinging(0.99 * allowed, 0.05), lock));
  EXPECT_TRUE(lock_contradicted(swinging(1.02 * allowed, 0.05), lock));
  EXPECT_FALSE(lock_contradicted(swinging(9, 0.05), {}));  // nothing is declared
  EXPECT_FALSE(lock_contradicted(swinging(9, 0.05), {lock.elastic_deflection, kNaN}));
}

}  // namespace
}  // namespace backlash::diagnosis
