// SPDX-License-Identifier: BSD-3-Clause
// Terms as columns of a regression, for records of one joint whose bodies move as one: what one unit of a
// term's strength adds to the torque that the motor has to supply, or to how far the motor is ahead of the
// load. By the equations of the term itself (term.h), so that an effect is the same law wherever it is
// simulated, fitted, searched for, or reported as a change.
//
//   torque       -(motor + load torque of add())  +  S (F + B) / 2 + (F - B) / 2
//                F, B: dry friction forward and backward, S the direction in -1..1
//   deflection   side * opening of that flank,  -(gain - 1) position of an error of the load's encoder
//
// A term that says how friction builds up after a reversal (TermType::shapes_friction) adds no torque by
// itself. Its column is what is lacking of a dry friction of 1 N m, -2 S exp(-way / distance) (Dahl 1968):
// the regression finds that friction.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// All at the load side of the reduction.
struct JointMoment {
  double time = 0;                                       // s
  double position = 0, speed = 0;                        // rad, rad/s
  double direction = 0;                                  // -1..1, S
  double load = 0;                                       // N m, that the load takes, through the teeth
  double way = std::numeric_limits<double>::infinity();  // rad, since the last reversal
  double side = 1;                                       // +1: the flank that drives forward bears it; -1
};

/// Where a term shows that is linear in its strength.
enum class ShownIn { torque, deflection, neither };
ShownIn shown_in(const TermType& type);

/// Name, unit and range of the value that a regression finds of a term.
ParameterSpec regressed_strength(const TermType& type);

/// A term of which all is given but its strength and phase.
class TermColumns {
 public:
  /// `given`: numbers by name; those that a rig file need not state may be absent. Throws InvalidParameter
  /// where one is missing or out of range, or the term shows in neither channel.
  TermColumns(const TermType& type, ParameterValues given);

  const TermType& type() const { return *type_; }
  const ParameterValues& given() const { return given_; }
  /// 2: at phase pi / 2 and 0, hence cosine and sine of a wave; else 1.
  std::size_t count() const { return probes_.size(); }
  /// N m or rad per unit of the strength.
  double at(std::size_t column, const JointMoment& moment) const;

  bool follows_load() const;  // reads JointMoment::load
  bool follows_time() const;  // reads JointMoment::time
  bool is_constant() const;   // the same whatever the joint does
  bool rubs() const;          // dry friction, the same in both directions

 private:
  double torque(const Term& term, const JointMoment& moment) const;
  double ahead(const Term& term, const JointMoment& moment) const;

  const TermType* type_;
  ParameterValues given_;
  ShownIn shown_in_;
  double shown_more_ = 0;  // by the load's encoder, relative
  std::vector<std::shared_ptr<const Term>> probes_;
};

/// What is no effect of the machine and shows as this one does: a torque that is the same whatever the joint
/// does may be the zero of the torque's sensor ("torque_offset") or somebody who leans on it
/// ("external_torque").
std::vector<std::string> looks_like(const TermType& type);

/// Number in which a term is not linear, that has to be searched: an order, a speed, a distance. None where
/// there is none, or several.
std::optional<ParameterSpec> searched_shape(const TermType& type);
/// Whether it is the order of a wave over the position.
bool has_order(const TermType& type);

/// A term with all that a search does not vary, and the values of its searched_shape() to begin with; those
/// of an order depend on the record.
struct SearchedTerm {
  const TermType* type;
  ParameterValues given;
  std::vector<double> shapes;
};

/// All terms that a search of that channel may try, but those with several shapes to be searched and those
/// that are part of how a machine is built (TermSearch::needs_turning_link, TermType::gap_variation). Those
/// of neither channel (a flank under load, a delay) show by what the whole machine makes of them.
std::vector<SearchedTerm> searched_terms(ShownIn channel, const MotionRange& range);
/// Of one of these, with that strength.
std::shared_ptr<const Term> term_of(const SearchedTerm& searched, double strength);

}  // namespace backlash::model
