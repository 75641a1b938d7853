// SPDX-License-Identifier: BSD-3-Clause
// A gear train in motion: excitation, equations of motion and integrator, without sensors.
#pragma once

#include <array>
#include <limits>
#include <memory>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/simulation/excitation.h"
#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::simulation {

/// Where the contact law depends on how a contact began, each touch of a flank is found, passed to the gear
/// train and started from; other laws are simply integrated through. Dry friction likewise: each standstill
/// and each break-away is found, so that a body that sticks stays exactly where it is.
class Plant {
 public:
  using State = std::array<double, model::GearTrain::kMaxStates>;

  Plant(const model::Rig& rig, const ExcitationSettings& excitation, const SolverSettings& solver);
  Plant(const Plant&) = delete;  // the integrator refers to this object
  Plant& operator=(const Plant&) = delete;

  /// Back to time 0 at rest in the middle of the gap, no external torque, the machine as at the start.
  void reset();

  /// Integrates up to t [s], t >= time(). Stops and starts again at every switch of the excitation on the
  /// way; at a switch (to within rounding) the torque is that after it, and time() the switch. Throws
  /// InvalidParameter for another t, and IntegrationError (also for more than 10^5 touches and partings),
  /// after which only reset() helps.
  void advance_to(double t);

  /// Changes that act from time() on; the integrator starts again there. A new backlash or state makes the
  /// contact law forget the last touch; a flank that then just closes is a touch at time(), with its jump if
  /// the law has one.
  void set_backlash(double backlash);  // m (angular mesh: rad), total free play
  /// N m; false unless the excitation is `topic`. `until` [s]: when it is set again, where that is known and
  /// soon: saves time, and until then advance_to() goes no further.
  bool set_torque(double torque, double until = std::numeric_limits<double>::infinity());
  void set_state(const State& state);
  /// Another machine in the same motion: as if it had broken, worn or been loaded at this moment. Throws
  /// InvalidParameter, and changes nothing, for one with other degrees of freedom, dry friction at other
  /// places, another ratio or another kind of contact.
  void set_machine(const model::Rig& rig);

  double time() const { return time_; }
  const State& state() const { return state_; }
  const model::GearTrain& gear_train() const { return gear_train_; }
  double excitation_period() const { return excitation_->period(); }
  model::AppliedTorque applied_torque() const { return applied_torque(time_); }
  double motor_torque() const { return applied_torque().motor; }
  model::Observation observe() const { return gear_train_.observe(state_.data(), applied_torque(), time_); }
  IntegratorStatistics statistics() const { return integrator_.statistics(); }

 private:
  model::AppliedTorque applied_torque(double t) const;
  State held(const double* state) const;
  void derivative(double t, const double* state, double* rate) const;
  void events(double t, const double* state, double* values) const;
  bool update_modes(int event);
  void restart();
  void begin();
  void integrate_to(double t);

  model::GearTrain gear_train_;
  ExcitationSettings excitation_settings_;
  std::unique_ptr<Excitation> excitation_;
  Integrator integrator_;
  State state_{};
  double time_ = 0;
  long segment_ = 0;
  double torque_until_ = std::numeric_limits<double>::infinity();  // s, if known
  const model::Rig initial_;                                       // what reset() goes back to
  bool other_ = false;                                             // set_machine() was called since
};

}  // namespace backlash::simulation
