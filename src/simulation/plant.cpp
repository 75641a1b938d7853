#include "backlash_diagnosis/simulation/plant.h"

#include <algorithm>

namespace backlash {
namespace {

std::vector<double> absolute_tolerances(int dof, const SolverSettings& solver) {
  std::vector<double> tolerances(2 * dof, solver.position_tolerance);
  std::fill(tolerances.begin() + dof, tolerances.end(), solver.velocity_tolerance);
  return tolerances;
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

void Plant::restart() { integrator_.restart(time_, state_.data(), excitation_->segment_end(segment_)); }

void Plant::advance_to(double t) {
  while (excitation_->segment_end(segment_) <= t) {
    time_ = excitation_->segment_end(segment_);
    integrator_.integrate_to(time_, state_.data());
    ++segment_;
    restart();
  }
  integrator_.integrate_to(t, state_.data());
  time_ = t;
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
