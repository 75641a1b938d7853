// SPDX-License-Identifier: BSD-3-Clause
// The elastic part that most laws share: K d^n.
#pragma once

#include <cmath>

#include "backlash_diagnosis/model/contact_law.h"

namespace backlash::model {

/// d^n for d >= 0, with the two exponents that occur in practice done without pow().
inline double contact_power(double d, double n) {
  if (n == 1.5) return d * std::sqrt(d);
  if (n == 1.0) return d;
  return std::pow(d, n);
}

/// A law whose force at rest is K d^n        K [N/m^n] > 0, 1 <= n <= 1.5
class PowerElastic : public ContactLaw {
 public:
  PowerElastic(double stiffness, double exponent) : stiffness_(stiffness), exponent_(exponent) {}
  double elastic_energy(double d) const override { return d * spring(d) / (exponent_ + 1); }
  double static_penetration(double force) const override {
    return std::pow(force / stiffness_, 1 / exponent_);
  }

 protected:
  PowerContact elastic() const { return {stiffness_, exponent_}; }
  double spring(double d) const { return stiffness_ * contact_power(d, exponent_); }

 private:
  double stiffness_, exponent_;
};

/// Their parameters in a rig file.
inline ParameterSpec power_stiffness() {
  return {"stiffness", "N/m^n", Range::positive(), "K"};
}
inline ParameterSpec power_exponent() {
  return {"exponent", "1", Range::between(1, 1.5), "n"};
}

}  // namespace backlash::model
