// SPDX-License-Identifier: BSD-3-Clause
#include "history_line.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/diagnosis/verdict.h"

namespace backlash::diagnosis {

const char* const kEstimateEvent = "estimate";
const char* const kBaselineEvent = "baseline";
const std::string kHistoryHeader =
    "time,date,event,grade,backlash,lower,upper,backlash_angle,angle_lower,angle_upper,skewness,methods,"
    "rig_digest";

namespace {

constexpr std::size_t kColumns = 13;

/// The numbers that may be unknown, in the order of their columns.
constexpr double HistoryEntry::*kNumbers[] = {&HistoryEntry::backlash,    &HistoryEntry::lower,
                                              &HistoryEntry::upper,       &HistoryEntry::backlash_angle,
                                              &HistoryEntry::angle_lower, &HistoryEntry::angle_upper,
                                              &HistoryEntry::skewness};

bool is_event(const std::string& text) {
  return text == kEstimateEvent || text == kBaselineEvent;
}

bool is_grade(const std::string& text) {
  for (const Grade grade :
       {Grade::good, Grade::watch, Grade::service, Grade::stop, Grade::ungraded, Grade::cannot_tell})
    if (text == to_string(grade)) return true;
  return false;
}

/// Text that needs no quoting in a CSV file.
bool is_plain(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return c >= ' ' && c != 127 && c != ',' && c != '"'; });
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string to_line(const HistoryEntry& entry) {
  if (!std::isfinite(entry.time)) throw InvalidParameter("history.time", entry.time, "must be finite");
  if (!is_event(entry.event))
    throw InvalidParameter("history.event", entry.event, "must be estimate or baseline");
  if (!is_grade(entry.grade)) throw InvalidParameter("history.grade", entry.grade, "must be a grade");
  for (const std::string* text : {&entry.methods, &entry.rig_digest})
    if (!is_plain(*text))
      throw InvalidParameter("history", printable(*text), "must hold no comma, quote or control character");
  std::string line = to_text(entry.time) + "," + utc_time(entry.time) + "," + entry.event + "," + entry.grade;
  for (const auto number : kNumbers)
    line += "," + (std::isfinite(entry.*number) ? to_text(entry.*number) : std::string());
  return line + "," + entry.methods + ",\"" + entry.rig_digest + "\"";
}

HistoryEntry entry_from_line(std::string_view line, const std::string& where) {
  const std::vector<std::string_view> cells = split(line);
  if (cells.size() != kColumns)
    throw BadData(where,
                  "has " + std::to_string(cells.size()) + " of " + std::to_string(kColumns) + " cells");
  const auto number = [&](std::size_t column) {
    const ParsedNumber parsed = parse_number(cells[column]);
    if (!parsed) throw BadData(where, "'" + printable(cells[column]) + "': " + parsed.problem);
    return parsed.value;
  };
  HistoryEntry entry;
  entry.time = number(0);
  entry.event = cells[2];
  entry.grade = cells[3];
  if (!is_event(entry.event)) throw BadData(where, "'" + printable(entry.event) + "': no event");
  if (!is_grade(entry.grade)) throw BadData(where, "'" + printable(entry.grade) + "': no grade");
  std::size_t column = 4;
  for (const auto member : kNumbers) {
    if (!cells[column].empty()) entry.*member = number(column);
    ++column;
  }
  entry.methods = cells[column++];
  const std::string_view last = cells[column];
  if (last.size() < 2 || last.front() != '"' || last.back() != '"') throw BadData(where, "cut off");
  entry.rig_digest = last.substr(1, last.size() - 2);
  if (!is_plain(entry.methods) || !is_plain(entry.rig_digest))
    throw BadData(where, "holds bytes that are no text");
  return entry;
}

}  // namespace backlash::diagnosis
