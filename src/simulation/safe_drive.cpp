// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/safe_drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::simulation {
namespace {

constexpr double kPlanStep = 1e-3;     // s; choice
constexpr double kSpeedWindow = 0.02;  // s, over which positions give a speed; choice
constexpr long kStatesAtRest = 10;     // that a noise is taken from; choice
constexpr double kNoise = 3;           // times the range at rest; choice
constexpr double kAtRest = 0.1;        // of the speed limit, the most at rest; choice
constexpr double kJump = 4;            // times the speed limit: no motion, but a wrong state; choice
constexpr double kJumpTime =
    0.01;  // s, shortest time that a jump is judged by: states may come in heaps; choice
constexpr double kLoaded = 0.5;  // of the largest torque; choice
// A machine that was at rest and stores no energy of its own cannot give back more work than it was given:
// work >= 0 (theory: passivity). Half of what was moved allows for delay and noise (choice).
constexpr double kGivenBack = 0.5;
constexpr double kWorkFloor =
    10;  // times largest torque times noise, moved before the sign is judged; choice
constexpr double kPi = 3.14159265358979323846;

void require_positive(const char* name, double value, const char* unit) {
  if (std::isnan(value)) throw InvalidParameter(name, "missing", fmt::format("must be given, > 0 {}", unit));
  if (!std::isfinite(value) || value <= 0)
    throw InvalidParameter(name, value, fmt::format("must be > 0 {}", unit));
}

void check(const DriveLimits& limits, const SafeDriveSettings& settings) {
  require_positive("torque_limit", limits.torque, "N m");
  require_positive("speed_limit", limits.speed, "rad/s");
  if (!std::isfinite(limits.lower))
    throw InvalidParameter("position_lower", "missing", "must be given, a finite angle in rad");
  if (!std::isfinite(limits.upper))
    throw InvalidParameter("position_upper", "missing", "must be given, a finite angle in rad");
  if (limits.upper <= limits.lower)
    throw InvalidParameter("position_upper", limits.upper, "must be above position_lower");
  require_positive("duration_limit", limits.duration, "s");
  require_positive("ramp", settings.ramp, "s");
  require_positive("rest", settings.rest, "s");
  require_positive("state_age", settings.state_age, "s");
  require_positive("still", settings.still, "s");
}

void check(const ExcitationSettings& excitation) {
  if (excitation.is_speed_loop())
    throw InvalidParameter("run", excitation.type,
                           "must be a torque that is known beforehand, no speed loop");
  if (excitation.type == "topic") throw InvalidParameter("run", excitation.type, "says no torque");
  if (excitation.at_load || excitation.motor_brake)
    throw InvalidParameter("run", excitation.type, "must act on the motor: no other torque is commanded");
}

}  // namespace

SafeDrive::SafeDrive(const ExcitationSettings& excitation, double duration, const DriveLimits& limits,
                     const SafeDriveSettings& settings)
    : excitation_(excitation), duration_(duration), limits_(limits), settings_(settings) {
  check(limits, settings);
  check(excitation);
  require_positive("duration", duration, "s");
  if (duration > limits.duration)
    throw InvalidParameter("duration", duration,
                           fmt::format("is above duration_limit = {} s", limits.duration));
  if (duration < 2 * settings.ramp)
    throw InvalidParameter("duration", duration, "is shorter than the two ramps");
  make_plan();
  if (plan_.largest_torque > limits.torque)
    throw InvalidParameter("run", fmt::format("a torque of {:.4g} N m", plan_.largest_torque),
                           fmt::format("is above torque_limit = {} N m", limits.torque));
  if (plan_.largest_torque == 0) throw InvalidParameter("run", "no torque", "would move nothing");
}

void SafeDrive::make_plan() {
  const auto torque = excitation_.create();
  long segment = 0;
  torque->begin_segment(segment, {});
  const auto count = static_cast<long>(std::ceil(duration_ / kPlanStep));
  for (long i = 0; i <= count; ++i) {
    const double t = std::min(duration_, static_cast<double>(i) * kPlanStep);
    while (t >= torque->segment_end(segment)) torque->begin_segment(++segment, {});
    const double edge = std::min({1.0, t / settings_.ramp, (duration_ - t) / settings_.ramp});
    const double value = (1 - std::cos(kPi * edge)) / 2 * torque->torque(t, segment);
    plan_.time.push_back(t);
    plan_.torque.push_back(value);
    plan_.largest_torque = std::max(plan_.largest_torque, std::abs(value));
  }
}

/// The step of the plan that t lies in, held, so that no command is larger than what was checked.
double SafeDrive::planned(double t) const {
  const auto i = static_cast<std::size_t>(std::max(0.0, t / kPlanStep));
  return i + 1 < plan_.torque.size() ? plan_.torque[i] : 0;
}

void SafeDrive::start(double now) {
  started_ = true;
  begin_ = last_come_ = last_now_ = now;
}

void SafeDrive::stop(const std::string& reason) {
  if (ended_) return;
  ended_ = true;
  command_ = 0;
  reason_ = reason;
}

