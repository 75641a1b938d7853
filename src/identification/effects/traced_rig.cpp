// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/effects/traced_rig.h"

#include <filesystem>
#include <iomanip>
#include <sstream>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_tree.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/term_text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/rig_file/yaml_edit.h"
#include "rig_file/rig_text.h"

namespace backlash {
namespace {

using Lines = std::vector<std::string>;

Lines lines_of(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Of its first character that is no space; npos in an empty line.
std::size_t column_of(const std::string& line) {
  return line.find_first_not_of(' ');
}

bool says_nothing(const std::string& line) {
  const std::size_t column = column_of(line);
  return column == std::string::npos || line[column] == '#';
}

/// Of `entries` indented by two, at another column.
Lines indented(const Lines& entries, std::size_t column) {
  Lines out;
  for (const std::string& line : entries) out.push_back(std::string(column, ' ') + line.substr(2));
  return out;
}

/// The entries of all terms that the declared rig has not.
Lines new_entries(const Rig& declared, const Rig& augmented) {
  Lines entries;
  for (std::size_t i = declared.terms.size(); i < augmented.terms.size(); ++i)
    for (std::string line : lines_of(term_text(*augmented.terms[i]))) {
      const std::size_t comment = line.find("  # ");
      if (comment != std::string::npos)
        line = line.substr(0, comment) + axis_unit(line.substr(comment), declared.linear);
      entries.push_back(std::move(line));
    }
  return entries;
}

/// Behind the last of the terms that stand there already.
void insert_entries(Lines& lines, const YamlNode& terms, const Lines& entries, const std::string& name) {
  std::size_t dash = std::size_t(terms.items.back()->line) - 1;
  while (dash > 0 && (says_nothing(lines[dash]) || lines[dash][column_of(lines[dash])] != '-')) --dash;
  const std::size_t column = column_of(lines[dash]);
  if (column == std::string::npos || lines[dash][column] != '-')
    throw BadData(name + ":" + std::to_string(terms.line),
                  "terms: must have a line for each value (block style) to be added to");
  std::size_t end = dash + 1;
  for (std::size_t k = end; k < lines.size(); ++k) {
    if (says_nothing(lines[k])) continue;
    if (column_of(lines[k]) <= column) break;
    end = k + 1;
  }
  const Lines here = indented(entries, column);
  lines.insert(lines.begin() + std::ptrdiff_t(end), here.begin(), here.end());
}

std::string with_entries(const std::string& text, const std::string& name, const Lines& entries) {
  const YamlTree tree = parse_yaml(text, name);
  Lines lines = lines_of(text);
  const auto terms = tree.root->entries.find("terms");
  if (terms != tree.root->entries.end() && !terms->second.value->items.empty()) {
    insert_entries(lines, *terms->second.value, entries, name);
  } else {
    if (terms != tree.root->entries.end()) lines.erase(lines.begin() + terms->second.line - 1);  // terms: []
    lines.insert(lines.end(), {"", "terms:                            # found by trace_residual"});
    lines.insert(lines.end(), entries.begin(), entries.end());
  }
  std::string out;
  for (const std::string& line : lines) out += line + '\n';
  return out;
}

/// A list of test runs that stands in a file beside the declared one is found from anywhere.
std::string with_whole_path(const std::string& text, const std::string& name) {
  const YamlReader yaml = YamlReader::from_text(text, name);
  if (!yaml.has("test_runs") || !yaml.is_text("test_runs")) return text;
  const std::filesystem::path beside = std::filesystem::absolute(name).parent_path();
  std::ostringstream path;
  path << std::quoted((beside / yaml.text("test_runs")).lexically_normal().string());
  return with_yaml_value(text, name, "test_runs", path.str());
}

}  // namespace

std::string traced_rig_text(const RigFile& declared, const Trace& trace) {
  std::map<std::string, std::string> units;
  for (const auto& [name, unit] : trace.units) units[name] = axis_unit(unit, declared.rig.linear);
  RigText machine(declared);
  const ContactSpec& contact = trace.augmented.mesh.contact_spec;
  if (!declared.rig.mesh.rigid && contact.law != declared.rig.mesh.contact_spec.law) {
    machine.set_contact_law(contact);
    units["mesh_stiffness"] += "^1.5";
  }
  write_servo(machine, {trace.augmented, trace.parameters, units}, declared.rig.motor_axis_ratio());
  std::string text = with_whole_path(machine.text(), declared.source);
  const Lines entries = new_entries(declared.rig, trace.augmented);
  if (!entries.empty()) text = with_entries(text, declared.source, entries);
  rig_file_from_text(text, declared.source);  // what is written can be read
  return text;
}

void check_traced_rig_text(const RigFile& declared) {
  Trace trace;
  trace.augmented = load_side(declared.rig);
  trace.augmented.terms.push_back(make_term("delay", {{"delay", 0}}));
  for (const RigParameter& p : servo_parameters()) {
    if (!p.known_to(declared.rig) || p.get(declared.rig) == 0) continue;
    trace.parameters[p.name] = {p.get(trace.augmented), 0};
    trace.units[p.name] = p.unit;
  }
  traced_rig_text(declared, trace);
}

}  // namespace backlash
