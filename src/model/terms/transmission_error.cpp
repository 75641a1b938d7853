// SPDX-License-Identifier: BSD-3-Clause
// Transmission error: the mesh is displaced by a function of the load position,
//   x = q_P - q_G + A sin(n q + p)     A [rad at the load], q = load position, n periods per load turn
// Both flanks move together: one opens where the other closes.
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class TransmissionError : public Term {
 public:
  TransmissionError(double amplitude, double order, double phase)
      : amplitude_(amplitude), order_(order), phase_(phase) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    const double angle = order_ * at.load_position + phase_;
    shift.opening -= at.side * amplitude_ * std::sin(angle);
    shift.load_slope -= at.side * amplitude_ * order_ * std::cos(angle);
  }
  double least_opening(double) const override { return -std::fabs(amplitude_); }

 private:
  double amplitude_, order_, phase_;
};

WaveMoment over_load_position(const Motion& m, const ParameterValues&) {
  return {m.load_position, m.load_velocity, 1};
}

}  // namespace

TermType transmission_error_term() {
  return {"transmission_error",
          {{"amplitude", "rad", Range::any(), "A, at the load"},
           {"order", "1/rad", Range::positive(), "n, periods per load turn"},
           {"phase", "rad", Range::any(), "p"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<TransmissionError>(p.at("amplitude"), p.at("order"), p.at("phase"));
          },
          TermSearch{"amplitude", "phase", clear_angle, {order_shape({true, over_load_position})}}};
}

}  // namespace backlash::model
