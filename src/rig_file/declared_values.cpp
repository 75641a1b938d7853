// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/declared_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <sstream>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_tree.h"
#include "known_places.h"

namespace backlash::rig_file {
namespace {

/// What stands behind the # of each line.
std::vector<std::string> comments_of(const std::string& text) {
  std::vector<std::string> comments;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t mark = line.find(" #");
    comments.push_back(mark == std::string::npos ? "" : std::string(trimmed(line.substr(mark + 2))));
  }
  return comments;
}

/// The unit at the beginning of a comment, up to "," or " [": "N m s/rad", "-"; empty where none is there.
std::string unit_of_comment(const std::string& comment) {
  static const std::regex unit(
      "-|%|(m|mm|um|rad|deg|s|kg|N|A|V|Hz|Pa)(\\^[0-9.]+)?([ /](1|m|rad|s|kg|N|A|V|Hz)(\\^[0-9.]+)?)*");
  const std::string begin = comment.substr(0, std::min(comment.find(','), comment.find(" [")));
  return std::regex_match(begin, unit) ? begin : "";
}

/// What a comment says besides the unit that it begins with, without a bracket around all of it.
std::string without_unit(const std::string& comment, std::size_t unit) {
  std::string rest(trimmed(comment.substr(std::min(comment.size(), unit + (comment[unit] == ',')))));
  if (rest.size() > 1 && rest.front() == '[' && rest.find(']') == rest.size() - 1)
    rest = rest.substr(1, rest.size() - 2);
  return rest;
}

std::string joined_path(std::vector<std::string> path) {
  if (path.front() == "gear_train") path.erase(path.begin());
  return fmt::format("{}", fmt::join(path, "."));
}

class Listing {
 public:
  explicit Listing(const RigFile& file) : file_(file), comments_(comments_of(file.text)) {
    const YamlTree tree = parse_yaml(file.text, file.source);
    for (const char* section : {"gear_train", "commissioned"}) {
      const auto entry = tree.root->entries.find(section);
      if (entry != tree.root->entries.end()) walk(*entry->second.value, {section});
    }
    for (std::size_t q = 0; file.diagnosis.waveform && q < known_places().size(); ++q) add_default(q);
  }

  std::vector<DeclaredValue> values;

 private:
  void walk(const YamlNode& map, const std::vector<std::string>& above) {
    std::vector<std::pair<int, std::string>> order;
    for (const auto& [key, entry] : map.entries) order.emplace_back(entry.line, key);
    std::sort(order.begin(), order.end());
    for (const auto& [line, key] : order) {
      std::vector<std::string> path = above;
      path.push_back(key);
      const YamlNode& node = *map.entries.at(key).value;
      if (node.kind == YamlNode::Kind::plain)
        add(path, node, line, {}, "");
      else if (node.kind == YamlNode::Kind::map && node.entries.count("value") > 0)
        add(path, *node.entries.at("value").value, line, scalar(node, "uncertainty"), scalar(node, "source"));
      else if (node.kind == YamlNode::Kind::map)
        walk(node, path);
    }
  }

  /// What of a machine that no waveform is fitted to decides the units of its teeth.
  static diagnosis::WaveformSettings contact_of(const model::Rig& rig) {
    diagnosis::WaveformSettings s;
    s.angular = rig.mesh.angular();
    if (rig.mesh.rigid) return s;
    if (const auto contact = rig.mesh.contact->power_contact()) s.contact_exponent = contact->exponent;
    return s;
  }

  static std::string scalar(const YamlNode& map, const char* key) {
    const auto entry = map.entries.find(key);
    return entry == map.entries.end() ? std::string() : entry->second.value->scalar;
  }

  /// Nothing where the node is no number.
  void add(const std::vector<std::string>& path, const YamlNode& node, int line, std::string uncertainty,
           std::string source) {
    const ParsedNumber number = parse_number(node.scalar);
    if (!number) return;
    DeclaredValue v;
    v.name = joined_path(path);
    v.value = number.value;
    v.uncertainty = std::move(uncertainty);
    v.source = std::move(source);
    const auto at = static_cast<std::size_t>(line) - 1;
    const std::string comment = at < comments_.size() ? comments_[at] : "";
    const std::string unit = unit_of_comment(comment);
    if (const std::string said = without_unit(comment, unit.size()); !said.empty())
      v.source += (v.source.empty() ? "" : "; ") + said;
    const auto& places = known_places();
    const auto place =
        std::find_if(places.begin(), places.end(), [&path](const KnownPlace& p) { return p.path == path; });
    if (place != places.end()) fill_quantity(v, static_cast<std::size_t>(place - places.begin()));
    if (v.unit.empty() && unit != "-") v.unit = unit;
    values.push_back(std::move(v));
  }

  void fill_quantity(DeclaredValue& v, std::size_t q) {
    const diagnosis::WaveformQuantity& quantity = diagnosis::waveform_quantities()[q];
    const diagnosis::WaveformSettings contact = file_.diagnosis.waveform.value_or(contact_of(file_.rig));
    v.unit = quantity.unit_in(contact);
    if (const std::size_t power = v.unit.find("^n");
        power != std::string::npos && contact.contact_exponent == 1)
      v.unit.erase(power, 2);
    v.share = shared_inertia(known_places()[q], file_.rig);
    if (!v.uncertainty.empty() && v.uncertainty.back() != '%') v.uncertainty += " " + v.unit;
    if (!file_.diagnosis.waveform || !quantity.in(*file_.diagnosis.waveform)) return;
    v.quantity = static_cast<int>(q);
    if (v.uncertainty.empty()) v.uncertainty = default_text(quantity);
  }

  std::string default_text(const diagnosis::WaveformQuantity& q) const {
    const double spread = file_.diagnosis.waveform->spread.*q.spread;
    if (q.factor) return fmt::format("{:.3g} %, by default", 100 * spread);
    if (std::isfinite(spread)) return fmt::format("{:.3g} {}, by default", spread, q.unit);
    return fmt::format("{:.3g} % of the torque's level, by default",
                       100 * diagnosis::WaveformSpread::kDryFriction);
  }

  void add_default(std::size_t q) {
    if (!diagnosis::waveform_quantities()[q].in(*file_.diagnosis.waveform)) return;
    if (std::any_of(values.begin(), values.end(),
                    [q](const DeclaredValue& v) { return v.quantity == static_cast<int>(q); }))
      return;
    DeclaredValue v;
    v.name = joined_path(known_places()[q].path);
    v.value = (*file_.diagnosis.waveform).*diagnosis::waveform_quantities()[q].at;
    v.source = "not in the file";
    fill_quantity(v, q);
    values.push_back(std::move(v));
  }

  const RigFile& file_;
  std::vector<std::string> comments_;
};

}  // namespace

std::vector<DeclaredValue> declared_values(const RigFile& file) {
  return Listing(file).values;
}

}  // namespace backlash::rig_file
