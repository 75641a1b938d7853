// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/known_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_document.h"
#include "known_places.h"

namespace backlash::rig_file {
namespace {

constexpr const char* kUnexplained = "unexplained_deflection";
constexpr const char* kGapKeys[] = {"backlash", "half_gap", "backlash_angle"};

/// The map that holds the last key of the path; nothing where the file has none.
std::optional<YamlReader> holder(const YamlReader& yaml, const std::vector<std::string>& path) {
  YamlReader at = yaml;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (!at.is_map(path[i])) return std::nullopt;
    at = at.map(path[i]);
  }
  return at;
}

/// As a standard deviation of the logarithm, or in the unit of the value.
double spread_of(const YamlReader& yaml, const std::string& key, const Uncertainty& u, double value,
                 bool factor) {
  if (!(value > 0) && (factor || u.relative)) yaml.fail(key, "a value of 0 has no such uncertainty");
  if (factor == u.relative) return u.size;
  return factor ? u.size / value : u.size * value;
}

void read_value(const YamlReader& yaml, RigFile& file, std::size_t index) {
  const diagnosis::WaveformQuantity& q = diagnosis::waveform_quantities()[index];
  if (file.diagnosis.waveform && !q.in(*file.diagnosis.waveform)) return;
  const KnownPlace& place = known_places()[index];
  const std::string& key = place.path.back();
  const auto map = holder(yaml, place.path);
  if (!map || !map->has(key)) return;
  const auto u = map->uncertainty(key);
  const bool commissioned = place.path.front() == "commissioned";
  if (commissioned && !file.diagnosis.waveform) map->fail(key, "no estimator of this rig uses it");
  if (commissioned)
    (*file.diagnosis.waveform).*q.at = map->number(key, q.factor ? Range::positive() : Range::not_negative());
  if (!u || !file.diagnosis.waveform) return;
  diagnosis::WaveformSettings& s = *file.diagnosis.waveform;
  const double part = s.*q.at - shared_inertia(place, file.rig);
  s.spread.*q.spread = spread_of(*map, key, *u, part, q.factor) * (q.factor ? part / s.*q.at : 1);
}

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << std::quoted(text);
  return out.str();
}

std::string known_text(double value, double spread, bool factor, const std::string& source) {
  const std::string u = factor ? fmt::format("{:.3g} %", 100 * spread) : fmt::format("{:.3g}", spread);
  return fmt::format("{{value: {:.6g}, uncertainty: {}{}}}", value, u,
                     source.empty() ? "" : ", source: " + quoted(source));
}

void set_backlash_of(RigDocument& document, const RigFile& file, double backlash, double error,
                     const std::string& source) {
  const YamlTree tree = parse_yaml(file.text, file.source);
  const YamlNode& mesh = *tree.root->entries.at("gear_train").value->entries.at("mesh").value;
  const double units[] = {1, 0.5, 1 / file.rig.mesh.lever()};
  for (std::size_t i = 0; i < 3; ++i)
    if (mesh.entries.count(kGapKeys[i]) > 0)
      document.set(std::string("gear_train.mesh.") + kGapKeys[i],
                   known_text(units[i] * backlash, error, true, source), i < 2 ? "m" : "rad");
}

}  // namespace

const std::vector<KnownPlace>& known_places() {
  using model::Rig;
  static const std::vector<KnownPlace> table = {
      {{"gear_train", "motor", "viscous_damping"}},
      {{"gear_train", "motor", "coulomb_friction"}},
      {{"commissioned", "friction_speed"}},
      {{"gear_train", "input_coupling", "stiffness"}},
      {{"gear_train", "input_coupling", "damping"}},
      {{"gear_train", "motor", "inertia"}, &Rig::input_coupling},
      {{"gear_train", "pinion", "inertia"}, &Rig::input_coupling},
      {{"gear_train", "gear", "inertia"}, &Rig::output_coupling},
      {{"gear_train", "output_coupling", "stiffness"}},
      {{"gear_train", "output_coupling", "damping"}},
      {{"gear_train", "mesh", "contact", "stiffness"}},
      {{"gear_train", "mesh", "contact", "alpha"}},
      {{"gear_train", "mesh", "contact", "damping"}},
      {{"gear_train", "link", "inertia"}, &Rig::output_coupling, &Rig::gear},
      {{"gear_train", "link", "viscous_damping"}},
      {{"gear_train", "link", "coulomb_friction"}},
      {{"commissioned", "sensor_gain"}},
      {{"commissioned", "sensor_delay"}},
      {{"commissioned", "sensor_time_constant"}}};
  return table;
}

