// SPDX-License-Identifier: BSD-3-Clause
// A damaged tooth: where the load stands there, once per turn, a flank is farther away (or nearer, A < 0),
//   o = A exp(-(c / w)^2 / 2),  c = 2 sin((q - q0) / 2)      opening [rad at the load], q = load position
// on the forward flank (that touches where the motor drives forward), the backward one or both. c is q - q0
// for small angles and makes the bump periodic and smooth, w > 0 its width [rad]. Conservative. That a local
// fault is a short change of the transmission once per turn of its wheel: Randall (1982, J. Mech. Des.
// 104:259).
#include <algorithm>
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class LocalFault : public Term {
 public:
  explicit LocalFault(const ParameterValues& p)
      : forward_(p.choice("flank") != "backward"),
        backward_(p.choice("flank") != "forward"),
        amplitude_(p.at("amplitude")),
        position_(p.at("position")),
        width_(p.at("width")) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    if (!(at.side > 0 ? forward_ : backward_)) return;
    const double half = 0.5 * (at.load_position - position_), chord = 2 * std::sin(half) / width_;
    const double bump = amplitude_ * std::exp(-0.5 * chord * chord);
    shift.opening += bump;
    shift.load_slope -= bump * chord * std::cos(half) / width_;
  }
  double least_opening(double) const override { return std::min(0.0, amplitude_); }

 private:
  bool forward_, backward_;
  double amplitude_, position_, width_;
};

constexpr int kPlaces = 40;

double travel(const MotionRange& range) {
  return std::min(range.to - range.from, 2 * M_PI);
}

/// Only where the load has been: the records say nothing of other positions.
std::vector<double> positions(const MotionRange& range) {
  std::vector<double> all;
  for (int i = 0; i < kPlaces; ++i) all.push_back(range.from + (i + 0.5) / kPlaces * travel(range));
  return all;
}

/// Half and twice the distance of two places: a bump of any width from a fourth to four times that distance,
/// at any position, has a correlation of at least 0.6 with the nearest of these.
std::vector<double> widths(const MotionRange& range) {
  return {0.5 * travel(range) / kPlaces, 2 * travel(range) / kPlaces};
}

}  // namespace

TermType local_fault_term() {
  return {"local_fault",
          {{"flank", "-", Range::any(), "that is damaged", false, {"forward", "backward", "both"}},
           {"amplitude", "rad", Range::any(), "A, at the load"},
           {"position", "rad", Range::any(), "q0, of the load"},
           {"width", "rad", Range::positive(), "w"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> { return std::make_unique<LocalFault>(p); },
          TermSearch{"amplitude", "", clear_angle, {{"position", positions, true}, {"width", widths, true}}}};
}

}  // namespace backlash::model
