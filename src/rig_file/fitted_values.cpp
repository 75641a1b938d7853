// SPDX-License-Identifier: BSD-3-Clause
// What a fit has found, written into a rig file by the table of parameters.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "backlash_diagnosis/rig_file/rig_document.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::rig_file {
namespace {

constexpr double kClear = 4;  // choice: standard errors, from which a value differs clearly from zero

/// "kg m^2, fitted +- 0.02", of a value that the file has divided by `divisor`; "held" without an error.
std::string fitted_comment(const FittedValues& found, const std::string& name, double divisor) {
  const double error = found.parameters.at(name).standard_error;
  if (!std::isfinite(error)) return found.units.at(name) + ", held";
  return fmt::format("{}, fitted +- {:.2g}", found.units.at(name), error / divisor);
}

/// A skew that does not differ clearly from zero makes no new line in a file.
bool is_worth_writing(const FittedValues& found, const YamlTree& tree) {
  const RigParameter& skew = servo_parameter(RigPart::sensors, ParameterKind::encoder_skew);
  const signal::Measured& m = found.parameters.at(skew.name);
  const auto sensors = tree.root->entries.find("sensors");
  if (sensors == tree.root->entries.end()) return false;
  return sensors->second.value->entries.count(skew.name) > 0 ||
         std::fabs(m.value) > kClear * m.standard_error;
}

/// A fit may leave the friction of one direction below 0, where its error reaches; no machine has that.
double possible_asymmetry(const RigParameter& asymmetry, const RigParameter& mean, const model::Rig& rig) {
  const double most = std::max(0.0, mean.get(rig));
  return std::clamp(asymmetry.get(rig), -most, most);
}

/// The map under "gear_train.PART".
const YamlNode& part_of(const YamlTree& tree, std::string_view part) {
  return *tree.root->entries.at("gear_train").value->entries.at(std::string(part)).value;
}

}  // namespace

void RigDocument::set_fitted(const FittedValues& found) {
  const model::Rig& rig = found.rig;
  for (const RigParameter& p : servo_parameters()) {
    const auto measured = found.parameters.find(p.name);
    if (measured == found.parameters.end() || p.key.empty()) continue;
    if (std::isinf(measured->second.standard_error)) continue;  // not determined: stays as declared
    if (p.kind == ParameterKind::encoder_skew && !is_worth_writing(found, tree())) continue;
    const double divisor = std::pow(found.motor_axis_ratio, p.ratio_power);
    const std::string comment = fitted_comment(found, p.name, divisor);
    if (p.kind == ParameterKind::backlash)
      set_backlash(rig, comment);
    else if (const RigParameter* asymmetry = asymmetry_of(p))
      set_directional(p.key, p.get(rig) / divisor, possible_asymmetry(*asymmetry, p, rig) / divisor, comment);
    else
      set(p.key, p.get(rig) / divisor, comment);
  }
}

void RigDocument::set_directional(const std::string& key, double mean, double asymmetry,
                                  const std::string& comment) {
  const YamlTree read = tree();
  const std::size_t dot = key.rfind('.'), first = key.find('.') + 1;
  const YamlNode& part = part_of(read, key.substr(first, dot - first));
  const auto found = part.entries.find(key.substr(dot + 1));
  if (found != part.entries.end() && found->second.value->entries.count("forward") > 0) {
    set(key + ".forward", mean + asymmetry, comment);
    set(key + ".backward", mean - asymmetry, comment);
  } else if (asymmetry != 0) {
    set(key, fmt::format("{{forward: {:.6g}, backward: {:.6g}}}", mean + asymmetry, mean - asymmetry),
        comment);
  } else {
    set(key, mean, comment);
  }
}

void RigDocument::set_backlash(const model::Rig& rig, const std::string& comment) {
  const YamlTree read = tree();
  const YamlNode& mesh = part_of(read, "mesh");
  const double backlash = rig.mesh.backlash;
  const RigParameter& angle = servo_parameter(RigPart::mesh, ParameterKind::backlash);
  const RigParameter& start = servo_parameter(RigPart::mesh, ParameterKind::start_in_gap);
  if (mesh.entries.count("half_gap") > 0)
    set("gear_train.mesh.half_gap", 0.5 * backlash, comment);
  else if (mesh.entries.count("backlash") > 0)
    set("gear_train.mesh.backlash", backlash, comment);
  else
    set(angle.key, angle.get(rig), comment);
  if (start.get(rig) != 0) set(start.key, start.get(rig), start.unit + ", fitted");
}

}  // namespace backlash::rig_file
