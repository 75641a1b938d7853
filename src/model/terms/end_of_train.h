// SPDX-License-Identifier: BSD-3-Clause
// Common to the terms that act on one end of the gear train (`body: motor | load`); the search tries both
// ends.
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

inline ParameterSpec body_parameter() {
  return {"body", "-", Range::any(), "the end that it acts on", false, {"motor", "load"}};
}

class EndOfTrain {
 public:
  explicit EndOfTrain(const ParameterValues& values) : load_(values.choice("body") == "load") {}

  bool is_load() const { return load_; }
  double position(const Motion& m) const { return load_ ? m.load_position : m.motor_position; }
  double velocity(const Motion& m) const { return load_ ? m.load_velocity : m.motor_velocity; }
  double& torque(EndTorques& ends) const { return load_ ? ends.load : ends.motor; }
  FrictionLimits& limits(EndFriction& friction) const { return load_ ? friction.load : friction.motor; }

  /// Adds dry friction that is the same in both directions.
  void rub(double torque, EndFriction& friction) const {
    limits(friction).forward += torque;
    limits(friction).backward += torque;
  }

 private:
  bool load_;
};

/// A term that adds to the dry friction of one end.
class EndFrictionTerm : public Term {
 public:
  explicit EndFrictionTerm(const ParameterValues& parameters) : end_(parameters) {}
  bool has_dry_friction() const override { return true; }
  bool moves_load() const override { return end_.is_load(); }

 protected:
  EndOfTrain end_;
};

/// A term that adds a smooth torque on one end.
class EndTorqueTerm : public Term {
 public:
  explicit EndTorqueTerm(const ParameterValues& parameters) : end_(parameters) {}
  bool moves_load() const override { return end_.is_load(); }

 protected:
  EndOfTrain end_;
};

}  // namespace backlash::model
