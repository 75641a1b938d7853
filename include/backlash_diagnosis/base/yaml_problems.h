// SPDX-License-Identifier: BSD-3-Clause
// All mistakes of a YAML document at once.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace backlash {

/// While one lives, readers of its thread (base/yaml_reader.h) note what is missing or wrong, hand out a
/// value that is right instead, and go on; finish() notes all unknown keys. Nobody may use what was read
/// unless raise() returns. The newest of a thread counts.
class YamlProblems {
 public:
  YamlProblems();
  ~YamlProblems();
  YamlProblems(const YamlProblems&) = delete;
  YamlProblems& operator=(const YamlProblems&) = delete;

  /// The one that counts; null: readers throw what they find.
  static YamlProblems* current();

  void note(const std::string& text);
  /// Runs a part of the reading. What it throws is noted too, but where values that are handed out instead
  /// may have led to it.
  void reading(const std::function<void()>& part);
  bool any() const { return !texts_.empty(); }

  /// Throws BadData: the mistake, or a list of them all.
  void raise(const std::string& source) const;

 private:
  YamlProblems* before_;
  std::vector<std::string> texts_;
};

}  // namespace backlash
