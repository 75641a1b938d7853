// SPDX-License-Identifier: BSD-3-Clause
// Lines of a rig file with their comments, and what a person has to fill in.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::rig_draft {

class RigText {
 public:
  /// One line. `key` with its indentation; a comment is set off.
  void line(const std::string& text, const std::string& comment = "");
  void value(const std::string& key, double value, const std::string& comment);
  /// The same, of a value that a person has to look at: `path` of the key, `where` it can be found.
  void fill_in(const std::string& key, double value, const std::string& unit, const std::string& path,
               const std::string& where);
  /// Only the words.
  void to_fill(const std::string& what) { to_fill_.push_back(what); }

  const std::vector<std::string>& to_fill() const { return to_fill_; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::vector<std::string> to_fill_;
};

/// "from the record, +- 10 %"
std::string from_record(const signal::Measured& m);

}  // namespace backlash::rig_draft
