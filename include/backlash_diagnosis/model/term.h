// An effect is a term of the model: an extra torque on the motor or on the load, dry friction, or another
// shape of the flanks.
//
// A new effect: one file in src/model/terms/ with its equation, and one line in term.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/parameter.h"

namespace backlash {

/// What a term may depend on; all at the load side of the reduction.
struct Motion {
  double time;             // s
  double motor_position;   // rad
  double motor_velocity;   // rad/s
  double load_position;    // rad
  double load_velocity;    // rad/s
  double mesh_torque = 0;  // N m, through the teeth, > 0 drives the load forward
};

/// Torques on the two ends of the gear train [N m], load-side; positive torque accelerates in positive
/// direction.
struct EndTorques {
  double motor = 0;
  double load = 0;
};

/// Dry friction of one body: the largest torque >= 0 [N m] with which it opposes motion, or the attempt to
/// start it, in either direction.
struct FrictionLimits {
  double forward = 0;
  double backward = 0;
};

struct EndFriction {
  FrictionLimits motor, load;
};

/// How far a flank is from where the rig file has it, as an angle at the load.
struct FlankShift {
  double opening = 0;      // rad, > 0: farther away
  double motor_slope = 0;  // d opening / d motor position
  double load_slope = 0;   // d opening / d load position
};

/// Where the shape of a flank is asked for; angles at the load.
struct FlankPoint {
  double motor_position;  // rad
  double load_position;   // rad
  double half_gap;        // rad, of the rig
  double mesh_torque;     // N m, through the teeth
  int side;               // +1: touches where the motor drives forward, -1: the other
};

class Term {
 public:
  virtual ~Term() = default;

  std::string id;  // in the rig file; set by make_term()

  /// Adds torques that change smoothly with the motion.
  virtual void add(const Motion&, EndTorques&) const {}

  /// Adds dry friction. Whether a body sticks or slides is found by the simulation.
  virtual bool has_dry_friction() const { return false; }
  virtual void add_friction(const Motion&, EndFriction&) const {}

  /// Moves the flanks. The slopes make it conservative: the mesh torque acts through them on both ends.
  virtual bool shapes_flanks() const { return false; }
  virtual bool shape_follows_torque() const { return false; }
  virtual void shape(const FlankPoint&, FlankShift&) const {}
};

/// What the registry knows of a term: its id in the rig file, its parameters, how it is made.
struct TermType {
  std::string id;
  std::vector<ParameterSpec> parameters;
  std::unique_ptr<Term> (*create)(const ParameterValues&);
};

/// All terms. There is no second list of effects anywhere.
const std::vector<TermType>& term_types();

/// One term from its values, which must be all that its type names. Throws InvalidParameter for another id, for
/// values out of range and for such as do not go together.
std::shared_ptr<const Term> make_term(const std::string& id, const ParameterValues& values);

/// Reads one entry of `terms:`: `id: ID` and that term's parameters.
std::shared_ptr<const Term> read_term(const YamlReader& yaml);

}  // namespace backlash
