// SPDX-License-Identifier: BSD-3-Clause
// An effect that is tried on an arm, and whether the part of the records that was not fitted confirms it.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/trace.h"

namespace backlash::arm {

using Motions = std::vector<ArmMotion>;

struct Candidate {
  std::string effect;
  FitFreedom freedom;
  ArmFit fit;
  std::vector<double> gains, lowers, uppers;  // per joint, and of the mean logarithm of all
  double gain = 0, lower = 0, upper = 0;      // of the joint that it helps most
  std::size_t joint = 0;
  double all_lower = 0;  // of the mean of all joints' logarithms, lower end
  double all = 0;
  std::vector<std::string> alike;  // effects that the last one was not distinguished from
  std::string reason;              // why not; empty: believed
};

/// Standard errors of what a candidate adds, of which it is the last, from none, in a fit that has it: its
/// last effect of a joint, else body or tilt.
double errors_from_none(const Candidate& c, const ArmFit& fit);

/// Times the expected error that the joint of the last effect may be left with, for that to be believed.
double most_left(const Candidate& c, const ArmTraceSettings& settings);

/// Gains of `c` over `without` on `judged`, with blocks of time drawn at random.
void judge(Candidate& c, const Candidate& without, const Motions& judged, const ArmRig& rig,
           const ArmTraceSettings& settings);

/// Why a candidate that was judged is not believed; empty: it is.
std::string refusal(const Candidate& c, const ArmRig& rig, const ArmTraceSettings& settings);

/// Whether the factor of a joint's friction is sure, and more than a robot's warming up.
bool other_friction_than_trained(const ArmFit& fit, std::size_t joint, const ArmTraceSettings& settings);

/// The same of the last effect of a joint; from then on its gain counts as that of this joint.
std::string effect_refusal(Candidate& c, const Candidate& without, const Motions& judged,
                           const ArmTraceSettings& settings);

/// Fits what is tried: to a part of the test record and, where the rig file has no fitted links and drives,
/// to the training records with it.
class CandidateFits {
 public:
  CandidateFits(const ArmRig& arm_rig, const Motions& train, const ArmTraceSettings& trace_settings)
      : rig(arm_rig), settings(trace_settings), train_(train) {}

  /// All that links and drives are fitted to.
  std::vector<FittedMotion> motions(const Motions& fitted) const;
  /// The model with what may differ from day to day, and with the effect.
  void fit(Candidate& c, const Motions& fitted) const;
  /// Fitted, judged and believed or not.
  void try_out(Candidate& c, const Candidate& without, const Motions& fitted, const Motions& judged) const;

  /// The errors that are expected of it, per joint: what was left of the training records, and what the
  /// effect is not known to. What a half of the test record leaves may be what is missing.
  std::vector<double> expected_errors(const Candidate& taken, const Motions& judged) const;

  /// To what share an effect of a joint is known where its joint is left with more than is expected: what is
  /// left may have its shape. `named` has it last, `last` what was found after it, too.
  double share_known(const Candidate& named, const Candidate& last, const Motions& judged) const;

  const ArmRig& rig;
  const ArmTraceSettings& settings;
  ArmFit base;  // of the training records alone, or as the rig file has it
  std::vector<double> train_errors;

 private:
  const Motions& train_;
};

}  // namespace backlash::arm
