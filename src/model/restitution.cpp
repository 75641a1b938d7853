// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/restitution.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

/// (x - ln(1 + x)) / x^2 for x > -1: positive, falling, 1/2 at 0.
double g(double x) {
  if (std::fabs(x) > 0.1) return (x - std::log1p(x)) / (x * x);
  double sum = 0;  // of (-x)^k / (k + 2), where the difference above would cancel
  for (int k = 16; k >= 0; --k) sum = 1.0 / (k + 2) - x * sum;
  return sum;
}

double g_slope(double x) {
  if (std::fabs(x) > 0.1) return (1 / (1 + x) - 2 * g(x)) / x;
  double sum = 0;  // of -(k + 1) (-x)^k / (k + 3)
  for (int k = 16; k >= 0; --k) sum = -(k + 1.0) / (k + 3) - x * sum;
  return sum;
}

/// The exact relation as (D - ln(1+D)) / D^2 = (-eD - ln(1-eD)) / D^2: left side minus right, divided by D^2
/// so that the root D = 0 is gone. Falls with D and with e.
double imbalance(double damping, double e) {
  return g(damping) - e * e * g(-e * damping);
}

/// Root of a falling function between `low` and `high` by Newton's method inside a shrinking bracket.
template <typename Function, typename Slope>
double falling_root(Function f, Slope slope, double low, double high, double x) {
  for (int i = 0; i < 200; ++i) {
    const double value = f(x);
    if (value == 0) return x;
    (value > 0 ? low : high) = x;
    double next = x - value / slope(x);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::fabs(next - x) <= 1e-15 * x || next == low || next == high) return next;
    x = next;
  }
  return x;
}

}  // namespace

double restitution_of_damping(double damping) {
  if (!(damping >= 0)) throw InvalidParameter("damping", damping, "must be >= 0");
  if (damping == 0) return 1;
  if (damping > 40) return 1 / damping;  // 1 - eD < 1e-16
  const double high = std::min(1.0, 1 / damping);
  return falling_root(
      [=](double e) { return imbalance(damping, e); },
      [=](double e) { return -2 * e * g(-e * damping) + e * e * damping * g_slope(-e * damping); }, 0, high,
      high / (1 + damping / 3));
}

double hunt_crossley_restitution(double alpha_speed) {
  return restitution_of_damping(1.5 * alpha_speed);
}

double damping_of_restitution(double restitution) {
  const double e = restitution;
  if (!(e > 0) || e > 1) throw InvalidParameter("restitution", e, "must be > 0 and <= 1");
  if (e == 1) return 0;
  if (e < 0.03) return 1 / e;  // 1 - eD < 1e-13
  return falling_root([=](double d) { return imbalance(d, e); },
                      [=](double d) { return g_slope(d) + e * e * e * g_slope(-e * d); }, 0, 1 / e,
                      std::min(yang_sun_damping(e) / std::sqrt(e), 0.99 / e));
}

double hunt_crossley_damping(double e) {
  return 1.5 * (1 - e);
}
double yang_sun_damping(double e) {
  return 6 * (1 - e) / ((2 * e - 1) * (2 * e - 1) + 3);
}
double lankarani_nikravesh_damping(double e) {
  return 0.75 * (1 - e * e);
}
double lee_wang_damping(double e) {
  return 0.75 * (1 - e);
}
double gonthier_damping(double e) {
  return (1 - e * e) / e;
}
double flores_damping(double e) {
  return 1.6 * (1 - e) / e;
}

double jankowski_first_damping_ratio(double e) {
  return std::sqrt(5) / (2 * M_PI) * (1 - e * e) / e;
}
double jankowski_damping_ratio(double e) {
  return 4.5 * std::sqrt(5) * (1 - e * e) / (e * (e * (9 * M_PI - 16) + 16));
}

double jankowski_restitution(double damping_ratio) {
  const double z = 2 * damping_ratio / std::sqrt(5), off = std::fabs(1 - z) * (1 + z);
  // The quotient is 1 at z = 1, and off by |1 - z| / 3 near it: less than a rounding of what follows.
  const double angle = off < 1e-12 ? 1 : (z < 1 ? std::acos(z) : std::acosh(z)) / std::sqrt(off);
  return std::exp(-z * angle);
}

ImpactSpeeds speeds_after_impact(double mass1, double mass2, ImpactSpeeds before, double restitution) {
  const double share1 = 1 / (1 + mass1 / mass2),
               share2 = 1 / (1 + mass2 / mass1);  // m2 / (m1 + m2), m1 / (m1 + m2)
  const double change = (1 + restitution) * (before.first - before.second);
  return {before.first - share1 * change, before.second + share2 * change};
}

}  // namespace backlash::model
