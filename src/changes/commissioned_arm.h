// SPDX-License-Identifier: BSD-3-Clause
// An arm as its healthy records show it, and a record by it: what the chain does not take is each joint's
// own.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/changes/changes.h"
#include "chain_search.h"

namespace backlash::changes {

/// The deflection of a joint under the load that the chain puts on its teeth.
struct JointDeflection {
  HealthyModel model;
  SampledMotion motion;
};

class CommissionedArm {
 public:
  /// Fits the chain to the healthy records. Throws CannotIdentify, BadData.
  CommissionedArm(const arm::ArmRig& rig, const std::vector<arm::ArmRecord>& healthy,
                  const ChangeSettings& settings, const Progress& progress,
                  std::vector<std::string>& warnings);

  const arm::ArmFit& fit() const { return fit_; }
  std::deque<ArmJoint>& joints() { return joints_; }
  const std::deque<ArmJoint>& joints() const { return joints_; }

  /// Reads a record joint by joint. Throws CannotIdentify where no joint can be judged.
  void read(const arm::ArmRecord& record, Changes& out);
  /// From here on the record's chain differs by this, too.
  void differ(const ChainDifference& difference, const arm::ArmRecord& record);
  /// Looks at a joint anew, with what was found before as further columns.
  void set_search(ArmJoint& joint) const;
  /// Nothing without encoders behind the gap. Throws CannotIdentify.
  std::optional<JointDeflection> deflection(std::size_t index) const;

 private:
  MotionSampling sampling_of_joint(std::size_t index) const;
  std::vector<record::Record> long_enough(std::size_t index, const MotionSampling& sampling) const;
  void add_joint(std::size_t index);
  void set_chain_inflation(ArmJoint& joint) const;

  const arm::ArmRig& rig_;
  const ChangeSettings& settings_;
  const Progress& progress_;
  arm::ArmFit fit_;
  std::vector<ChainMotion> healthy_;
  ChainMotion record_;  // with what the chain was found to be another by
  std::vector<ChainDifference> differences_;
  std::deque<ArmJoint> joints_;
};

}  // namespace backlash::changes
