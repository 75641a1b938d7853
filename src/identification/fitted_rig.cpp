// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fitted_rig.h"

#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "backlash_diagnosis/model/term_text.h"
#include "backlash_diagnosis/model/weight_term.h"
#include "backlash_diagnosis/rig_file/known_values.h"
#include "backlash_diagnosis/rig_file/rig_document.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::identification {
namespace {

/// What belongs to the parameters of a machine of one inertia, by the names of the table.
template <typename Value>
std::map<std::string, Value> values_by_table(const std::map<std::string, Value>& one_inertia) {
  std::map<std::string, Value> all;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters())
    if (const auto at = one_inertia.find(p.one_inertia); at != one_inertia.end()) all[p.name] = at->second;
  return all;
}

/// The fitted weight in place of the declared one; what no record showed stays.
void replace_weight(rig_file::RigDocument& document, const Identification& found) {
  const auto amplitude = found.parameters.find("gravity_amplitude");
  if (amplitude == found.parameters.end() || std::isinf(amplitude->second.standard_error)) return;
  for (const auto& term : found.rig.terms)
    if (term->id == model::weight_term())
      document.replace_terms([](const std::string& id) { return id == model::weight_term(); },
                             {model::term_text(*term)});
}

/// rad, rms: what the machine leaves of motor minus load position beyond noise; NaN where that cannot be
/// said.
double unexplained_deflection(const Identification& found) {
  const auto error = found.channels.find("deflection");
  if (error == found.channels.end() || found.unexplained || found.several || found.deflection.empty())
    return kNaN;
  double squares = 0, count = 0;
  for (const ChannelTrace& trace : found.deflection) {
    std::vector<double> counted;
    for (std::size_t i = 0; i < trace.measured.size(); ++i)
      if (trace.counts.empty() || trace.counts[i]) counted.push_back(trace.measured[i]);
    const double mean = std::accumulate(counted.begin(), counted.end(), 0.0) / double(counted.size());
    for (const double value : counted) squares += (value - mean) * (value - mean), ++count;
  }
  const double train = error->second.error, floor = error->second.floor;
  return std::sqrt(std::fabs(train * train - floor * floor) * squares / count);
}

std::vector<std::string> records_of(const Identification& found) {
  std::vector<std::string> names;
  for (const ChannelTrace& trace : found.deflection) names.push_back(trace.record);
  return names;
}

}  // namespace

std::string fitted_rig_text(const rig_file::RigFile& declared, const Identification& found) {
  if (found.commissioning)
    return rig_file::commissioned_text(declared, *found.commissioning,
                                       "identified from " + joined(found.procedures.front().records));
  rig_file::RigDocument document(declared);
  const double ratio = declared.rig.motor_axis_ratio();
  if (declared.rig.mesh.rigid) {
    document.set_fitted({found.rig, ratio, values_by_table(found.parameters), values_by_table(found.units)});
    replace_weight(document, found);
  } else {
    document.set_fitted({found.rig, ratio, found.parameters, found.units});
  }
  if (found.gap_map && gap_varies(declared.rig) && !found.unexplained)
    replace_gap_terms(document, *found.gap_map, found.rig.mesh.backlash / found.rig.mesh.lever());
  if (const double left = unexplained_deflection(found);
      std::isfinite(left) && declared.diagnosis.gap_traverse)
    rig_file::set_unexplained_deflection(document, left, "identified from " + joined(records_of(found)));
  document.read();  // what is written can be read
  return document.text();
}

}  // namespace backlash::identification
