// SPDX-License-Identifier: BSD-3-Clause
#include "mapped_csv.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::record {
namespace {

constexpr char kSeparators[] = {',', ';', '\t'};
constexpr std::size_t kNamesInMessage = 40;

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

bool is_own_header(std::string_view line) {
  std::vector<std::string_view> fields;
  split(line, ',', fields);
  return std::all_of(fields.begin(), fields.end(),
                     [](std::string_view field) { return is_own_column(label_of(field).name); });
}

std::string names_in(const std::vector<std::string>& fields) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(fields.size(), kNamesInMessage); ++i)
    names.push_back(printable(fields[i]));
  return backlash::joined(names) + (fields.size() > kNamesInMessage ? ", ..." : "");
}

/// "[deg]" in a row of units is "deg".
std::string_view bare_unit(std::string_view text) {
  const Label label = label_of(text);
  return label.has_unit && label.name.empty() ? label.unit : text;
}

}  // namespace

MappedCsv::MappedCsv(std::istream& in, const std::string& name, const ChannelMap& map)
    : lines_(in, name), name_(name), map_(map) {
  record_.name = name;
  columns_.push_back({&map.time, kTimeColumn});
  for (const ColumnSource& source : map.columns) {
    columns_.push_back({&source, channel_name(source.channel)});
    columns_.back().target = &record_.column(source.channel);
  }
}

/// Empty where `header_` has the column, by its whole text or without its unit.
std::string MappedCsv::find_column(Column& column) const {
  std::size_t count = 0;
  const auto look = [&](const auto& matches) {
    for (std::size_t i = 0; i < header_.size(); ++i) {
      if (!matches(header_[i])) continue;
      column.place = i;
      column.name = header_[i];
      ++count;
    }
  };
  look([&](const std::string& text) { return text == column.source->column; });
  if (count == 0) look([&](const std::string& text) { return label_of(text).name == column.source->column; });
  if (count == 1) return "";
  return "column " + in_quotes(column.source->column) + " of channels." + column.key +
         (count == 0 ? ": not there, there are: " : ": there twice: ") + names_in(header_);
}

bool MappedCsv::holds_all_columns(std::string_view line, char separator) {
  if (!split_quoted(line, separator, header_)) return false;
  std::size_t found = 0;
  std::string refusal;
  for (Column& column : columns_) {
    const std::string problem = find_column(column);
    if (problem.empty())
      ++found;
    else if (refusal.empty())
      refusal = problem;
  }
  if (found > best_found_ || (found == best_found_ && header_.size() > best_fields_)) {
    best_line_ = lines_.number();
    best_found_ = found;
    best_fields_ = header_.size();
    refusal_ = refusal;
  }
  return found == columns_.size();
}

bool MappedCsv::find_header() {
  std::string_view line;
  while (lines_.number() < kLinesToHeader && lines_.next(line)) {
    if (lines_.number() == 1) first_line_is_own_ = is_own_header(line);
    std::string_view text = trimmed(line);
    const bool comment = !text.empty() && (text.front() == '#' || text.front() == '%');
    std::size_t ways = 0;
    for (const bool stripped : {false, true}) {  // "# time, angle" is a header too
      if (stripped && (ways > 0 || !comment)) break;
      if (stripped) line = text.substr(1);
      for (const char separator : kSeparators) {
        if (!holds_all_columns(line, separator)) continue;
        ++ways;
        separator_ = separator;
      }
    }
    if (ways == 0) continue;
    if (ways > 1) lines_.fail("the header can be read with more than one separator");
    holds_all_columns(line, separator_);  // once more, for its places
    header_line_ = lines_.number();
    mark_.allow_comma(separator_ != ',');
    return true;
  }
  return false;
}

void MappedCsv::refuse() const {
  if (best_fields_ == 0) throw BadData(name_ + ":1", "empty, expected column names");
  lines_.fail_at(best_line_, refusal_);
}

void MappedCsv::fail_unit(std::size_t line, const Column& column, std::string_view unit,
                          const std::string& reason) const {
  lines_.fail_at(line, printable(column.name) + ": unit = " + in_quotes(unit) + " of channels." + column.key +
                           ": " + reason);
}