double shared_inertia(const KnownPlace& place, const model::Rig& rig) {
  if (place.half == nullptr) return 0;
  const model::Coupling& coupling = rig.*place.half;
  return coupling.rigid && place.body != nullptr ? (rig.*place.body).inertia : 0.5 * coupling.inertia;
}

void read_known_values(const YamlReader& yaml, RigFile& file) {
  for (std::size_t i = 0; i < known_places().size(); ++i) read_value(yaml, file, i);
  if (const auto mesh = holder(yaml, {"gear_train", "mesh", "backlash"}))
    for (const char* key : kGapKeys)
      if (const auto u = mesh->uncertainty(key))
        file.backlash_error = spread_of(*mesh, key, *u, mesh->number(key, Range::not_negative()), true);
  const auto commissioned = yaml.optional_map("commissioned");
  if (commissioned && commissioned->has(kUnexplained)) {
    if (!file.diagnosis.gap_traverse) commissioned->fail(kUnexplained, "no estimator of this rig uses it");
    file.diagnosis.gap_traverse->unexplained = commissioned->number(kUnexplained, Range::not_negative());
  }
  if (!commissioned || !commissioned->has("common_scale")) return;
  commissioned->number("common_scale", Range::between(1, 1));
  const auto scale = commissioned->uncertainty("common_scale");
  if (!scale || !file.diagnosis.waveform)
    commissioned->fail("common_scale", "needs an uncertainty, and a rig whose waveform is fitted");
  file.diagnosis.waveform->common_scale = scale->size;
}

void set_unexplained_deflection(RigDocument& document, double rms, const std::string& source) {
  document.set_section("commissioned",
                       fmt::format("  {}: {:.3g}   # rad, rms, beyond noise\n", kUnexplained, rms),
                       "what the fitted machine left of motor less load position: " + source);
}

std::string commissioned_text(const RigFile& file, const diagnosis::WaveformCommissioning& found,
                              const std::string& source) {
  RigDocument document(file);
  std::string section =
      fmt::format("  common_scale: {{value: 1, uncertainty: {:.3g} %}}\n", 100 * found.machine.common_scale);
  for (std::size_t i = 0; i < known_places().size(); ++i) {
    const diagnosis::WaveformQuantity& q = diagnosis::waveform_quantities()[i];
    const KnownPlace& place = known_places()[i];
    if (!q.in(found.machine)) continue;
    const char* unit = q.unit_in(found.machine);
    if (std::count(found.undetermined.begin(), found.undetermined.end(), q.name) > 0) continue;
    const double whole = found.machine.*q.at, value = whole - shared_inertia(place, file.rig);
    if (q.factor && !(value > 0))
      throw CannotIdentify(
          fmt::format("{} {:.4g} {} is less than the share of what moves along", q.name, whole, unit));
    const double spread = found.machine.spread.*q.spread * (q.factor ? whole / value : 1);
    const bool extra = place.path.front() == "commissioned";
    const std::string text = known_text(value, spread, q.factor, extra ? "" : source);
    if (extra)
      section += fmt::format("  {}: {}   # {}\n", q.name, text, unit);
    else
      document.set(fmt::format("{}", fmt::join(place.path, ".")), text, unit);
  }
  const diagnosis::WaveformCommissioning::State& first = found.states.front();
  set_backlash_of(document, file, first.backlash, first.log_error, source);
  document.set_section("commissioned", section,
                       "what the records determine beyond the keys above: " + source);
  document.read();  // what is written can be read
  return document.text();
}

}  // namespace backlash::rig_file
