// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/gap_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash::identification {
namespace {

/// The term of one order of the map.
const std::string& order_term() {
  static const std::string& id = model::term_type_that([](const model::TermType& type) {
                                   return type.gap_variation == model::GapVariation::harmonic;
                                 }).id;
  return id;
}

bool varies_gap(const std::string& id) {
  return model::term_type(id).gap_variation != model::GapVariation::none;
}

double mean_gap(const model::Rig& rig, const GapMap& map, GapUse use) {
  if (use == GapUse::variation) return rig.mesh.backlash / rig.mesh.lever();
  const bool corrected = use == GapUse::corrected && std::isfinite(map.mean_gap.value);
  return corrected ? map.mean_gap.value : map.mean_separation.value;
}

void check_mean(double mean) {
  if (!(mean > 0)) throw InvalidParameter("mean gap", mean, "must be > 0 rad");
}

}  // namespace

bool gap_varies(const model::Rig& rig) {
  return std::any_of(rig.terms.begin(), rig.terms.end(),
                     [](const auto& term) { return varies_gap(term->id); });
}

GapMap with_mean_gap(GapMap map, const signal::Measured& fitted) {
  map.mean_gap = fitted;
  for (const Harmonic& h : map.harmonics)
    map.mean_gap.standard_error = std::hypot(map.mean_gap.standard_error, h.amplitude.standard_error);
  map.wind_up = {map.mean_separation.value - map.mean_gap.value,
                 std::hypot(map.mean_separation.standard_error, map.mean_gap.standard_error)};
  return map;
}

model::Rig with_gap_map(model::Rig rig, const GapMap& map, GapUse use) {
  const double mean = mean_gap(rig, map, use);
  check_mean(mean);
  rig.mesh.backlash = mean * rig.mesh.lever();
  const auto old = [](const auto& term) { return varies_gap(term->id); };
  rig.terms.erase(std::remove_if(rig.terms.begin(), rig.terms.end(), old), rig.terms.end());
  for (const Harmonic& h : map.harmonics)
    rig.terms.push_back(model::make_term(
        order_term(),
        {{"amplitude", h.amplitude.value / mean}, {"order", double(h.order)}, {"phase", h.phase.value}}));
  return rig;
}

void replace_gap_terms(rig_file::RigDocument& document, const GapMap& map, double mean) {
  check_mean(mean);
  std::vector<std::string> entries;
  for (const Harmonic& h : map.harmonics)
    entries.push_back(
        fmt::format("  - id: {}\n    amplitude: {:<13.5f} # -, +- {:.1g}\n    order: {:<17d} # 1/rad\n"
                    "    phase: {:<17.4f} # rad, +- {:.1g}\n",
                    order_term(), h.amplitude.value / mean, h.amplitude.standard_error / mean, h.order,
                    h.phase.value, h.phase.standard_error));
  document.replace_terms(varies_gap, entries);
}

}  // namespace backlash::identification
