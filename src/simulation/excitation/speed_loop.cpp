// SPDX-License-Identifier: BSD-3-Clause
// A drive under speed control: a sampled PI controller whose torque is held from one of its samples to the
// next. It sees the motor's exact speed; the sensors of the rig belong to the record.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "backlash_diagnosis/simulation/excitation.h"
#include "checks.h"

namespace backlash::simulation {
namespace {

using Reference = std::function<double(double)>;  // rad/s at time t [s]

class SpeedLoop : public Excitation {
 public:
  SpeedLoop(const SpeedController& controller, Reference reference)
      : controller_(controller), reference_(std::move(reference)) {}

  double torque(double, long) const override { return torque_; }
  double segment_end(long segment) const override { return double(segment + 1) / controller_.rate; }

  void begin_segment(long segment, const model::Observation& machine) override {
    if (segment == sampled_) return;  // the machine was changed between two samples
    sampled_ = segment;
    const double error = reference_(double(segment) / controller_.rate) - machine.motor_velocity;
    const double integral = integral_ + controller_.integral * error / controller_.rate;
    const double demand = controller_.proportional * error + integral;
    torque_ = std::clamp(demand, -controller_.torque_limit, controller_.torque_limit);
    const bool winds_up = demand != torque_ && error * demand > 0;
    if (!winds_up) integral_ = integral;
  }

 private:
  SpeedController controller_;
  Reference reference_;
  long sampled_ = -1;
  double integral_ = 0, torque_ = 0;  // N m
};

/// 0 at x <= 0, 1 at x >= 1, without a kink.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

void check(const SpeedController& controller) {
  require("controller.rate", controller.rate, Range::positive());
  require("controller.proportional", controller.proportional, Range::not_negative());
  require("controller.integral", controller.integral, Range::not_negative());
  require("controller.torque_limit", controller.torque_limit, Range::positive());
}

}  // namespace

std::unique_ptr<Excitation> constant_speed_excitation(const SpeedController& controller,
                                                      std::vector<double> speeds, double hold, double ramp) {
  check(controller);
  if (speeds.empty()) throw InvalidParameter("excitation.speeds", "[]", "needs at least one speed");
  for (const double speed : speeds) require("speeds", speed, Range::any());
  require("ramp", ramp, Range::positive());
  if (!(hold > 0)) throw InvalidParameter("excitation.hold", hold, "must be > 0");
  const auto reference = [speeds = std::move(speeds), step = ramp + hold, ramp](double t) {
    const auto k = static_cast<std::size_t>(t / step);
    const double from = k == 0 ? 0 : speeds[(k - 1) % speeds.size()], to = speeds[k % speeds.size()];
    const double s = k == 0 ? t : t - static_cast<double>(k) * step;
    return from + (to - from) * smooth_step(s / ramp);
  };
  return std::make_unique<SpeedLoop>(controller, reference);
}

std::unique_ptr<Excitation> sine_speed_excitation(const SpeedController& controller, double offset,
                                                  double amplitude, double frequency, double ramp) {
  check(controller);
  require("offset", offset, Range::any());
  require("amplitude", amplitude, Range::any());
  require("frequency", frequency, Range::positive());
  require("ramp", ramp, Range::positive());
  return std::make_unique<SpeedLoop>(controller, [=](double t) {
    return smooth_step(t / ramp) * (offset + amplitude * std::sin(2 * M_PI * frequency * t));
  });
}

}  // namespace backlash::simulation
