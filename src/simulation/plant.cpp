#include "backlash_diagnosis/simulation/plant.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

std::vector<double> absolute_tolerances(int dof, const SolverSettings& solver) {
  std::vector<double> tolerances(2 * dof, solver.position_tolerance);
  std::fill(tolerances.begin() + dof, tolerances.end(), solver.velocity_tolerance);
  return tolerances;
}

constexpr long kMaxTouchesPerCall = 100'000;

/// A sample k / rate and a switch n / (2 f) that are meant to coincide may differ by this much.
double rounding(double t) {
  return 4 * std::numeric_limits<double>::epsilon() * std::fabs(t);
}

}  // namespace

Plant::Plant(const Rig& rig, const ExcitationSettings& excitation, const SolverSettings& solver)
    : gear_train_(rig),
      excitation_settings_(excitation),
      excitation_(excitation.create()),
      integrator_(
          [this](double t, const double* state, double* rate) {
            gear_train_.derivative(t, state, excitation_->torque(t, segment_), rate);
          },
          absolute_tolerances(gear_train_.dof(), solver), solver,
          [this](double, const double* state, double* values) { gear_train_.contact_events(state, values); },
          gear_train_.needs_touches() ? GearTrain::kContactEvents : 0),
      initial_backlash_(rig.mesh.backlash) {
  reset();
}

void Plant::reset() {
  excitation_ = excitation_settings_.create();
  gear_train_.set_backlash(initial_backlash_);
  state_.fill(0);
  time_ = 0;
  segment_ = 0;
  begin_contact();
}

void Plant::restart() {
  integrator_.restart(time_, state_.data(), excitation_->segment_end(segment_));
}

/// Starts from a state that did not come about by motion.
void Plant::begin_contact() {
  if (gear_train_.needs_touches()) gear_train_.begin_contact(state_.data());
  restart();
}

/// Moves on to t, which lies in this segment, from touch to touch.
void Plant::integrate_to(double t) {
  long changes = 0;
  while (integrator_.integrate_to(t, state_.data()) != Integrator::kNoEvent) {
    time_ = integrator_.time();
    if (!gear_train_.update_contact(state_.data())) continue;
    if (++changes > kMaxTouchesPerCall)
      throw IntegrationError("the teeth touch without end, now at t = " + std::to_string(time_) + " s");
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
    ++segment_;
    restart();
  }
  integrate_to(std::max(t, time_));
}

void Plant::set_backlash(double backlash) {
  gear_train_.set_backlash(backlash);
  begin_contact();
}

bool Plant::set_torque(double torque) {
  if (!excitation_->set_torque(torque)) return false;
  restart();
  return true;
}

void Plant::set_state(const State& state) {
  state_ = state;
  begin_contact();
}

}  // namespace backlash
