// SPDX-License-Identifier: BSD-3-Clause
// An arm fitted to several records, and whether they are of one arm: a body that it carries in one of them,
// or a drive that has changed between them, bends all links and drives of a common fit.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/friction_turn.h"

namespace backlash::arm {

/// What moved in one record.
using RecordMotions = std::vector<ArmMotion>;

/// Joints of which all records together leave more than twice what each leaves alone, where that can be
/// fitted: `together` the fit to all of them. Measured records of one arm of several days leave up to 1.2
/// times, with a body of 3 kg in one of them 3.4 to 13 times as much (but at the vertical axis).
std::vector<Contradiction> contradictions(const ArmFit& together, const std::vector<ArmFit>& alone);

/// "records contradict each other: ..." and by how much, without the last full stop.
std::string description(const std::vector<Contradiction>& contradictions);

/// What the last link carries in a record beside what the rig file says.
struct Carried {
  signal::Measured mass;  // kg; an error of NaN: not known
};

/// fit_arm_and_friction_turns() of all records together; of two to eight also of each alone. Where they
/// contradict each other the fit says so (contradictions, a warning), and each standard error is at least as
/// large as the distance to the value of any record alone. Throws as that, and CannotIdentify where friction
/// of a joint comes out as a torque that drives it: a sign is wrong. Warns of joints of which a tenth of the
/// torque, and five times the noise, is left.
/// `carried`: of each record, empty where none carries anything. What does is a state of the fit, in the
/// order of the records (ArmFit::states), with friction and offsets of its own; a known mass makes the torque
/// constants as well known as its torque is measured. Throws CannotIdentify where all records carry
/// something.
ArmFit fit_records(const ArmRig& rig, const std::vector<RecordMotions>& records,
                   const FitSettings& settings = {}, const Progress& progress = nullptr,
                   const std::vector<std::optional<Carried>>& carried = {});

}  // namespace backlash::arm
