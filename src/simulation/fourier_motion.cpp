// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/fourier_motion.h"

#include <cmath>

#include "excitation/checks.h"

namespace backlash::simulation {
namespace {

constexpr double kAtRest = 1e-9;  // of what the coefficients could give; choice: rounding of printed ones

Kinematics series(const FourierMotion& m, double s) {
  Kinematics out{m.offset, 0, 0};
  for (std::size_t i = 0; i < m.cosines.size(); ++i) {
    const double w = 2 * M_PI * double(i + 1) / m.period, c = std::cos(w * s), d = std::sin(w * s);
    const double wave = m.cosines[i] * c + m.sines[i] * d;
    out.position += wave;
    out.velocity += w * (m.sines[i] * c - m.cosines[i] * d);
    out.acceleration -= w * w * wave;
  }
  return out;
}

}  // namespace

Kinematics kinematics(const FourierMotion& m, double t) {
  if (t >= m.approach) return series(m, t - m.approach);
  const double x = t / m.approach, way = series(m, 0).position - m.start;
  return {m.start + way * x * x * x * (10 + x * (6 * x - 15)),
          way / m.approach * 30 * x * x * (1 - x) * (1 - x),
          way / (m.approach * m.approach) * 60 * x * (1 - x) * (1 - 2 * x)};
}

void check(const FourierMotion& m) {
  require("start", m.start, Range::any());
  require("approach", m.approach, Range::not_negative());
  require("period", m.period, Range::positive());
  require("offset", m.offset, Range::any());
  if (m.sines.size() != m.cosines.size())
    throw InvalidParameter("excitation.sines", double(m.sines.size()), "must be as many as cosines");
  double speed = 0, acceleration = 0, most_speed = 0, most_acceleration = 0;
  for (std::size_t i = 0; i < m.cosines.size(); ++i) {
    require("cosines", m.cosines[i], Range::any());
    require("sines", m.sines[i], Range::any());
    const double k = double(i + 1);
    speed += k * m.sines[i], most_speed += std::fabs(k * m.sines[i]);
    acceleration += k * k * m.cosines[i], most_acceleration += std::fabs(k * k * m.cosines[i]);
  }
  if (std::fabs(speed) > kAtRest * most_speed)
    throw InvalidParameter("excitation.sines", speed, "sum of k b_k: must be 0, a period begins at rest");
  if (std::fabs(acceleration) > kAtRest * most_acceleration)
    throw InvalidParameter("excitation.cosines", acceleration,
                           "sum of k^2 a_k: must be 0, a period begins at rest");
}

}  // namespace backlash::simulation
