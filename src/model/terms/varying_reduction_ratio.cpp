// SPDX-License-Identifier: BSD-3-Clause
// A reduction ratio that varies with the transmitted torque, as Yumrukcal (2013, Section 6.2.1) suspects: the
// motor angle at the load side is q_P (1 + a T), T the torque through the mesh,
//   o_s = -s a T q_P      opening of the flank of side s = +-1 [rad at the load]
// a [1/(N m)]. Equal tooth counts keep the mean ratio, so over whole turns no gear can do this; over the
// travel of a sector it describes a residual that is proportional to travel and torque. Valid while
// |a q_P| times the mesh stiffness [N m/rad] is below 1, and not conservative.
#include <algorithm>
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class VaryingReductionRatio : public Term {
 public:
  explicit VaryingReductionRatio(double change) : change_(change) {}
  bool shapes_flanks() const override { return true; }
  bool shape_follows_torque() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    shift.opening -= at.side * change_ * at.mesh_torque * at.motor_position;
    shift.motor_slope -= at.side * change_ * at.mesh_torque;
  }

 private:
  double change_;
};

/// Moves the flanks by a share of the deflection where the torque is large and the motor far out.
double clear_change(const MotionRange& range) {
  const double reach = std::max(std::fabs(range.from), std::fabs(range.to));
  return clear_angle(range) / (range.torque * std::max(reach, range.deflection));
}

}  // namespace

TermType varying_reduction_ratio_term() {
  return {"varying_reduction_ratio",
          {{"change", "1/(N m)", Range::any(), "a, relative change of the ratio per torque"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<VaryingReductionRatio>(p.at("change"));
          },
          TermSearch{"change", "", clear_change, {}, false, true}};
}

}  // namespace backlash::model
