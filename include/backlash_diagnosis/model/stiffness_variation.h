// SPDX-License-Identifier: BSD-3-Clause
// Mesh stiffness that varies with position in a simulation: the contact law's force times a factor whose mean
// over a mesh cycle is 1.
//
//   factor = k(phase) / mean k        phase = r q_P / pb + offset on the forward flank
//
// r q_P [m] is the travel along the line of action, pb the base pitch, k(phase) as in mesh_stiffness.h. On
// the reverse flank the same teeth touch on their other side and move the other way: with tooth thickness s
// of the pinion on its operating pitch circle of radius rw and g the path of approach,
//
//   reverse phase = 2 c - phase,  2 c = (s rb / rw + 2 g) / pb
//
// (a tooth centred on the line of centres has passed the pitch point by s rb / (2 rw) with either flank).
// The factor depends on the pinion's position alone and not on the load. A stiffness that changes under load
// does work on the teeth in contact (parametric excitation), so elastic energy is not conserved.
#pragma once

#include <memory>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/mesh_stiffness.h"

namespace backlash::model {

/// Where in its mesh cycle a pair of gears is.
struct MeshCycle {
  MeshStiffness stiffness;
  double offset;  // base pitches, phase of the forward flank at travel 0

  double phase(double travel) const { return travel / stiffness.geometry().base_pitch + offset; }
  /// 2 c of the header: the sum of both flanks' phases [base pitches].
  double sum_of_phases() const;
};

class StiffnessVariation {
 public:
  explicit StiffnessVariation(MeshCycle cycle);
  /// `offset` is the phase of the forward flank at travel 0 [base pitches].
  StiffnessVariation(MeshStiffness stiffness, double offset);

  /// Factor of the stiffness at a travel of the pinion [m], on the forward (side > 0) or reverse flank.
  double factor(double travel, double side) const;

 private:
  MeshCycle cycle_;
  double reverse_;
};

/// Reads `gear_train.mesh.stiffness_variation` of a rig whose load gear has this base radius [m]:
///
///   law          step, lin_parker or hertz_bending
///   phase        0 to 1, base pitches: the forward flank's phase at pinion angle 0
///   transition   0 to 0.5, base pitches, see MeshStiffnessSettings
///   gear_pair    pinion_teeth, gear_teeth, module [m], pressure_angle_deg, addendum [modules]
///                absent means 0: centre_distance_change, pinion_thinning, gear_thinning [m],
///                pinion_shift, gear_shift [modules]
///   youngs_modulus [Pa], poisson_ratio
///                for hertz_bending only; in the other laws they cancel, as the face width does
///
/// The gear pair only determines how its teeth meet. The play is that of mesh.backlash (or half_gap), which
/// wear and set_backlash() change. Throws BadData, also where the gear's base radius differs from the rig's
/// by more than 0.1 %.
MeshCycle read_mesh_cycle(const YamlReader& yaml, double base_radius);
std::shared_ptr<const StiffnessVariation> read_stiffness_variation(const YamlReader& yaml,
                                                                   double base_radius);

}  // namespace backlash::model
