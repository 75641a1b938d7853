// SPDX-License-Identifier: BSD-3-Clause
// Pairs of teeth that come into and leave contact, each with its own stiffness, damping and gear error:
// Yumrukcal (2013), Eqs. 2.1 to 2.4, which are for two pairs that always touch.
//
// On each flank, with the depth d [m] by which teeth without error would overlap, pair i and the travel u_i
// of the pair since its first touch [base pitches] (mesh_stiffness.h):
//
//   d_i = d - e_i(u_i)                       e_i [m] > 0: the pair's flanks lie back and touch later
//   F   = sum over the pairs with d_i > 0 of w_i(u_i) f(d_i, d_i')          [N]
//   w_i = k_i / mean of the sum of all k_i over a mesh cycle
//
// f is the contact law of the mesh. Its stiffness is then the mean stiffness of the mesh over a cycle, its
// damping that of the mesh, and both come and go with the pair. Of a linear law that is Eq. 2.4,
// sum (c_i (x' - e_i') + k_i (x - e_i)), but that a pair never pulls. The error of a pair is
//
//   e_i(u) = slope (t - 1/2) + crown (2 t - 1)^2 + side (p_pinion + p_gear),    t = u / contact ratio
//
// with the form of the flanks (both alike; slope: last touch minus first; crown: both ends against the
// middle), and with the distance p by which each of the two teeth stands back from its nominal place,
// constant while the pair touches:
//
//   p = runout sin(2 pi tooth / teeth + phase) + error of that tooth          side: +1 forward, -1 reverse
//
// A tooth that stands back on one flank stands out on the other. Tooth 0 of the pinion meets tooth 0 of the
// gear on the forward flank at phase 0 to contact ratio, its other flank meets tooth 1 of the gear.
//
// The errors and stiffnesses change with the pinion's travel s = r q_P [m]. So that elastic energy is
// conserved, the pinion also feels these changes:
//
//   torque on the gear    r side F
//   torque on the pinion  -r (side F - sum (F_i de_i/ds - dw_i/ds E(d_i)))     E [J]: elastic energy of f
//
// StiffnessVariation leaves that out. Not included: contact off the line of action (the `transition` of the
// stiffness stands for it), friction between the teeth, bending of the gears' bodies.
#pragma once

#include <map>
#include <memory>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/model/stiffness_variation.h"

namespace backlash::model {

/// Distance by which the teeth of one gear stand back from their nominal place [m along the line of action].
struct PitchErrors {
  double runout = 0, phase = 0;     // m, rad
  std::map<long, double> of_tooth;  // m, beside the runout; 0 of a tooth that is not named
};

/// All along the line of action.
struct ToothErrors {
  double slope = 0, crown = 0;  // m, of a pair of flanks over its path of contact
  PitchErrors pinion, gear;
};

class ToothPairs {
 public:
  /// Throws InvalidParameter without a transition: the force of a pair would jump.
  ToothPairs(MeshCycle cycle, ToothErrors errors);

  /// Where one flank is. `depth` is that of teeth without error, also below 0.
  struct Place {
    double travel, travel_rate;  // m, m/s, of the pinion, r q_P
    double depth, rate;          // m, m/s
    int side;                    // +1 forward, -1 reverse
  };
  struct Push {
    double force = 0;   // N, >= 0, through the teeth
    double spared = 0;  // N, part of it that the pinion does not feel: the sum in the equation above
  };
  Push push(const Place& place, const ContactLaw& law) const;
  double elastic_energy(const Place& place, const ContactLaw& law) const;  // J

  /// m: largest distance by which a flank may touch before d = 0, >= 0.
  double most_protrusion() const { return protrusion_; }
  const MeshStiffness& stiffness() const { return cycle_.stiffness; }

 private:
  /// A pair within its path of contact.
  struct Pair {
    double weight, weight_slope;  // -, 1/m along the pinion's travel
    double error, error_slope;    // m, -
  };
  template <typename Use>
  void each_pair(double travel, int side, const Use& use) const;
  double pitch_error(long pair, int side) const;

  MeshCycle cycle_;
  double sum_of_phases_;
  ToothErrors errors_;
  int pinion_teeth_, gear_teeth_;
  double protrusion_;
};

/// Reads `gear_train.mesh.tooth_pairs`: the keys of `stiffness_variation` (stiffness_variation.h) with a
/// transition > 0, and
///
///   errors       absent means 0: slope, crown [m]
///     pinion, gear   absent means 0: runout [m], phase [rad] (required with a runout),
///                    teeth: a list of {tooth: 0 to teeth - 1, error: m}
///
/// Throws BadData.
std::shared_ptr<const ToothPairs> read_tooth_pairs(const YamlReader& yaml, double base_radius);

}  // namespace backlash::model
