// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/plant.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "tolerances.h"

namespace backlash::simulation {
namespace {

constexpr long kMaxChangesPerCall = 100'000;

model::GearTrain gear_train_of(const model::Rig& rig, const ExcitationSettings& excitation) {
  if (excitation.at_load && rig.link_locked)
    throw InvalidParameter("excitation.at", "load", "the link is locked");
  model::GearTrain train(rig);
  if (excitation.motor_brake) train.brake_motor();
  return train;
}

int event_count(const model::GearTrain& train) {
  return (train.needs_touches() ? model::GearTrain::kContactEvents : 0) + train.friction_event_count();
}

/// A sample k / rate and a switch n / (2 f) that are meant to coincide may differ by this much.
double rounding(double t) {
  return 4 * std::numeric_limits<double>::epsilon() * std::fabs(t);
}

}  // namespace

Plant::Plant(const model::Rig& rig, const ExcitationSettings& excitation, const SolverSettings& solver)
    : gear_train_(gear_train_of(rig, excitation)),
      excitation_settings_(excitation),
      excitation_(excitation.create()),
      integrator_([this](double t, const double* state, double* rate) { derivative(t, state, rate); },
                  state_tolerances(gear_train_.dof(), solver), solver,
                  [this](double t, const double* state, double* values) { events(t, state, values); },
                  event_count(gear_train_)),
      initial_(rig) {
  reset();
}

void Plant::reset() {
  excitation_ = excitation_settings_.create();
  if (other_) gear_train_ = gear_train_of(initial_, excitation_settings_);
  other_ = false;
  gear_train_.set_backlash(initial_.mesh.backlash);
  state_.fill(0);
  time_ = 0;
  segment_ = 0;
  torque_until_ = std::numeric_limits<double>::infinity();
  gear_train_.begin_friction(time_, state_.data(), model::AppliedTorque());
  excitation_->begin_segment(segment_, gear_train_.observe(state_.data(), model::AppliedTorque()));
  begin();
}

model::AppliedTorque Plant::applied_torque(double t) const {
  const double torque = excitation_->torque(t, segment_);
  return excitation_settings_.at_load ? model::AppliedTorque(0, torque) : model::AppliedTorque(torque, 0);
}

/// Seen by the solver a body that sticks moves by roundings between its steps; by everybody else it does not.
Plant::State Plant::held(const double* state) const {
  State held{};
  std::copy(state, state + 2 * gear_train_.dof(), held.begin());
  gear_train_.hold(held.data());
  return held;
}

void Plant::derivative(double t, const double* state, double* rate) const {
  if (gear_train_.any_stuck())
    gear_train_.derivative(t, held(state).data(), applied_torque(t), rate);
  else
    gear_train_.derivative(t, state, applied_torque(t), rate);
}

void Plant::events(double t, const double* solved, double* values) const {
  const State now = held(solved);
  const double* const state = now.data();
  if (gear_train_.needs_touches()) {
    gear_train_.contact_events(state, values);
    values += model::GearTrain::kContactEvents;
  }
  gear_train_.friction_events(t, state, applied_torque(t), values);
}

/// True where contact or friction has changed.
bool Plant::update_modes(int event) {
  const bool touch = gear_train_.needs_touches() && event < model::GearTrain::kContactEvents;
  const bool touched = touch && gear_train_.update_contact(state_.data());
  return gear_train_.update_friction(time_, state_.data(), applied_torque()) || touched;
}

// A body that sticks lets the solver take steps of any length; it breaks away only where a step ends with too
// much torque, and one that slides stops only where a step ends with its speed reversed. A hundred steps per
// period see all but the last 0.05 percent of a peak.
void Plant::restart() {
  double longest = std::numeric_limits<double>::infinity();
  if (gear_train_.friction_event_count() > 0)
    longest = std::min(excitation_->shortest_period(segment_) / 100,
                       gear_train_.presliding_time(time_, state_.data(), applied_torque()));
  const double left = torque_until_ - time_;
  integrator_.restart(time_, state_.data(), std::min(torque_until_, excitation_->segment_end(segment_)),
                      longest, left > 0 && std::isfinite(left) ? left : 0);
}

/// Starts from a state in which contact did not come about by motion.
void Plant::begin() {
  gear_train_.update_friction(time_, state_.data(), applied_torque());  // a brake stops it before it touches
  if (gear_train_.needs_touches()) {
    gear_train_.begin_contact(state_.data());
    gear_train_.update_friction(time_, state_.data(), applied_torque());
  }
  restart();
}

/// Moves on to t, which lies in this segment, from event to event.
void Plant::integrate_to(double t) {
  long changes = 0;
  for (;;) {
    const int event = integrator_.integrate_to(t, state_.data());
    gear_train_.hold(state_.data());
    if (event == Integrator::kNoEvent) break;
    time_ = integrator_.time();
    if (!update_modes(event)) continue;
    if (++changes > kMaxChangesPerCall)
      throw IntegrationError("the teeth touch or a body sticks and slips without end, now at t = " +
                             std::to_string(time_) + " s");
    restart();
  }
  time_ = t;
}

void Plant::advance_to(double t) {
  if (!std::isfinite(t) || t < time_ - rounding(time_))
    throw InvalidParameter("time", t, "must be finite and >= " + std::to_string(time_) + " s");
  const double reach = t + rounding(t);
  for (double end = excitation_->segment_end(segment_); end <= reach;
       end = excitation_->segment_end(segment_)) {
    integrate_to(end);
    const model::Observation machine = observe();
    excitation_->begin_segment(++segment_, machine);
    gear_train_.update_friction(time_, state_.data(), applied_torque());
    restart();
  }
  integrate_to(std::max(t, time_));
}

void Plant::set_backlash(double backlash) {
  gear_train_.set_backlash(backlash);
  begin();
}

void Plant::set_machine(const model::Rig& rig) {
  model::GearTrain train = gear_train_of(rig, excitation_settings_);
  const auto require = [](bool same, const std::string& what) {
    if (!same) throw InvalidParameter("rig", what, "must be as in the machine that is simulated");
  };
  require(train.dof() == gear_train_.dof(), std::to_string(train.dof()) + " degrees of freedom");
  require(train.ratio() == gear_train_.ratio(), "the reduction ratio");
  require(train.needs_touches() == gear_train_.needs_touches(), "the kind of contact law");
  require(event_count(train) == event_count(gear_train_), "where there is dry friction");
  gear_train_ = std::move(train);
  other_ = true;
  gear_train_.begin_friction(time_, state_.data(), applied_torque());
  begin();
}

bool Plant::set_torque(double torque, double until) {
  if (!excitation_->set_torque(torque)) return false;
  torque_until_ = until;
  gear_train_.update_friction(time_, state_.data(), applied_torque());
  restart();
  return true;
}

void Plant::set_state(const State& state) {
  state_ = state;
  gear_train_.begin_friction(time_, state_.data(), applied_torque());
  begin();
}

}  // namespace backlash::simulation
