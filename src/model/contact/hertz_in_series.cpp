// SPDX-License-Identifier: BSD-3-Clause
// Teeth that touch along a line or at a point, and behind them what yields like a spring: bending of the
// teeth, shafts, bearings. Both bear the same force F, so that their penetrations add:
//   d = F / Ks + (F / K)^(2/3), force = max(0, F + c d')
//   K [N/m^1.5] > 0 of the contact (Hertz 1881), Ks [N/m] > 0 of what is in series, c [N s/m] >= 0
// K = infinity is the law `linear`, Ks = infinity that of Hertz with its damper. Valid where what is in
// series has little mass.
#include <algorithm>
#include <cmath>

#include "laws.h"

namespace backlash::model {
namespace {

class HertzInSeries : public ContactLaw {
 public:
  HertzInSeries(double stiffness, double series, double damping)
      : stiffness_(stiffness), series_(series), damping_(damping) {}
  double force(double d, double rate, double) const override {
    return std::max(0.0, spring(d) + damping_ * rate);
  }
  double elastic_energy(double d) const override {
    const double f = spring(d);
    return f * d - 0.5 * f * f / series_ - 0.6 * f * std::pow(f / stiffness_, 2.0 / 3);
  }
  double static_penetration(double force) const override {
    return force / series_ + std::pow(force / stiffness_, 2.0 / 3);
  }

 private:
  /// With F = K y^3 both penetrations are powers of y: K/Ks y^3 + y^2 = d. Convex, so that Newton's steps
  /// fall to the root from what either part alone would take.
  double spring(double d) const {
    if (!(d > 0)) return 0;
    const double a = stiffness_ / series_;
    double y = std::min(std::sqrt(d), std::cbrt(d / a));
    for (int i = 0; i < kMostSteps; ++i) {
      const double step = (y * y * (a * y + 1) - d) / (y * (3 * a * y + 2));
      y -= step;
      if (!(step > kSolved * y)) break;
    }
    return stiffness_ * y * y * y;
  }

  static constexpr int kMostSteps = 50;     // theory: six do, at worst
  static constexpr double kSolved = 1e-15;  // theory: rounding

  double stiffness_, series_, damping_;
};

}  // namespace

ContactLawType hertz_in_series_contact() {
  return {"hertz_in_series",
          {{"stiffness", "N/m^1.5", Range::positive(), "K of the contact"},
           {"series_stiffness", "N/m", Range::positive(), "Ks of what yields behind it"},
           {"damping", "N s/m", Range::not_negative(), "c"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<HertzInSeries>(p.at("stiffness"), p.at("series_stiffness"),
                                                   p.at("damping"));
          }};
}

}  // namespace backlash::model