void SafeDrive::take(double now, double stamp, double position, std::optional<double> velocity) {
  if (!started_ || ended_) return;
  if (!std::isfinite(position) || !std::isfinite(stamp) || (velocity && !std::isfinite(*velocity)))
    return stop("the state is not a finite number");
  if (!recent_.empty() && stamp <= recent_.back().stamp)
    return stop(fmt::format("the stamp of the state did not go on ({:.6f} s after {:.6f} s)", stamp,
                            recent_.back().stamp));
  const State state{stamp, position};
  last_come_ = now;
  if (states_++ == 0) {
    lowest_ = highest_ = position;
    recent_ = {state};
  }
  check_motion(state, velocity);
  const double step = std::abs(position - recent_.back().position);
  if (step > 0 && (resolution_ == 0 || step < resolution_)) resolution_ = step;
  lowest_ = std::min(lowest_, position);
  highest_ = std::max(highest_, position);
  if (driving_ && !ended_) check_work(state);
  recent_.push_back(state);
  while (recent_.size() > 2 && stamp - recent_[1].stamp >= kSpeedWindow) recent_.erase(recent_.begin());
}

/// Over the window, so that the noise of a position is no speed; 0 until the window is full.
double SafeDrive::speed(const State& state) const {
  const double time = state.stamp - recent_.front().stamp;
  if (time < kSpeedWindow) return 0;
  return (state.position - recent_.front().position) / time;
}

void SafeDrive::check_motion(const State& state, std::optional<double> velocity) {
  const State& before = recent_.back();
  const double elapsed = std::max(state.stamp - before.stamp, kJumpTime);
  const double step = std::abs(state.position - before.position);
  if (step > kJump * limits_.speed * elapsed + noise_)
    return stop(fmt::format("the position jumped by {:.4g} rad in {:.4g} s", step, elapsed));
  const double apparent = speed(state);
  const double allowed = limits_.speed + noise_ / kSpeedWindow;
  if (std::abs(apparent) > allowed || (velocity && std::abs(*velocity) > limits_.speed))
    return stop(fmt::format("the speed of {:.4g} rad/s is above speed_limit = {} rad/s",
                            velocity && std::abs(*velocity) > limits_.speed ? *velocity : apparent,
                            limits_.speed));
  // Where it may be before the next state is missed.
  const double ahead = state.position + velocity.value_or(apparent) * settings_.state_age;
  for (const double at : {state.position, ahead})
    if (at < limits_.lower || at > limits_.upper)
      return stop(fmt::format("the position {:.4g} rad {} the limits {} to {} rad", state.position,
                              at == state.position ? "is outside of" : "is about to leave", limits_.lower,
                              limits_.upper));
}

void SafeDrive::check_work(const State& state) {
  const double work = command_ * (state.position - recent_.back().position);
  work_ += work;
  moved_work_ += std::abs(work);
  const double floor = kWorkFloor * plan_.largest_torque * std::max(noise_, resolution_);
  if (moved_work_ > floor && work_ < -kGivenBack * moved_work_)
    stop(
        "the joint moves against the commanded torque: the sign of torque or position is reversed, its state "
        "comes late, or something else drives the joint (gravity, another controller)");
}

void SafeDrive::end_of_rest() {
  if (states_ < kStatesAtRest)
    return stop(fmt::format("only {} states came in {} s, at least {} are needed", states_, settings_.rest,
                            kStatesAtRest));
  const double range = highest_ - lowest_;
  if (range > kAtRest * limits_.speed * settings_.rest)
    return stop(fmt::format("the joint is not at rest: its position moved by {:.4g} rad in {} s", range,
                            settings_.rest));
  noise_ = kNoise * range;
  driving_ = true;
  begin_ = last_now_;
  lowest_ = highest_ = recent_.back().position;
}

void SafeDrive::check_movement(double now) {
  if (std::abs(command_) >= kLoaded * plan_.largest_torque) loaded_ += now - last_now_;
  if (loaded_ > settings_.still && highest_ - lowest_ <= noise_ + 2 * resolution_)
    stop(fmt::format(
        "nothing moved in {:.3g} s at half of the largest torque ({:.4g} N m) or more: the controller takes "
        "no commands, a brake holds, or friction is larger",
        loaded_, plan_.largest_torque));
}

double SafeDrive::torque(double now) {
  if (!started_ || ended_) return 0;
  if (!std::isfinite(now) || now < last_now_) {
    stop("the clock went back");
    return 0;
  }
  if (now - last_come_ > settings_.state_age)
    stop(fmt::format("no state came for {:.0f} ms (state_age = {:.0f} ms)", 1e3 * (now - last_come_),
                     1e3 * settings_.state_age));
  if (driving_ && !ended_) check_movement(now);
  last_now_ = now;
  if (!driving_ && !ended_ && now - begin_ >= settings_.rest) end_of_rest();
  if (driving_ && now - begin_ >= duration_) ended_ = true;
  command_ = driving_ && !ended_ ? planned(now - begin_) : 0;
  return command_;
}

double SafeDrive::fraction(double now) const {
  return driving_ ? std::clamp((now - begin_) / duration_, 0.0, 1.0) : 0;
}

}  // namespace backlash::simulation
