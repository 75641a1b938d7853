// SPDX-License-Identifier: BSD-3-Clause
// A drive under speed control: a sampled PI controller whose torque is held from one of its samples to the
// next. It sees the motor's exact speed; the sensors of the rig belong to the record.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "backlash_diagnosis/simulation/excitation.h"
#include "checks.h"

namespace backlash::simulation {
namespace {

/// rad/s at time t [s], with the motor at a position [rad].
using Reference = std::function<double(double t, double position)>;

class SpeedLoop : public Excitation {
 public:
  SpeedLoop(const SpeedController& controller, Reference reference)
      : controller_(controller), reference_(std::move(reference)) {}

  double torque(double, long) const override { return torque_; }
  double segment_end(long segment) const override { return double(segment + 1) / controller_.rate; }

  void begin_segment(long segment, const model::Observation& machine) override {
    if (segment == sampled_) return;  // the machine was changed between two samples
    sampled_ = segment;
    const double wanted = reference_(double(segment) / controller_.rate, machine.motor_position);
    const double error = wanted - machine.motor_velocity;
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

struct Motion {
  double position, velocity;  // rad, rad/s
};

/// From one position to another as fast as speed and acceleration allow: the speed is a trapezoid.
class Move {
 public:
  Move(double from, double to, double speed, double acceleration)
      : from_(from), to_(to), acceleration_(acceleration) {
    const double distance = std::fabs(to - from);
    speed_ = std::min(speed, std::sqrt(distance * acceleration));
    rise_ = speed_ / acceleration;
    duration_ = distance > 0 ? distance / speed_ + rise_ : 0;
  }
  double duration() const { return duration_; }

  /// s: since its begin; before and after it stands.
  Motion at(double s) const {
    const double sign = to_ > from_ ? 1 : -1;
    if (s >= duration_) return {to_, 0};
    if (s < rise_) return {from_ + sign * acceleration_ * s * s / 2, sign * acceleration_ * s};
    const double left = duration_ - s;
    if (left < rise_) return {to_ - sign * acceleration_ * left * left / 2, sign * acceleration_ * left};
    return {from_ + sign * speed_ * (s - rise_ / 2), sign * speed_};
  }

 private:
  double from_, to_, acceleration_, speed_ = 0, rise_ = 0, duration_ = 0;
};

/// The first move starts at 0, all others where the one before it ended.
class Task {
 public:
  explicit Task(const MoveSettings& settings) : dwell_(settings.dwell) {
    const std::vector<double>& at = settings.positions;
    for (std::size_t k = 0; k <= at.size(); ++k)
      moves_.emplace_back(k == 0 ? 0 : at[k - 1], at[k % at.size()], settings.speed, settings.acceleration);
    for (std::size_t k = 1; k < moves_.size(); ++k) cycle_ += moves_[k].duration() + dwell_;
  }

  Motion at(double t) const {
    const double first = moves_.front().duration() + dwell_;
    if (t < first) return moves_.front().at(t);
    t = std::fmod(t - first, cycle_);
    std::size_t k = 1;
    for (; k + 1 < moves_.size() && t >= moves_[k].duration() + dwell_; ++k)
      t -= moves_[k].duration() + dwell_;
    return moves_[k].at(t);
  }

 private:
  double dwell_, cycle_ = 0;  // s
  std::vector<Move> moves_;
};

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
  const auto reference = [speeds = std::move(speeds), step = ramp + hold, ramp](double t, double) {
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
  return std::make_unique<SpeedLoop>(controller, [=](double t, double) {
    return smooth_step(t / ramp) * (offset + amplitude * std::sin(2 * M_PI * frequency * t));
  });
}

std::unique_ptr<Excitation> moves_excitation(const SpeedController& controller, const MoveSettings& moves) {
  check(controller);
  require("position_gain", moves.position_gain, Range::positive());
  require("speed", moves.speed, Range::positive());
  require("acceleration", moves.acceleration, Range::positive());
  require("dwell", moves.dwell, Range::positive());
  for (const double position : moves.positions) require("positions", position, Range::any());
  if (moves.positions.size() < 2)
    throw InvalidParameter("excitation.positions", double(moves.positions.size()),
                           "needs at least two positions");
  return std::make_unique<SpeedLoop>(
      controller, [task = Task(moves), gain = moves.position_gain](double t, double position) {
        const Motion wanted = task.at(t);
        return wanted.velocity + gain * (wanted.position - position);
      });
}

std::unique_ptr<Excitation> fourier_excitation(const SpeedController& controller, const FourierMotion& motion,
                                               double position_gain) {
  check(controller);
  check(motion);
  require("position_gain", position_gain, Range::positive());
  return std::make_unique<SpeedLoop>(controller, [=](double t, double position) {
    const Kinematics wanted = kinematics(motion, t);
    return wanted.velocity + position_gain * (wanted.position - position);
  });
}

}  // namespace backlash::simulation
