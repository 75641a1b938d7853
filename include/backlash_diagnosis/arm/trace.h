// SPDX-License-Identifier: BSD-3-Clause
// What the model of an arm lacks in a record that was not used for it: a payload, gravity from another
// direction, friction of one joint, a push.
//
// The base machine is the rig's fitted values, else fitted to the training records. Where it does not
// predict the test record, each effect is fitted to the part of the records that shows it and judged on
// another part: with a fitted rig the training records and the test record; else, or where only the test
// record shows it, the first and the second half of the test record. An effect is believed only where it
// makes the error there smaller, in blocks drawn at random as well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/arm/push.h"

namespace backlash::arm {

struct ArmTraceSettings {
  FitSettings fit;
  double least_gain = 0.3;  // share of the squared error that an effect must take away; choice: friction that
                            // differs from day to day takes less, see doc/measured/ur10e_arm.md
  double sure = 4;          // standard errors of an effect's size; choice
  double least_tilt = 0.0087;  // rad, half a degree; choice: what a base is levelled to
  double least_friction =
      0.25;  // of a factor from one, to be reported: less is a robot that warms up; choice
  double same_link =
      0.3;  // share of the squared error by which another link must do better than the last; choice
  double most_of_expected = 4;  // times what the fit expects of itself: a joint above it is unexplained;
                                // choice: friction of another day has given 3.3
  double much = 0.1, far = 10;  // of a joint's torque, and times its noise: that much left is unexplained
                                // even where the training records leave it too; choice: measured healthy arms
                                // leave up to 0.055, and up to 9.2 times their noise
  double explained = 2;  // the same, of a joint whose friction, or whose motor's torque, an effect scales by
                         // a factor: more is left by what is no factor; choice, see doc/evidence/arm.md
  int most_effects = 3;  // of single joints; choice
  int most_tried = 3;    // guesses for each; choice (time)
  double least_at_joint = 0.5;  // share of its joint's squared error that such an effect must take away, and
  double least_of_signal = 0.025;  // rms of what it explains, of the signal's deviation; choice: bristles of
                                   // a UR10e's joints take up to 0.4 and 0.03, see doc/measured/ur10e_arm.md
  double law = 0.03;  // of the size of an effect of a joint: its law is not the machine's; choice, tried on
                      // drawn arms, see doc/evidence/arm.md
  double of_left = 0.5;  // of what its joint is left with beyond what is expected, that may have its shape;
                         // choice, tried on drawn arms
  double clearly = 0.1;  // share of the squared error by which an effect of the test record alone must do
                         // better than one of all records; choice
  double nearly = 0.5;  // share of the squared error by which another effect may do worse that is reported as
                        // equivalent; choice
  double block = 2;     // s, of the bootstrap; as FitSettings::block
  int draws = 400;      // choice (time)
  std::uint64_t seed = 1;  // choice
  PushSettings push;
};

struct ArmParameter {
  std::string name, unit;
  signal::Measured measured;
};

struct ArmStep {
  std::string effect;       // payload, gravity_direction, friction_drift, external_torque, or that of a joint
  std::string joint, link;  // where it has one
  std::string other_joint;  // of a transmission_coupling
  std::string channel;      // that it helps most
  std::vector<ArmParameter> parameters;
  std::vector<double> before, after;                // relative error per joint on the judged part
  double gain = 0, gain_lower = 0, gain_upper = 0;  // share of the squared error taken away there, 95 %
  std::vector<std::string> equivalent_to;
  std::optional<PushEvent> push;  // whose `torque` parameter is that on the joint: minus the drive's
};

struct ArmTrace {
  std::vector<std::string> joints;
  std::vector<double> train, before, after, floor;  // per joint; NaN: does not move
  std::vector<ArmStep> steps;
  struct Rejected {
    std::string effect, reason, joint;  // joint: of one that acts at a joint
  };
  std::vector<Rejected> rejected;
  struct Unexplained {
    std::string channel, signature;
  };
  std::optional<Unexplained> unexplained;
  bool cannot_tell = false;  // nothing of the test record could be judged
  std::string judged;        // in words: on what the errors are given
  ArmRig augmented;
  std::vector<std::string> notes, warnings;
  struct Series {
    std::vector<double> time;                                  // s
    std::vector<std::vector<double>> measured, before, after;  // per joint; NaN where it does not count
  };
  Series series;
};

/// Throws CannotIdentify, BadData, Cancelled.
ArmTrace trace_arm(const ArmRig& rig, const std::vector<ArmRecord>& train, const ArmRecord& test,
                   bool same_record, const ArmTraceSettings& settings = {},
                   const Progress& progress = nullptr);

}  // namespace backlash::arm
