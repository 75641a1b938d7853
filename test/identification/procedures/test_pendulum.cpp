// SPDX-License-Identifier: BSD-3-Clause
// One inertia with a weight off its axis: a motion in closed form, and the torque that it takes by the
// equation.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/procedures/one_inertia.h"

namespace backlash::identification {
namespace {

struct Pendulum {
  double inertia = 0.147, viscous = 0.03, coulomb = 0.2, offset = 0.02, weight = 2.985, phase = 0.1;
  double late = 0;  // s, that the torque acts later than its stamp
};

/// Two sines; 20 s at 500 Hz.
record::Record record_of(const Pendulum& p, unsigned seed) {
  Random random(seed);
  record::Record r;
  r.name = "pendulum";
  const double w[] = {2 * M_PI * 0.37, 2 * M_PI * 0.91}, size[] = {0.9, 0.4};
  for (int k = 0; k < 10000; ++k) {
    const double t = 0.002 * k;
    const auto motion = [&](double at, double& q, double& v, double& a) {
      q = v = a = 0;
      for (int i = 0; i < 2; ++i) {
        q += size[i] * std::sin(w[i] * at);
        v += size[i] * w[i] * std::cos(w[i] * at);
        a -= size[i] * w[i] * w[i] * std::sin(w[i] * at);
      }
    };
    double q, v, a, q0, v0, a0;
    motion(t, q0, v0, a0);
    motion(t + p.late, q, v, a);
    r.time.push_back(t);
    r.column(record::Channel::motor_position).push_back(q0 + 1e-4 * random.normal());
    r.column(record::Channel::motor_torque)
        .push_back(p.inertia * a + p.viscous * v + std::copysign(p.coulomb, v) + p.offset +
                   p.weight * std::sin(q + p.phase) + 0.05 * random.normal());
  }
  return r;
}

void expect(const signal::Measured& m, double truth, double share, const char* name) {
  EXPECT_NEAR(m.value, truth, share * std::fabs(truth)) << name;
  EXPECT_NEAR(m.value, truth, 3 * m.standard_error) << name;
}

TEST(Pendulum, IsIdentifiedWithItsWeight) {
  const Pendulum p;
  OneInertiaOptions options;
  options.gravity = true;
  const OneInertia found = identify_one_inertia(record_of(p, 1), options);
  expect(found.inertia, p.inertia, 0.03, "inertia");
  expect(found.gravity_sine, p.weight * std::cos(p.phase), 0.01, "sine");
  expect(found.gravity_cosine, p.weight * std::sin(p.phase), 0.1, "cosine");
  expect(found.coulomb, p.coulomb, 0.1, "coulomb");
  EXPECT_LT(found.relative_error, 1.5 * found.floor);
  EXPECT_LT(applied(found, record_of(p, 2)).relative_error, 1.5 * found.floor) << "another record of it";
}

TEST(Pendulum, ATorqueThatIsLateByMoreThanTwoSamplesIsPutRight) {
  Pendulum p;
  p.late = 0.009;  // 4.5 samples
  OneInertiaOptions options;
  options.gravity = true;
  const OneInertia found = identify_one_inertia(record_of(p, 1), options);
  EXPECT_NEAR(found.delay.value, p.late, 0.001);
  expect(found.inertia, p.inertia, 0.03, "inertia");
}

}  // namespace
}  // namespace backlash::identification
