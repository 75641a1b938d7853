// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "backlash_diagnosis/simulation/driven_load.h"
#include "steps.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr double kLeastFloor = 1e-9;  // theory: of a signal: rounding

/// What is left of a record, times its noise: of both channels together, and of the one that is left with
/// more.
struct UnseenSize {
  explicit UnseenSize(const ServoPrediction& p)
      : torque(p.torque_error.error / std::max(kLeastFloor, p.torque_error.floor)),
        deflection(p.deflection.empty()
                       ? 0
                       : p.deflection_error.error / std::max(kLeastFloor, p.deflection_error.floor)) {}
  double square() const { return torque * torque + deflection * deflection; }
  double most() const { return std::max(torque, deflection); }

  double torque, deflection;
};

/// Why the unseen record contradicts the effects together, compared with the declared machine; empty: it does
/// not. The error of the signal counts, which a delay moves to where it may be smaller. Of two inertias as
/// drop_stand_ins(): what is left far above the noise must be less than half, in squares.
std::string together_not_borne_out(const Hypothesis& h, const Hypothesis& declared, const ServoData& unseen,
                                   const SearchContext& context) {
  const ServoPrediction was = predicted(declared.base->fit.machine, unseen, context.settings.fit),
                        is = predicted(h.fitted->fit.machine, unseen, context.settings.fit);
  const bool better = std::any_of(h.effects.begin(), h.effects.end(), [&](const Effect& effect) {
    const auto channel =
        effect.gain.deflection ? &ServoPrediction::deflection_error : &ServoPrediction::torque_error;
    return (is.*channel).error < (was.*channel).error;
  });
  if (!better) return "the unseen record is predicted no better than by the declared machine";
  const UnseenSize before(was), after(is);
  const double half = context.settings.revision.half, near_floor = context.settings.acceptance.near_floor;
  if (simulation::load_moves_freely(h.declared->rig) &&
      std::max(misfit(h).torque, misfit(h).deflection) > near_floor && after.most() > near_floor &&
      after.square() > half * before.square())
    return fmt::format(
        "of the unseen record {:.0f} % of the square is left, far above the noise: it may stand in for an "
        "effect that has no name",
        100 * after.square() / before.square());
  return "";
}

}  // namespace

Hypothesis believe_together(const Hypothesis& h, const Hypothesis& declared, const ServoData& unseen,
                            const SearchContext& context) {
  if (h.effects.empty()) return h;
  const std::string why = together_not_borne_out(h, declared, unseen, context);
  if (why.empty()) return h;
  Hypothesis none = declared;
  none.rejected = h.rejected;
  for (const Effect& effect : h.effects) none = with_rejected(std::move(none), effect.candidate.id, why);
  return none;
}

}  // namespace backlash::identification
