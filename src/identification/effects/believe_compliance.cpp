// SPDX-License-Identifier: BSD-3-Clause
// Of a machine that is coupled to other axes what cannot be modelled may follow the torque in one record and
// not in the next: then a compliance that lessens the error in training is none. The unseen record decides.
#include <fmt/format.h>

#include <algorithm>

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "steps.h"
#include "unseen_gain.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr double kRigid = 30;  // choice: times the declared stiffness

}  // namespace

Hypothesis believe_compliance(const Hypothesis& before, const ServoData& unseen,
                              const SearchContext& context) {
  const rig_file::RigParameter& stiffness =
      rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::stiffness);
  const std::vector<FitParameter>& all = before.declared->parameters;
  const auto fitted =
      std::find_if(all.begin(), all.end(), [&](const FitParameter& p) { return p.name == stiffness.name; });
  if (fitted == all.end()) return before;
  context.report("asking the unseen record");
  const FitSettings& settings = context.settings.fit;
  const Hypothesis held = with_held(before, *fitted, kRigid * fitted->get(before.declared->rig));
  const auto rigid = attempted([&] {
    return fit_in_band(context.data, start_with(held, {}, context), settings.cutoff, settings.tolerance,
                       settings);
  });
  if (!rigid) return before;
  const BeliefSettings& belief = context.settings.belief;
  const auto left_of = [&](const BandFit& fit) {
    return left(predicted(fit.fit.machine, unseen, settings), true, belief);
  };
  const TestGain gain = test_gain(left_of(*rigid), left_of(*before.fitted), belief);
  if (gain.lower > 0) return before;
  Hypothesis h = with_rejected(
      held, "mesh_compliance",
      fmt::format("on the unseen record it lessens the error of deflection by {:.2g} % (95 %: {:.2g} to "
                  "{:.2g} %): not distinguished from nothing, so the mesh is held stiff",
                  100 * gain.value, 100 * gain.lower, 100 * gain.upper));
  h.fitted = std::make_shared<const BandFit>(*rigid);
  return h;
}

}  // namespace backlash::identification
