// SPDX-License-Identifier: BSD-3-Clause
// Backlash over load position from runs both ways.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

/// Friction of the load at a speed, from what is known by now [N m].
signal::Measured load_friction_at(const IdentificationCase& c, double speed) {
  const model::Body& link = c.result.rig.link;
  const double sign = speed > 0 ? 1 : -1;
  const double value = link.coulomb_friction + sign * link.coulomb_asymmetry +
                       (link.viscous_damping + sign * link.viscous_asymmetry) * std::fabs(speed);
  return {value, c.result.parameters.count("load_coulomb") ? known(c, "load_coulomb").standard_error
                                                           : kDeclaredUncertainty * value};
}

}  // namespace

ProcedureReport run_gap_map(IdentificationCase& c) {
  ProcedureReport report{"gap_map", {}, ""};
  struct OneWay {
    const CaseRecord* record;
    double speed;  // rad/s, mean
  };
  std::vector<OneWay> runs;
  for (const CaseRecord& r : c.records) {
    if (!r.drive() || !r.has_load) continue;
    const auto& q = r.record.column(record::Channel::load_position);
    const double travel = q.back() - q.front();
    if (std::fabs(travel) < 0.95 * signal::peak_to_peak(q)) continue;
    runs.push_back({&r, travel / (r.record.time.back() - r.record.time.front())});
  }
  std::string reasons;
  for (const OneWay& a : runs)
    for (const OneWay& b : runs) {
      if (!(a.speed > 0 && b.speed < 0)) continue;
      GapMapSettings settings;
      settings.stiffness = known(c, "mesh_stiffness");
      settings.friction_forward = load_friction_at(c, a.speed);
      settings.friction_reverse = load_friction_at(c, b.speed);
      try {
        GapMap map = identify_gap_map(a.record->record, b.record->record, settings);
        if (c.result.gap_map && c.result.gap_map->mean_gap.standard_error <= map.mean_gap.standard_error)
          continue;  // the pair that determines it better
        c.result.gap_map = std::move(map);
        report.records = {a.record->record.name, b.record->record.name};
      } catch (const CannotIdentify& error) {
        reasons += std::string(reasons.empty() ? "" : "; ") + error.what();
      }
    }
  if (!c.result.gap_map)
    throw CannotIdentify(reasons.empty() ? "no two runs one way each in opposite directions" : reasons);
  const GapMap& map = *c.result.gap_map;
  add_finding(c, report.name, {{"backlash_angle", 1}}, map.mean_gap);
  report.message = "mean gap " + plus_minus(map.mean_gap, "rad") + "; " + map.statement;
  if (map.varies) {  // the clearance is then that of one place
    auto& all = c.result.findings;
    all.erase(
        std::remove_if(all.begin(), all.end(), [](const Finding& f) { return f.procedure == "clearance"; }),
        all.end());
    c.result.warnings.push_back(
        "backlash depends on the position of the load: " + map.statement +
        (gap_varies(c.declared) ? "" : "; the machine is fitted with it, the rig file keeps a constant gap"));
  }
  return report;
}

}  // namespace backlash::identification
