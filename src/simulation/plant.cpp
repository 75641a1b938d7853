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
          absolute_tolerances(gear_train_.dof(), solver), solver),
      initial_backlash_(rig.mesh.backlash) {
  reset();
}

void Plant::reset() {
  excitation_ = excitation_settings_.create();
  gear_train_.set_backlash(initial_backlash_);
  state_.fill(0);
  time_ = 0;
  segment_ = 0;
  restart();
}

void Plant::restart() {
  integrator_.restart(time_, state_.data(), excitation_->segment_end(segment_));
}

void Plant::advance_to(double t) {
  if (!std::isfinite(t) || t < time_ - rounding(time_))
    throw InvalidParameter("time", t, "must be finite and >= " + std::to_string(time_) + " s");
  const double reach = t + rounding(t);
  for (double end = excitation_->segment_end(segment_); end <= reach;
       end = excitation_->segment_end(segment_)) {
    integrator_.integrate_to(end, state_.data());
    time_ = end;
    ++segment_;
    restart();
  }
  integrator_.integrate_to(std::max(t, time_), state_.data());
  time_ = std::max(t, time_);
}

void Plant::set_backlash(double backlash) {
  gear_train_.set_backlash(backlash);
  restart();
}

bool Plant::set_torque(double torque) {
  if (!excitation_->set_torque(torque)) return false;
  restart();
  return true;
}

void Plant::set_state(const State& state) {
  state_ = state;
  restart();
}

}  // namespace backlash
