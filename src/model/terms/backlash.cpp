// SPDX-License-Identifier: BSD-3-Clause
// Free play beside that of the rig file, the same in every position: both flanks are farther away,
//   o = b / 2      opening [rad at the load], b additional backlash [rad at the load]
// For a rig that declares none; where it declares some, b < 0 takes of it.
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class Backlash : public Term {
 public:
  explicit Backlash(double angle) : opening_(0.5 * angle) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint&, FlankShift& shift) const override { shift.opening += opening_; }
  double least_opening(double) const override { return opening_; }

 private:
  double opening_;
};

}  // namespace

TermType backlash_term() {
  return {"backlash",
          {{"angle", "rad", Range::any(), "b, total free play at the load"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<Backlash>(p.at("angle"));
          },
          TermSearch{"angle", "", clear_angle, {}}};
}

}  // namespace backlash::model