/// Of those in the header, in the row below it and in the map, which must agree.
const Unit* MappedCsv::unit_of(const Column& column, std::string_view row) const {
  const ColumnSource& source = *column.source;
  const Unit* unit = source.unit.empty() ? nullptr : find_unit(source.unit);
  const Label label = label_of(column.name);
  const std::string_view header = label.has_unit ? label.unit : std::string_view();
  for (const std::string_view text : {header, row}) {
    const Unit* const here = find_unit(text);
    const std::size_t line = text == header ? header_line_ : lines_.number();
    // Where the map says the unit, brackets in the header may hold anything else: "Speed (filtered)".
    if (text.empty() || (here == nullptr && unit != nullptr)) continue;
    if (here == nullptr) fail_unit(line, column, text, "unknown, known are " + known_units());
    if (unit != nullptr && !unit->same_as(*here))
      fail_unit(line, column, text, "is " + std::string(unit->name) + " elsewhere");
    unit = here;
  }
  if (unit == nullptr && !is_own_column(source.column))
    fail_unit(header_line_, column, "",
              "neither the file nor the map says it, known are " +
                  (column.target != nullptr ? known_units(source.channel, map_.linear) : known_units()));
  return unit;
}

void MappedCsv::check_kind(const Column& column, std::size_t line) const {
  const Unit& unit = *column.unit;
  std::string reason;
  if (column.target != nullptr)
    reason = misfit(unit, column.source->channel, map_.linear, column.source->scale.has_value());
  else if (unit.quantity != Quantity::time)
    reason = "is no time";
  if (!reason.empty()) fail_unit(line, column, unit.name, reason);
}

/// Of the fields that the map names none begins as a number, and one says something.
bool MappedCsv::is_units_row() const {
  bool any = false;
  for (const Column& column : columns_) {
    if (column.place >= fields_.size()) return false;
    const std::string& field = fields_[column.place];
    if (field.empty()) continue;
    const std::string_view text = bare_unit(field);
    if (find_unit(text) == nullptr && text.find_first_of("0123456789") != std::string_view::npos)
      return false;
    any = true;
  }
  return any;
}

void MappedCsv::resolve_units(bool row) {
  for (Column& column : columns_) {
    const std::string_view text = row ? bare_unit(fields_[column.place]) : std::string_view();
    column.unit = unit_of(column, text);
    if (column.unit != nullptr) check_kind(column, text.empty() ? header_line_ : lines_.number());
  }
  const Unit* const time = columns_.front().unit;
  clock_.emplace(time != nullptr ? *time : *find_unit("s"));
}

void MappedCsv::read_row(std::string_view line) {
  if (!split_quoted(line, separator_, fields_)) lines_.fail("a quote that does not enclose a field");
  if (fields_.size() != header_.size())
    lines_.fail(std::to_string(fields_.size()) + (fields_.size() == 1 ? " field" : " fields") + " in " +
                in_quotes(line) + ", expected " + std::to_string(header_.size()) + ": " + names_in(header_));
  if (!clock_) {
    const bool row = is_units_row();
    resolve_units(row);
    if (row) return;
  }
  std::vector<double> values;
  for (const Column& column : columns_) values.push_back(read_field(column));
  const Column& time = columns_.front();
  if (!rows_.accept(values.front(), time.name, fields_[time.place], lines_)) return;
  for (std::size_t i = 1; i < columns_.size(); ++i) columns_[i].target->push_back(values[i]);
}

double MappedCsv::read_field(const Column& column) {
  const std::string& field = fields_[column.place];
  const auto fail = [&](const char* reason) {
    lines_.fail(printable(column.name) + " = " + in_quotes(field) + ": " + reason);
  };
  if (field.empty()) fail("empty");
  const std::string text = mark_.with_point(field, column.name, lines_);
  const ParsedNumber number = column.target == nullptr ? clock_->read(text) : parse_number(text);
  if (!number) fail(number.problem);
  if (column.target == nullptr) return number.value;
  const double si = column.unit != nullptr ? column.unit->si(number.value) : number.value;
  const double value = column.source->scale.value_or(1) * si + column.source->offset;
  if (!std::isfinite(value)) fail("too large in SI units");
  return value;
}

Record MappedCsv::read() {
  each_row(lines_, [this](std::string_view line) { read_row(line); });
  if (rows_.times.empty()) throw BadData(name_, "no data: there are only column names");
  mark_.finish(lines_);
  record_.warnings = rows_.warnings();
  rows_.stamps().count_into(record_);
  record_.time = std::move(rows_.times);
  record_.origin = clock_->origin();
  return std::move(record_);
}

}  // namespace backlash::record
