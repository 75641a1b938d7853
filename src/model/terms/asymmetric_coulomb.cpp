// SPDX-License-Identifier: BSD-3-Clause
// Dry friction that differs between the directions:
//   forward F + b, backward F - b        b [N m], F: that of the rig file and the other terms, never below 0
// While a body moves this is a constant torque -b; at rest it holds nothing. Armstrong-Helouvry, Dupont and
// Canudas de Wit (1994, Automatica 30:1083) report it as common in drives; Janot, Gautier and Brunot (2019)
// have it as the offset of the EMPS benchmark.
#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class AsymmetricCoulomb : public EndFrictionTerm {
 public:
  explicit AsymmetricCoulomb(const ParameterValues& p) : EndFrictionTerm(p), torque_(p.at("torque")) {}
  void add_friction(const Motion&, EndFriction& friction) const override {
    end_.limits(friction).forward += torque_;
    end_.limits(friction).backward -= torque_;
  }

 private:
  double torque_;
};

}  // namespace

TermType asymmetric_coulomb_term() {
  TermType type{
      "asymmetric_coulomb",
      {body_parameter(), {"torque", "N m", Range::any(), "b, half the difference of the directions"}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> {
        return std::make_unique<AsymmetricCoulomb>(p);
      },
      TermSearch{"torque", "", clear_torque, {}}};
  type.usual_of_friction = 0.1;  // choice: the zero of a torque that is taken from a current looks the same
  return type;
}

}  // namespace backlash::model
