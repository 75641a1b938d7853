// SPDX-License-Identifier: BSD-3-Clause
// A geared joint as a model of other simulators: MJCF of MuJoCo, URDF and SDF. One inertia, or two with a gap
// between them; everything at the load side of the reduction.
//
// MJCF, two inertias: two bodies with a joint to the world each, and a fixed tendon of length q_motor -
// q_load whose limits are the flanks. MuJoCo's limit is soft: with impedance d, both numbers of solref
// negative and a0 the acceleration that it would have without the limit, the tendon accelerates by (MuJoCo,
// "Computation", solver parameters)
//   a = (1 - d) a0 - stiffness x - damping x'      x: how far the limit is passed
// stiffness [1/s^2] and damping [1/s] are per reduced inertia. With d = 1e-4, the least that MuJoCo takes,
// and stiffness = K / J, damping = C / J, 1 / J = 1 / J_motor + 1 / J_load, that is the linear contact F =
// max(0, K x + C x') within 1e-4 of the torque that the outside puts on the teeth.
//
// URDF and SDF: the load is carried by the motor through a joint with limits, whose flanks are as hard as the
// simulator makes them (SDF states the stiffness, which only Simbody heeds).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::report {

enum class SimulatorFormat { mjcf, urdf, sdf };

struct SimulatorModel {
  std::string text;                 ///< XML
  std::vector<std::string> unsaid;  ///< what the rig file has and the text does not; also there as a comment
};

/// `torque` [N m] > 0 at the load side: where the stiffness and damping of a contact law that is not linear
/// are taken. Throws BadData, naming the file, for a rig with another number of inertias, a locked link, or
/// such a law without `torque`; InvalidParameter for a torque that is not positive and finite.
SimulatorModel simulator_model(const rig_file::RigFile& file, SimulatorFormat format,
                               std::optional<double> torque = std::nullopt);

}  // namespace backlash::report
