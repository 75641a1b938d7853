// SPDX-License-Identifier: BSD-3-Clause
#include "mapped_csv.h"

#include <algorithm>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::record {
namespace {

constexpr char kBlanks = ' ';
constexpr char kSeparators[] = {',', ';', '\t', kBlanks};

/// Fields that may be in double quotes, within which a quote is doubled and a separator means nothing. False
/// where a quote is not closed or followed by more than the separator.
bool split_quoted(std::string_view line, char separator, std::vector<std::string>& fields) {
  fields.clear();
  for (;;) {
    const auto start = line.find_first_not_of(separator == '\t' ? " " : " \t");
    if (start == std::string_view::npos || line[start] != '"') {
      const auto end = line.find(separator);
      fields.emplace_back(trimmed(line.substr(0, end)));
      if (end == std::string_view::npos) return true;
      line.remove_prefix(end + 1);
      continue;
    }
    std::string field;
    std::size_t i = start + 1;
    for (; i < line.size() && (line[i] != '"' || line.substr(i, 2) == "\"\""); ++i) {
      if (line[i] == '"') ++i;
      field += line[i];
    }
    if (i >= line.size()) return false;
    fields.emplace_back(trimmed(field));
    line.remove_prefix(i + 1);
    const auto end = line.find(separator);
    if (!trimmed(line.substr(0, end)).empty()) return false;
    if (end == std::string_view::npos) return true;
    line.remove_prefix(end + 1);
  }
}

/// Fields between runs of blanks; there are no quotes.
bool split_blanks(std::string_view line, std::vector<std::string>& fields) {
  fields.clear();
  for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    fields.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return true;
}

bool split_fields(std::string_view line, char separator, std::vector<std::string>& fields) {
  return separator == kBlanks ? split_blanks(line, fields) : split_quoted(line, separator, fields);
}

bool is_own_header(std::string_view line) {
  std::vector<std::string_view> fields;
  split(line, ',', fields);
  return std::all_of(fields.begin(), fields.end(),
                     [](std::string_view field) { return is_own_column(label_of(field).name); });
}

bool is_whole_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

MappedCsv::MappedCsv(std::istream& in, const std::string& name, const ChannelMap& map)
    : lines_(in, name), name_(name), rows_(name, map) {
  const std::vector<MappedColumn>& columns = rows_.columns();
  by_number_ = std::all_of(columns.begin(), columns.end(),
                           [](const MappedColumn& c) { return is_whole_number(c.source->column); });
}

bool MappedCsv::holds_all_columns(std::string_view line, char separator) {
  if (!split_fields(line, separator, header_)) return false;
  const MappedRows::Match match = rows_.find(header_);
  const bool more_fields =
      separator != kBlanks && header_.size() > best_fields_;  // text has blanks everywhere
  if (match.found > best_found_ || (match.found == best_found_ && more_fields)) {
    best_line_ = lines_.number();
    best_found_ = match.found;
    best_fields_ = header_.size();
    refusal_ = match.refusal;
  }
  return match.found == rows_.columns().size();
}

/// "# time, angle" is a header too. Blanks separate where nothing else does.
bool MappedCsv::is_header(std::string_view line) {
  const std::string_view text = trimmed(line);
  const bool comment = !text.empty() && (text.front() == '#' || text.front() == '%');
  std::size_t ways = 0;
  for (const bool stripped : {false, true}) {
    if (stripped && (ways > 0 || !comment)) break;
    if (stripped) line = text.substr(1);
    for (const char separator : kSeparators) {
      if ((separator == kBlanks && ways > 0) || !holds_all_columns(line, separator)) continue;
      ++ways;
      separator_ = separator;
    }
  }
  if (ways == 0) return false;
  if (ways > 1) lines_.fail("the header can be read with more than one separator");
  holds_all_columns(line, separator_);  // once more, for its places
  return true;
}

/// Names above names: some of the map's stand in the row that is that of the units.
bool MappedCsv::is_two_lines(std::string_view line) {
  for (const char separator : kSeparators) {
    if (!split_fields(previous_, separator, header_) || !split_fields(line, separator, units_) ||
        header_.size() != units_.size() || header_.size() < 2)
      continue;
    if (rows_.find(header_, units_).found < rows_.columns().size()) continue;
    separator_ = separator;
    units_line_ = lines_.number();
    return true;
  }
  units_.clear();
  return false;
}

bool MappedCsv::has_numbers(const std::vector<std::string>& row, char separator) const {
  return std::all_of(rows_.columns().begin(), rows_.columns().end(), [&](const MappedColumn& column) {
    const auto element = element_of(row[column.place], std::max<std::size_t>(column.source->element, 1));
    return element && may_be_number(*element, separator != ',');
  });
}

/// The first row of a file whose columns are known by number; names may stand above it.
bool MappedCsv::is_first_row(std::string_view line) {
  for (const char separator : kSeparators) {
    if (!split_fields(line, separator, fields_)) continue;
    header_.assign(fields_.size(), "");
    if (rows_.find(header_).found < rows_.columns().size() || !has_numbers(fields_, separator)) continue;
    separator_ = separator;
    first_row_ = line;
    if (split_fields(previous_, separator, units_) && units_.size() == fields_.size()) {
      header_ = units_;
      rows_.find(header_);
    }
    units_.clear();
    return true;
  }
  return false;
}

bool MappedCsv::find_header() {
  std::string_view line;
  while (lines_.number() < kLinesToHeader && lines_.next(line)) {
    if (lines_.number() == 1) first_line_is_own_ = is_own_header(line);
    if (by_number_ && first_line_is_own_) return false;
    const bool found = by_number_ ? is_first_row(line) : is_header(line) || is_two_lines(line);
    previous_ = line;
    if (!found) continue;
    header_line_ = lines_.number();
    rows_.mark().allow_comma(separator_ != ',');
    return true;
  }
  return false;
}

void MappedCsv::refuse() const {
  if (by_number_)
    throw BadData(name_, "none of the first " + std::to_string(kLinesToHeader) +
                             " lines has numbers in all columns of `channels`");
  if (best_fields_ == 0) throw BadData(name_ + ":1", "empty, expected column names");
  lines_.fail_at(best_line_, refusal_);
}

void MappedCsv::read_row(std::string_view line) {
  if (!split_fields(line, separator_, fields_)) lines_.fail("a quote that does not enclose a field");
  // Some loggers write a separator behind the last name and none in the rows.
  std::size_t least = header_.size();
  while (!by_number_ && least > 0 && header_[least - 1].empty()) --least;
  for (const MappedColumn& column : rows_.columns()) least = std::max(least, column.place + 1);
  if (fields_.size() < least || fields_.size() > header_.size())
    lines_.fail(std::to_string(fields_.size()) + (fields_.size() == 1 ? " field" : " fields") + " in " +
                in_quotes(line) + ", expected " + std::to_string(header_.size()) +
                (by_number_ ? "" : ": " + names_in(header_)));
  if (!resolved_) {
    resolved_ = true;
    const bool units_row = !by_number_ && units_.empty() && rows_.is_units_row(fields_);
    if (units_row) units_ = fields_, units_line_ = lines_.number();
    rows_.resolve_units(units_, lines_, header_line_, units_line_);
    if (units_row) return;
  }
  std::vector<std::string> texts;
  for (const MappedColumn& column : rows_.columns()) {
    const std::string& field = fields_[column.place];
    texts.push_back(field);
    if (column.source->element == 0) continue;
    const auto element = element_of(field, column.source->element);
    if (!element)
      lines_.fail(printable(column.name) + " = " + in_quotes(field) + ": has no element " +
                  std::to_string(column.source->element));
    texts.back() = *element;
  }
  rows_.add(texts, lines_);
}

Record MappedCsv::read() {
  if (by_number_) read_row(first_row_);
  each_row(lines_, [this](std::string_view line) { read_row(line); });
  rows_.mark().finish(lines_);
  return rows_.finish();
}

}  // namespace backlash::record
