// SPDX-License-Identifier: BSD-3-Clause
// An effect that src/model/terms does not have: the drag of a conducting disk in a magnet's field, as a user
// would add it, in one file.
//   motor torque = -2 A x / (1 + x^2), x = w / wc     A [N m] the most, at the speed wc [rad/s]
// (W. R. Smythe 1942, Trans. AIEE 61:681, of a disk whose own field counts.) It grows with the speed as
// viscous drag does, and falls beyond wc.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "backlash_diagnosis/model/register_term.h"

namespace backlash::test {

inline double eddy_current_torque(double most, double critical, double speed) {
  const double x = speed / critical;
  return 2 * most * x / (1 + x * x);
}

class EddyCurrentBrake : public model::Term {
 public:
  EddyCurrentBrake(double most, double critical) : most_(most), critical_(critical) {}
  bool moves_load() const override { return false; }
  void add(const model::Motion& motion, model::EndTorques& torques) const override {
    torques.motor -= eddy_current_torque(most_, critical_, motion.motor_velocity);
  }

 private:
  double most_, critical_;
};

inline model::TermType eddy_current_brake() {
  model::TermType type{
      "eddy_current_brake",
      {{"torque", "N m", Range::not_negative(), "A"}, {"speed", "rad/s", Range::positive(), "wc"}},
      [](const ParameterValues& p) -> std::unique_ptr<model::Term> {
        return std::make_unique<EddyCurrentBrake>(p.at("torque"), p.at("speed"));
      }};
  type.search =
      model::TermSearch{"torque",
                        "",
                        [](const model::MotionRange& range) { return 0.05 * range.torque; },
                        {{"speed",
                          [](const model::MotionRange& range) {
                            return std::vector<double>{0.1 * range.speed, 0.3 * range.speed, range.speed};
                          },
                          true}}};
  return type;
}

}  // namespace backlash::test
