// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/gap_terms.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

const std::string kTerm = "varying_backlash";

bool is_gap_term(const std::string& id) {
  return id == kTerm || id == "backlash_map";
}

double mean_gap(const Rig& rig, const GapMap& map, GapUse use) {
  if (use == GapUse::variation) return rig.mesh.backlash / rig.mesh.lever();
  const bool corrected = use == GapUse::corrected && std::isfinite(map.mean_gap.value);
  return corrected ? map.mean_gap.value : map.mean_separation.value;
}

void check_mean(double mean) {
  if (!(mean > 0)) throw InvalidParameter("mean gap", mean, "must be > 0 rad");
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::size_t indent_of(const std::string& line) {
  return std::min(line.find_first_not_of(' '), line.size());
}

/// "  - id: NAME  # comment" -> NAME
std::string id_of(const std::string& line) {
  std::istringstream in(line);
  std::string dash, key, id;
  in >> dash >> key >> id;
  return dash == "-" && key == "id:" ? id : "";
}

}  // namespace

bool gap_varies(const Rig& rig) {
  return std::any_of(rig.terms.begin(), rig.terms.end(),
                     [](const auto& term) { return is_gap_term(term->id); });
}

GapMap with_wind_up(GapMap map, const Rig& rig) {
  if (!rig.mesh.contact_spec.values.has("stiffness"))
    throw InvalidParameter("contact.law", rig.mesh.contact_spec.law, "has no stiffness to be wound up");
  const double lever = rig.mesh.lever(), k = rig.mesh.contact_spec.values.at("stiffness") * lever * lever;
  const Body& load = rig.link;
  const double forward = load.coulomb_friction + load.coulomb_asymmetry +
                         (load.viscous_damping + load.viscous_asymmetry) * std::fabs(map.forward_speed);
  const double backward = load.coulomb_friction - load.coulomb_asymmetry +
                          (load.viscous_damping - load.viscous_asymmetry) * std::fabs(map.reverse_speed);
  map.wind_up = {(forward + backward) / k, 0};
  map.mean_gap = {map.mean_separation.value - map.wind_up.value, map.mean_separation.standard_error};
  return map;
}

Rig with_gap_map(Rig rig, const GapMap& map, GapUse use) {
  const double mean = mean_gap(rig, map, use);
  check_mean(mean);
  rig.mesh.backlash = mean * rig.mesh.lever();
  const auto old = [](const auto& term) { return is_gap_term(term->id); };
  rig.terms.erase(std::remove_if(rig.terms.begin(), rig.terms.end(), old), rig.terms.end());
  for (const Harmonic& h : map.harmonics)
    rig.terms.push_back(make_term(
        kTerm,
        {{"amplitude", h.amplitude.value / mean}, {"order", double(h.order)}, {"phase", h.phase.value}}));
  return rig;
}

std::string gap_terms_yaml(const GapMap& map, double mean) {
  check_mean(mean);
  std::string text;
  for (const Harmonic& h : map.harmonics)
    text += fmt::format(
        "  - id: {}\n    amplitude: {:<13.5f} # -, +- {:.1g}\n    order: {:<17} # 1/rad\n"
        "    phase: {:<17.4f} # rad, +- {:.1g}\n",
        kTerm, h.amplitude.value / mean, h.amplitude.standard_error / mean, h.order, h.phase.value,
        h.phase.standard_error);
  return text;
}

std::string with_gap_terms(const std::string& text, const std::string& name, const GapMap& map, double mean) {
  std::string result;
  bool replaced = false, dropping = false;
  std::size_t dash = 0;  // indent of the entry that is dropped
  for (const std::string& line : lines_of(text)) {
    // An entry ends with the first line that is not deeper than its dash, a blank one too.
    if (dropping && indent_of(line) <= dash) dropping = false;
    if (is_gap_term(id_of(line))) {
      if (!replaced) result += gap_terms_yaml(map, mean);
      replaced = dropping = true;
      dash = indent_of(line);
    }
    if (!dropping) result += line + '\n';
  }
  if (!replaced)
    throw BadData(name,
                  "terms: has no entry '- id: " + kTerm + "' or backlash_map in block style to replace");
  return result;
}

}  // namespace backlash
