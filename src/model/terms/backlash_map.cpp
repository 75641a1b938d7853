// SPDX-License-Identifier: BSD-3-Clause
// Backlash from a look-up table over the load position, repeated every load turn:
//   flanks at position q:  centre(q) +- backlash(q) / 2      [rad at the load], linear between the table's
//   points
// `backlash` of the rig file then counts no longer. A centre other than 0 is a transmission error. The
// varying model of Yumrukcal (2013, Sections 4 and 6.3), whose map comes from constant-speed runs in both
// directions.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "terms.h"

namespace backlash::model {
namespace {

struct Point {
  double value, slope;
};

/// A function of one turn, linear between points.
class TurnTable {
 public:
  TurnTable(const std::vector<double>& positions, const std::vector<double>& values)
      : positions_(positions), values_(values) {}

  Point at(double angle) const {
    const double turn = 2 * M_PI;
    const double from_first = angle - positions_.front();
    // the quotient may round up to a whole turn
    const double q = positions_.front() + std::max(0.0, from_first - turn * std::floor(from_first / turn));
    const std::size_t after = std::upper_bound(positions_.begin(), positions_.end(), q) - positions_.begin();
    const bool wraps = after == positions_.size();
    const std::size_t i = after - 1, j = wraps ? 0 : after;
    const double width = (wraps ? positions_[0] + turn : positions_[j]) - positions_[i];
    const double slope = (values_[j] - values_[i]) / width;
    return {values_[i] + slope * (q - positions_[i]), slope};
  }

 private:
  std::vector<double> positions_, values_;
};

class BacklashMap : public Term {
 public:
  BacklashMap(const std::vector<double>& positions, const std::vector<double>& backlash,
              const std::vector<double>& centre)
      : backlash_(positions, backlash), centre_(positions, centre) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    const Point gap = backlash_.at(at.load_position), middle = centre_.at(at.load_position);
    shift.opening += 0.5 * gap.value - at.half_gap + at.side * middle.value;
    shift.load_slope += 0.5 * gap.slope + at.side * middle.slope;
  }

 private:
  TurnTable backlash_, centre_;
};

void check(const std::vector<double>& positions, const std::vector<double>& backlash,
           const std::vector<double>& centre) {
  const auto refuse = [](const char* name, double value, const char* limit) {
    throw InvalidParameter(name, value, limit);
  };
  if (positions.size() < 2) refuse("positions", double(positions.size()), "needs at least two points");
  if (backlash.size() != positions.size())
    refuse("backlash", double(backlash.size()), "one value per position");
  if (centre.size() != positions.size()) refuse("centre", double(centre.size()), "one value per position");
  for (std::size_t i = 1; i < positions.size(); ++i)
    if (!(positions[i] > positions[i - 1])) refuse("positions", positions[i], "must increase");
  if (!(positions.back() - positions.front() < 2 * M_PI))
    refuse("positions", positions.back(), "must lie within one turn, the first not repeated");
}

}  // namespace

TermType backlash_map_term() {
  TermType type{"backlash_map",
                {{"positions", "rad", Range::any(), "of the load, increasing, within one turn", true},
                 {"backlash", "rad", Range::not_negative(), "total free play at each position", true},
                 {"centre", "rad", Range::any(), "middle of the gap at each position", true}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  check(p.list("positions"), p.list("backlash"), p.list("centre"));
                  return std::make_unique<BacklashMap>(p.list("positions"), p.list("backlash"),
                                                       p.list("centre"));
                }};
  type.gap_variation = GapVariation::table;
  return type;
}

}  // namespace backlash::model
