// SPDX-License-Identifier: BSD-3-Clause
// The rig file of an arm: its URDF, gravity, and a drive per joint.
//
//   k_j s_j(t + d_j) = tau_j(q, v, a) + J_j a_j + friction_j + what `effects` say, see joint_effect.h
//   friction_j = c_j S + b_j v + n_j v |v| + h_j v^3 + o_j + l_j S |tau_j|,   S = tanh(v / v_0)
//
// With a `friction_distance` x_s of the drive S builds up after a reversal as well (Dahl,
// model/presliding.h): S = |tanh(v / v_0)| z, x_s dz/dt = v - |v| z.
//
// s_j is the recorded channel: a current with k_j [N m/A], or a torque with k_j = 1, the motor's or behind
// the gear; later than the motion by d_j. tau_j is the chain's own torque, all at the joint's side of the
// reduction. Friction that follows the load: e.g. Gautier and Jubien, IROS 2014; quadratic and cubic in
// speed: what a lubricated gear shows beyond one line.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/chain.h"
#include "backlash_diagnosis/arm/joint_effect.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/term_columns.h"
#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::arm {

/// What a drive adds to the chain's torque, in the order of the equation above.
enum class DriveTerm { rotor_inertia, coulomb, viscous, quadratic, cubic, offset, load };
constexpr std::size_t kDriveTerms = 7;

struct DriveTermSpec {
  const char* name;  // in rig files and reports
  const char* unit;
  bool dissipates;  // must be >= 0
};
extern const std::array<DriveTermSpec, kDriveTerms> kDriveTermSpecs;

struct JointDrive {
  std::string name;
  double constant = 1;        // k: N m per unit of the channel, > 0
  double constant_error = 0;  // of it, relative, one standard deviation; 0: exact
  std::array<double, kDriveTerms> terms = {};
  double load_error = 0;             // of the term `load`, one standard deviation; 0: not said
  double delay = 0;                  // d [s]
  std::vector<JointEffect> effects;  // that it shows beside the terms; as declared, never fitted
  double friction_speed = 0;         // v_0 of its own friction [rad/s]; 0: as of the whole rig
  double friction_distance = 0;      // x_s [rad], over which it builds up; 0: at once
  record::ChannelMap channels;       // columns of a file with names of its own; none: the package's own names
  double training_error = 0;         // norm(r) / norm(s - mean(s)) where a fitted rig was fitted; 0: not said
};

/// Torque of one unit of a term [N m per unit], and of all terms of a drive [N m]; that of the rotor's
/// inertia is 0, a moment has no acceleration.
double drive_unit(DriveTerm term, const model::JointMoment& now);
double drive_friction(const JointDrive& drive, const model::JointMoment& now);

struct ArmIdentification {
  double kinematics_cutoff = 10;  // Hz, of position and speed
  double torque_cutoff = 5;       // Hz, of the channel and of all that predicts it
  double slowest = 0.02;          // rad/s: a slower joint does not count, its friction is not known
  double friction_speed = 0.01;   // rad/s, v_0
};

/// A body that is carried beside what the URDF says.
struct Payload {
  std::string link;
  double sign = 1;            // -1: a body that is no longer there
  BodyParameters parameters;  // of the body itself, in the frame of the joint that turns the link
};

/// What the motions that a rig was fitted to show of a standard parameter of a link (mass, moments,
/// inertias): it leads a base parameter; it is a part of some, and known in a sum with others only; or they
/// do not show it at all. But for the first its interval is infinite.
enum class Shown { leads, in_others, not_at_all };

/// LINK/mass, ... of a standard parameter, counted over all links.
std::string standard_name(const Chain& chain, std::size_t index);
/// mass, moment_x, ..., inertia_zz: the ten of BodyParameters, and their units.
extern const std::array<const char*, 10> kStandardNames, kStandardUnits;

struct ArmRig {
  std::string name;
  std::string urdf;  // path
  record::Channel channel = record::Channel::motor_current;
  std::vector<DriveTerm> terms;  // that the drives have
  std::vector<JointDrive> joints;
  double common_error = 0;  // of all constants together, relative; known of a fitted rig
  ArmIdentification identification;
  HeldJoints held;           // of the URDF, that stand still
  Chain chain;               // of the URDF, with the fitted links in its place where there are some
  bool fitted = false;       // the file has links of its own
  std::vector<Shown> shown;  // ten of each link; empty: not said
  std::vector<Payload> payloads;
  std::string source;  // path of the rig file
  std::string text;

  std::vector<std::string> joint_names() const;
  /// v_0 of the friction in a drive [rad/s].
  double friction_speed(std::size_t joint) const;
};

/// Of a joint by its name; none: there is no such joint.
std::optional<std::size_t> index_of(const ArmRig& rig, const std::string& joint);

/// What a URDF by itself says as a rig: all its joints that move but the held ones, with drives whose values
/// nobody knows (all 0) and torques at the joint as channel, the base level. Throws MissingInput, BadData.
ArmRig arm_rig_of_urdf(const std::string& path, const HeldJoints& held = {});

/// Throws MissingInput, BadData (file, line, key, value, limit).
ArmRig load_arm_rig(const std::string& path);
/// The same of a text. `source` names it in errors; a URDF without absolute path is looked for in `folder`.
ArmRig arm_rig_from_text(const std::string& text, const std::string& source, const std::string& folder);

/// The rig as a file that load_arm_rig() reads, with all its values; `comments` stand at the top, one per
/// line.
std::string arm_rig_text(const ArmRig& rig, const std::vector<std::string>& comments);

/// The chain with all payloads on its links.
Chain loaded_chain(const ArmRig& rig);

}  // namespace backlash::arm
