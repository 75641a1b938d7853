// SPDX-License-Identifier: BSD-3-Clause
// The YAML document of a machine as a text in which single values change: its layout, its other values and
// its comments stay, so that a person can still read what a program has written. The one editor of rig files.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_tree.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::rig_file {

/// What a fit says of a machine.
struct FittedValues {
  const model::Rig& rig;    // at the load side
  double motor_axis_ratio;  // of the rig file
  const std::map<std::string, signal::Measured>&
      parameters;                                   // what was fitted, by the names of servo_parameters()
  const std::map<std::string, std::string>& units;  // of all of these
};

/// Maps and lists may be written by indentation or in brackets, on one line or several. All that changes the
/// text throws BadData with the name, the line and the key where the document does not have what is asked
/// for.
class RigDocument {
 public:
  /// `name` is that of the file, for messages.
  RigDocument(const std::string& text, const std::string& name);
  explicit RigDocument(const RigFile& file) : RigDocument(file.text, file.source) {}

  std::string text() const;

  /// The machine that the text describes now. Throws as rig_file_from_text().
  RigFile read() const;

  /// Replaces the scalar, or the map in brackets, under `key` ("gear_train.motor.inertia"), and the comment
  /// of its line unless `comment` is empty or the key stands in brackets. A key that is absent becomes the
  /// first of its map, which must exist. Numbers get six digits.
  void set(const std::string& key, const std::string& value, const std::string& comment = "");
  void set(const std::string& key, double value, const std::string& comment = "");

  /// All that was fitted, in the units of the file (of the motor shaft where it says motor_side: true), each
  /// with its standard error as comment; what has an infinite one stays as it is. Friction becomes a map of
  /// both directions where they differ, backlash is said as the file says it: backlash, half_gap or
  /// backlash_angle.
  void set_fitted(const FittedValues& found);

  /// A section at the end, in place of one of this name; `entries` are its lines.
  void set_section(const std::string& key, const std::string& entries, const std::string& comment);

  /// Another law with all its values in place of the declared one.
  void set_contact_law(const model::ContactSpec& contact);

  /// A file of test runs beside this one is found from any folder.
  void set_whole_path_of_test_runs();

  /// Puts entries as of term_text() (indented by two) behind the terms that are there. Where there are none,
  /// `comment` stands beside the new key.
  void append_terms(const std::vector<std::string>& entries, const std::string& comment);

  /// Throws what set_fitted(), set_contact_law() and append_terms() would, for any values of this machine.
  void check_changes(const model::Rig& declared) const;

  /// Puts entries in place of the terms whose id `is_old`. Throws BadData where there is none.
  void replace_terms(const std::function<bool(const std::string& id)>& is_old,
                     const std::vector<std::string>& entries);

  /// Takes away the comments before the first key.
  void drop_head();

 private:
  using Lines = std::vector<std::string>;
  /// An item of a list: its lines, and the column of its dash.
  struct Item {
    std::size_t begin, end, column;
  };
  /// A place in the text: a line and a column, both from 0.
  struct Place {
    std::size_t line, column;
  };

  YamlTree tree() const { return parse_yaml(text(), name_); }
  void set_directional(const std::string& key, double mean, double asymmetry, const std::string& comment);
  void set_backlash(const model::Rig& rig, const std::string& comment);
  Place begin_of(const YamlNode& node) const;
  Place end_of(const YamlNode& node, const std::string& key) const;
  void replace(const YamlNode& node, const std::string& key, const std::string& value,
               const std::string& comment);
  void insert(const YamlNode& map, const std::string& key, const std::string& value,
              const std::string& comment);
  void list_by_lines(const std::string& key);
  Item item(const YamlEntry& list, const YamlNode& node) const;

  std::string name_;
  Lines lines_;
};

}  // namespace backlash::rig_file
