// SPDX-License-Identifier: BSD-3-Clause
// A motor torque that acts later than its stamp says, by d [s]; earlier for d < 0:
//   J_M a_M(t) = tau_M(t - d) - ...
// A drive that takes time to build up current, a command recorded in place of the torque, or channels that
// are stamped on different ways. Only the relation of torque and motion counts: the simulation delays
// whichever of the two comes late (see Simulation).
#include "terms.h"

namespace backlash::model {
namespace {

class Delay : public Term {
 public:
  explicit Delay(double delay) : delay_(delay) {}
  void sense(Sensing& sensing) const override { sensing.torque_delay += delay_; }
  bool moves_load() const override { return false; }

 private:
  double delay_;
};

}  // namespace

TermType delay_term() {
  TermType type{"delay",
                {{"delay", "s", Range::between(-1, 1), "d, > 0: the torque acts later than its stamp says"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<Delay>(p.at("delay"));
                },
                TermSearch{"delay", "", [](const MotionRange& range) { return range.interval; }, {}}};
  type.calibrates = Calibrates::torque_delay;
  return type;
}

}  // namespace backlash::model
