// SPDX-License-Identifier: BSD-3-Clause
// Several rigs that differ in their numbers only, under the same torque, moved at once: a curve, a family of
// distributions and the differences of a fit need the same machine again and again with one value changed.
#pragma once

#include <memory>
#include <vector>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/simulation/excitation.h"
#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::simulation {

class RigGroup;

/// By the explicit pair of Tsitouras (2011), which stands beside SUNDIALS here because a step of a few rigs
/// in vector registers is shorter than the library's own work for one. The tolerances are those of `solver`,
/// the method is not. Each rig has steps of its own: what it does depends neither on those beside it nor on
/// the processor, and one alone is moved by the same code.
class Ensemble {
 public:
  /// Whether these can be moved at once: smooth trains (GearTrain::smooth()) of one layout with contact laws
  /// of one exponent (ContactLaw::power_contact()), and an excitation that asks nothing of the machine.
  /// Others need a Plant each.
  static bool takes(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation);

  /// All at rest in the middle of their gaps at time 0, as Plant. Throws InvalidParameter where takes() says
  /// no.
  Ensemble(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation,
           const SolverSettings& solver);
  ~Ensemble();

  /// Moves all on to t [s], not before time(). At a switch of the torque it is that after it. Throws
  /// InvalidParameter for another t, IntegrationError where a step would have to be shorter than rounding.
  void advance_to(double t);

  std::size_t size() const { return trains_.size(); }
  double time() const { return time_; }
  model::Observation observe(std::size_t rig) const;
  /// 2 dof numbers of one rig, as Plant::state().
  std::vector<double> state(std::size_t rig) const;
  long steps() const;  // attempts at one, counted once for rigs that are moved together

 private:
  struct Place {
    RigGroup* group;
    int lane;
  };

  std::vector<model::GearTrain> trains_;
  bool at_load_;
  std::unique_ptr<Excitation> excitation_;
  std::vector<std::unique_ptr<RigGroup>> groups_;
  std::vector<Place> places_;  // of each rig
  double time_ = 0;
  long segment_ = 0;
};

}  // namespace backlash::simulation
