// SPDX-License-Identifier: BSD-3-Clause
// A motion of all joints within limits that makes the play of each joint and the parameters of the arm
// visible.
//
// Every joint follows a Fourier series (simulation/fourier_motion.h) that begins and ends each period at
// rest. A gap is visible where the load on the mesh, T of geared_arm/play.h, stays on either flank often and
// long enough for the diagnosis to be certain, by its own rule. Among such motions the search takes the one
// that determines best the base parameters: the largest log det of Y^T Y, Y: the columns of the regressor of
// links and drives that do not depend on others and those of the delays of the torques, each row over the
// noise of its joint's torque (D-optimal; Swevers et al. 1997, IEEE T-RA 13:730). Random motions first, then
// small changes of the best ones that are kept where they are better.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/geared_arm/motion_limits.h"
#include "backlash_diagnosis/geared_arm/play.h"
#include "backlash_diagnosis/simulation/fourier_motion.h"

namespace backlash::geared_arm {

struct PlanSettings {
  double period = 20;      // s; choice: Swevers' 10 s, twice as long for joints that are slow
  int harmonics = 10;      // choice: speed and acceleration of most arms are near their limits together so
  int periods = 3;         // of the record that is to show the gaps; choice
  std::uint64_t seed = 1;  // choice
  int motions = 60;        // random ones; choice (time)
  int bettered = 3;        // the best of them; choice (time)
  int steps = 8000;        // of each; choice (time)
  double margin = 1.2;  // times the load and the time that the diagnosis needs; choice: a controller's error
  PlaySettings play;
};

/// How well a motion determines the base parameters.
struct MotionInformation {
  double condition = 0;   // of Y, its columns scaled to length 1
  double log_volume = 0;  // log det(Y^T Y) / 2: less by that of another motion, over the number of base
                          // parameters, is the logarithm of how much smaller standard errors are in the mean
};

/// Angles of a joint at which gravity keeps its teeth on one flank: not even its largest acceleration would
/// turn the load for certain, the other joints at the offsets of the plan.
struct HiddenRange {
  double lower = 0, upper = 0;  // rad
  int flank = 0;                // 1 or -1, as the load
};

enum class GapView {
  shown,        // stays enough on both flanks
  unconfirmed,  // the same, but the file says nothing of the drive's own torque, which may hide the load
  not_found,    // none of the motions that were tried has
  impossible    // no pose and motion within the limits that was looked at gives a load that is large enough
};

/// As files and reports have it.
const char* to_string(GapView view);

struct JointPlan {
  std::string joint;
  simulation::FourierMotion motion;
  double lower = 0, upper = 0;                     // rad, that it passes
  double speed = 0, acceleration = 0, torque = 0;  // the largest: rad/s, rad/s^2, N m of the motor
  bool gap = false;  // whether there may be one to see: not of joints that are held, nor of simulated ones
                     // without gear
  double least_load = 0, largest_load = 0;  // N m, T
  double certain = 0;                       // N m, |T| beyond which the diagnosis is certain of the flank
  std::size_t stays[2] = {0, 0};            // per period, on the negative and the positive flank
  double reach[2] = {0, 0};  // N m: the largest load of either sign that any pose and motion within the
                             // limits was found to give
  std::vector<HiddenRange> hidden;
  GapView view = GapView::shown;
  std::string message;  // on the gap, for people
};

struct MotionPlan {
  std::string rig;
  PlanSettings settings;
  std::vector<JointPlan> joints;  // in the order of the rig
  std::size_t base_parameters = 0;
  bool noise_known = false;  // the rig file says how noisy the torques are; else noise is taken in proportion
                             // to the torque limits
  MotionInformation planned, reference;  // reference: the best of the random motions
  double gain = 1;  // how much smaller standard errors are than by the reference, in the geometric mean
  bool none_hidden() const;  // every gap is shown or unconfirmed
};

/// Deterministic for a seed. Throws InvalidParameter for settings, BadData where no joint can move or no
/// motion holds the torque limits; Cancelled.
MotionPlan plan_motion(const GearedArm& arm, const std::vector<MotionLimits>& limits,
                       const PlanSettings& settings = {}, const Progress& progress = nullptr);

}  // namespace backlash::geared_arm
