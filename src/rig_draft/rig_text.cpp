// SPDX-License-Identifier: BSD-3-Clause
#include "rig_text.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "backlash_diagnosis/rig_draft/draft.h"

namespace backlash::rig_draft {
namespace {

constexpr std::size_t kCommentColumn = 38;

}  // namespace

void RigText::line(const std::string& text, const std::string& comment) {
  text_ += text;
  if (!comment.empty())
    text_ += std::string(text.size() + 2 > kCommentColumn ? 2 : kCommentColumn - text.size(), ' ') + "# " +
             comment;
  text_ += "\n";
}

void RigText::value(const std::string& key, double value, const std::string& comment) {
  line(fmt::format("{}: {:.4g}", key, value), comment);
}

void RigText::fill_in(const std::string& key, double value, const std::string& unit, const std::string& path,
                      const std::string& where) {
  this->value(key, value, unit + "; FILL IN: " + where);
  to_fill(path + ": " + where);
}

std::string from_record(const signal::Measured& m) {
  if (!(m.value > 0)) return "from the record, which shows none";
  const double share = m.standard_error / m.value;
  if (!(share < 1)) return "from the record, hardly known";
  return fmt::format("from the record, +- {:.0f} %", std::ceil(100 * share));
}

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << std::quoted(text);
  return out.str();
}

}  // namespace backlash::rig_draft
