// An effect is a term of the model: an extra torque on the motor or on the load.
//
// A new effect: one file in src/model/terms/ with its equation, and one line in term.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/parameter.h"

namespace backlash {

/// What a term may depend on; angles and speeds at the load side of the reduction.
struct Motion {
  double time;            // s
  double motor_position;  // rad
  double motor_velocity;  // rad/s
  double load_position;   // rad
  double load_velocity;   // rad/s
};

/// Torques on the two ends of the gear train [N m], load-side; positive torque accelerates in positive direction.
struct EndTorques {
  double motor = 0;
  double load = 0;
};

class Term {
 public:
  virtual ~Term() = default;
  /// Adds the term's contribution to the equations of motion.
  virtual void add(const Motion& motion, EndTorques& torques) const = 0;
};

/// What the registry knows of a term: its id in the rig file, its parameters, how it is made.
struct TermType {
  std::string id;
  std::vector<ParameterSpec> parameters;
  std::unique_ptr<Term> (*create)(const ParameterValues&);
};

/// All terms. There is no second list of effects anywhere.
const std::vector<TermType>& term_types();

/// Reads one entry of `terms:`: `id: ID` and that term's parameters.
std::shared_ptr<const Term> read_term(const YamlReader& yaml);

}  // namespace backlash
