// d^n for d >= 0, with the two exponents that occur in practice done without pow().
#pragma once

#include <cmath>

namespace backlash {

inline double contact_power(double d, double n) {
  if (n == 1.5) return d * std::sqrt(d);
  if (n == 1.0) return d;
  return std::pow(d, n);
}

}  // namespace backlash
