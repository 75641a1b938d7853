// SPDX-License-Identifier: BSD-3-Clause
// Strict reading of YAML configuration: every value is checked for presence, type and range, every key must
// be known. Errors name the file, the line, the full key, the value and the limit, e.g.
//   rig.yaml:12: gear_train.motor.inertia = -1: must be > 0
// Text in quotes is never a number or a boolean; a plain number may be read as text; a key without value
// counts as present and is refused by every reader. Documents are bounded as base/yaml_tree.h says.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace backlash {

/// Valid range of a number; infinite where not given. Bounds belong to the range unless `open_*`.
struct Range {
  double lower, upper;
  bool open_lower = false;

  static Range any();
  static Range positive();      ///< > 0
  static Range not_negative();  ///< >= 0
  static Range between(double lower, double upper);
  std::string text() const;           ///< "must be > 0"
  bool contains(double value) const;  ///< false for NaN and infinities
};

/// How well a number is known: one standard deviation.
struct Uncertainty {
  double size = 0;        // > 0
  bool relative = false;  // of the value, else in its unit
};

/// One map of a YAML document. Copies refer to the same map and remember together which keys were read.
class YamlReader {
 public:
  /// Throws MissingInput when the file cannot be opened, BadData when it is not YAML or not a map.
  static YamlReader from_file(const std::string& path);
  static YamlReader from_text(const std::string& text, const std::string& name);
  ~YamlReader();
  YamlReader(const YamlReader&);
  YamlReader& operator=(const YamlReader&);

  /// Whether the key is there; asking makes it known to finish().
  bool has(const std::string& key) const;
  bool is_text(const std::string& key) const;  ///< the value is a plain scalar, not a map or list

  /// All keys of the map in the order of the file; only asking for one by name makes it known.
  std::vector<std::string> keys() const;

  /// Readers of one value; BadData when it is absent, has another type or lies outside the range.
  /// A number may say how well it is known: {value: 0.0048, uncertainty: 30 %, source: data sheet};
  /// finish() refuses an uncertainty that nobody asked for.
  double number(const std::string& key, const Range& range) const;
  std::optional<Uncertainty> uncertainty(const std::string& key) const;  ///< absent: not said
  bool is_map(const std::string& key) const;  ///< and no number with its uncertainty
  long integer(const std::string& key, long lower, long upper) const;
  bool boolean(const std::string& key) const;
  std::string text(const std::string& key) const;
  std::string choice(const std::string& key, const std::vector<std::string>& allowed) const;
  std::vector<double> numbers(const std::string& key, const Range& range) const;
  std::vector<std::string> texts(const std::string& key) const;

  /// The same for keys whose absence has a documented meaning; a present value is checked as strictly.
  double number_or(const std::string& key, double absent, const Range& range) const;
  long integer_or(const std::string& key, long absent, long lower, long upper) const;
  bool boolean_or(const std::string& key, bool absent) const;
  std::string text_or(const std::string& key, const std::string& absent) const;

  YamlReader map(const std::string& key) const;
  std::optional<YamlReader> optional_map(const std::string& key) const;
  std::vector<YamlReader> maps(const std::string& key) const;  ///< a list of maps

  /// Marks a key as known without reading it (another loader reads it).
  void ignore(const std::string& key) const;

  /// Throws BadData if any key of this map or of a map read from it was never asked for.
  void finish() const;

  /// A BadData for `key`, naming file, line and value: for checks that need more than one key.
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;

  /// Name of the file (or text) that this reader reads.
  const std::string& source() const;

 private:
  struct Impl;
  explicit YamlReader(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace backlash
