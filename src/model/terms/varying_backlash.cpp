// SPDX-License-Identifier: BSD-3-Clause
// Backlash that varies with the load position, a Fourier series by one entry per order:
//   backlash(q) = b (1 + sum a sin(n q + p))      b: backlash of the rig file, q = load position
// Both flanks move alike. Yumrukcal (2013, Section 5.4) measured up to 15 percent.
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class VaryingBacklash : public Term {
 public:
  VaryingBacklash(double amplitude, double order, double phase)
      : amplitude_(amplitude), order_(order), phase_(phase) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    const double angle = order_ * at.load_position + phase_;
    shift.opening += at.half_gap * amplitude_ * std::sin(angle);
    shift.load_slope += at.half_gap * amplitude_ * order_ * std::cos(angle);
  }
  double least_opening(double half_gap) const override { return -half_gap * std::fabs(amplitude_); }

 private:
  double amplitude_, order_, phase_;
};

WaveMoment with_side(const Motion& m, const ParameterValues&) {
  return {m.load_position, m.load_velocity, m.mesh_torque == 0 ? 0 : std::copysign(1.0, m.mesh_torque)};
}

}  // namespace

TermType varying_backlash_term() {
  TermType type{"varying_backlash",
                {{"amplitude", "-", Range::any(), "a, relative to the backlash"},
                 {"order", "1/rad", Range::positive(), "n, periods per load turn"},
                 {"phase", "rad", Range::any(), "p"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<VaryingBacklash>(p.at("amplitude"), p.at("order"), p.at("phase"));
                },
                TermSearch{"amplitude",
                           "phase",
                           [](const MotionRange&) { return 0.1; },
                           {order_shape({true, with_side})},
                           true}};
  type.gap_variation = GapVariation::harmonic;
  return type;
}

}  // namespace backlash::model
