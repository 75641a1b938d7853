// SPDX-License-Identifier: BSD-3-Clause
#include "mapped_rows.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

constexpr std::size_t kNamesInMessage = 40;

/// "[deg]" in a row of units is "deg".
std::string_view bare_unit(std::string_view text) {
  const Label label = label_of(text);
  return label.has_unit && label.name.empty() ? label.unit : text;
}

/// The place that a number as the name of a column says, from 0.
std::optional<std::size_t> place_by_number(const std::string& column, std::size_t columns) {
  std::size_t number = 0;
  const auto result = std::from_chars(column.data(), column.data() + column.size(), number);
  if (result.ec != std::errc() || result.ptr != column.data() + column.size() || number < 1 ||
      number > columns)
    return std::nullopt;
  return number - 1;
}

}  // namespace

std::string names_in(const std::vector<std::string>& fields) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(fields.size(), kNamesInMessage); ++i)
    names.push_back(printable(fields[i]));
  return backlash::joined(names) + (fields.size() > kNamesInMessage ? ", ..." : "");
}

bool may_be_number(std::string_view text, bool comma) {
  if (is_no_number(text)) return true;
  std::string plain(text);
  if (comma) std::replace(plain.begin(), plain.end(), ',', '.');
  return static_cast<bool>(parse_number(plain)) ||
         (text.find(':') != std::string_view::npos &&
          text.find_first_not_of("0123456789:.") == std::string_view::npos);
}

std::optional<std::string> element_of(std::string_view text, std::size_t element) {
  text = trimmed(text);
  const bool tuple = text.size() > 1 && ((text.front() == '(' && text.back() == ')') ||
                                         (text.front() == '[' && text.back() == ']'));
  if (!tuple) return element == 1 ? std::optional<std::string>(text) : std::nullopt;
  text = text.substr(1, text.size() - 2);
  const bool commas = text.find_first_of(",;") != std::string_view::npos;
  const char* const separators = commas ? ",;" : " \t";
  for (std::size_t i = 1;; ++i) {
    if (!commas) text = trimmed(text);
    const auto end = text.find_first_of(separators);
    if (i == element) return std::string(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return std::nullopt;
    text.remove_prefix(end + 1);
  }
}

MappedRows::MappedRows(const std::string& name, const ChannelMap& map) : name_(name), map_(map) {
  record_.name = name;
  if (map.rate == 0) add_columns(map.time, kTimeColumn);
  for (const ColumnSource& source : map.columns) add_columns(source, channel_name(source.channel));
}

void MappedRows::add_columns(const ColumnSource& source, const std::string& key) {
  if (!source.is_computed()) columns_.push_back({&source, key});
  for (const std::vector<ColumnSource>* parts : {&source.sum, &source.product})
    for (const ColumnSource& part : *parts) add_columns(part, key);
}

bool MappedRows::is_channel(const MappedColumn& column) const {
  return std::any_of(map_.columns.begin(), map_.columns.end(),
                     [&](const ColumnSource& source) { return column.source == &source; });
}

/// Empty where the header has the column.
std::string MappedRows::find_column(MappedColumn& column, const std::vector<std::string>& header,
                                    const std::vector<std::string>& below) const {
  const std::string& wanted = column.source->column;
  std::size_t count = 0;
  const auto look = [&](const std::vector<std::string>& names, bool whole) {
    if (count > 0) return;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if ((whole ? std::string_view(names[i]) : label_of(names[i]).name) != wanted) continue;
      column.place = i;
      column.name = names[i];
      column.below = &names == &below;
      ++count;
    }
  };
  for (const bool whole : {true, false})
    for (const std::vector<std::string>* names : {&header, &below}) look(*names, whole);
  if (count == 0)
    if (const auto place = place_by_number(wanted, header.size())) {
      column.place = *place;
      column.name = header[*place].empty() ? "column " + wanted : header[*place];
      column.below = false;
      count = 1;
    }
  if (count == 1) return "";
  return "column " + in_quotes(wanted) + " of channels." + column.key +
         (count == 0 ? ": not there, there are: " : ": there twice (a number, from 1, says which): ") +
         names_in(header) + (below.empty() ? "" : ", " + names_in(below));
}

MappedRows::Match MappedRows::find(const std::vector<std::string>& header,
                                   const std::vector<std::string>& below) {
  Match match;
  for (MappedColumn& column : columns_) {
    const std::string problem = find_column(column, header, below);
    if (problem.empty())
      ++match.found;
    else if (match.refusal.empty())
      match.refusal = problem;
  }
  return match;
}

bool MappedRows::is_units_row(const std::vector<std::string>& row) const {
  bool any = false;
  for (const MappedColumn& column : columns_) {
    if (column.place >= row.size()) return false;
    const std::string& field = row[column.place];
    if (field.empty()) continue;
    const std::string_view text = bare_unit(field);
    if (is_no_number(text) ||
        (find_unit(text) == nullptr && text.find_first_of("0123456789") != std::string_view::npos))
      return false;
    any = true;
  }
  return any;
}

namespace {

[[noreturn]] void fail_unit(const Place& place, std::size_t line, const MappedColumn& column,
                            std::string_view unit, const std::string& reason) {
  place.fail_at(line, printable(column.name) + ": unit = " + in_quotes(unit) + " of channels." + column.key +
                          ": " + reason);
}

}  // namespace

const Unit* MappedRows::unit_of(const MappedColumn& column, std::string_view row, const Place& place,
                                std::size_t header_line, std::size_t row_line) const {
  const ColumnSource& source = *column.source;
  const Unit* unit = source.unit.empty() ? nullptr : find_unit(source.unit);
  const Label label = label_of(column.name);
  const std::string_view header = label.has_unit ? label.unit : std::string_view();
  // The numbers of one field have units of their own: the header's is that of the first.
  const bool own_unit = source.element > 1 && unit != nullptr;
  for (const std::string_view text : {header, row}) {
    const Unit* const here = find_unit(text);
    const std::size_t line = text == header ? header_line : row_line;
    // Where the map says the unit, brackets in the header may hold anything else: "Speed (filtered)".
    if (text.empty() || own_unit || (here == nullptr && unit != nullptr)) continue;
    if (here == nullptr) fail_unit(place, line, column, text, "unknown, known are " + known_units());
    if (unit != nullptr && !unit->same_as(*here) && here->quantity != Quantity::raw)
      fail_unit(place, line, column, text, "is " + std::string(unit->name) + " elsewhere");
    unit = here;
  }
  if (unit == nullptr && !is_own_column(source.column))
    fail_unit(place, header_line, column, "",
              "neither the file nor the map says it, known are " +
                  (is_channel(column) ? known_units(source.channel, map_.linear) : known_units()));
  return unit;
}

void MappedRows::check_kind(const MappedColumn& column, const Place& place, std::size_t line) const {
  const Unit& unit = *column.unit;
  std::string reason;
  if (is_channel(column))
    reason = misfit(unit, column.source->channel, map_.linear, column.source->scale.has_value());
  else if (is_time(column) && unit.quantity != Quantity::time)
    reason = "is no time";
  if (!reason.empty()) fail_unit(place, line, column, unit.name, reason);
}

void MappedRows::resolve_units(const std::vector<std::string>& units, const Place& place,
                               std::size_t header_line, std::size_t row_line) {
  for (MappedColumn& column : columns_) {
    const bool has = column.place < units.size() && !column.below;
    const std::string_view text = has ? bare_unit(units[column.place]) : std::string_view();
    column.unit = unit_of(column, text, place, header_line, row_line);
    if (column.unit != nullptr) check_kind(column, place, text.empty() ? header_line : row_line);
  }
  if (map_.rate != 0) return;
  const Unit* const time = columns_.front().unit;
  clock_.emplace(time != nullptr ? *time : *find_unit("s"));
}

double MappedRows::read_field(const MappedColumn& column, const std::string& field, const Place& place) {
  const auto fail = [&](const std::string& reason) {
    place.fail(printable(column.name) + " = " + in_quotes(field) + ": " + reason);
  };
  const std::string text = mark_.with_point(field, column.name, place);
  const ParsedNumber number = is_time(column) ? clock_->read(text) : parse_number(text);
  if (!number)
    fail(field.front() == '(' || field.front() == '['
             ? "several numbers: `element` of channels." + column.key + " says which, from 1"
             : number.problem);
  if (is_time(column)) return number.value;
  const ColumnSource& source = *column.source;
  double value = number.value;
  if (source.bits > 0) {
    const double half = std::ldexp(1.0, source.bits - 1);
    if (value != std::floor(value) || value < -half || value >= 2 * half)
      fail("no whole number of " + std::to_string(source.bits) + " bits");
    if (value >= half) value -= 2 * half;
  }
  value =
      source.scale.value_or(1) * (column.unit != nullptr ? column.unit->si(value) : value) + source.offset;
  if (!std::isfinite(value)) fail("too large in SI units");
  return value;
}

/// channel = scale * (column or sum or product, in SI) + offset; takes its columns' values from `values`.
double MappedRows::channel_value(const ColumnSource& source, const double*& values) const {
  if (!source.is_computed()) return *values++;
  double result = source.sum.empty() ? 1 : 0;
  for (const ColumnSource& part : source.sum) result += channel_value(part, values);
  for (const ColumnSource& part : source.product) result *= channel_value(part, values);
  const Unit* const unit = find_unit(source.unit);
  return source.scale.value_or(1) * (unit != nullptr ? unit->si(result) : result) + source.offset;
}

bool MappedRows::leaves_out(const std::vector<std::string>& texts, const Place& place) {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (!is_no_number(texts[i])) continue;
    if (left_out_++ == 0)
      first_left_out_ =
          printable(columns_[i].name) + " = " + in_quotes(texts[i]) + ", in " + place.text(place.number());
    return true;
  }
  return false;
}

void MappedRows::add(const std::vector<std::string>& texts, const Place& place) {
  const std::size_t row = row_++;
  if (leaves_out(texts, place)) return;
  std::vector<double> values;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    values.push_back(read_field(columns_[i], texts[i], place));
  std::array<double, kChannelCount> channels = {};
  const double* next = values.data() + (map_.rate == 0 ? 1 : 0);
  for (const ColumnSource& source : map_.columns) {
    double& value = channels[static_cast<std::size_t>(source.channel)];
    value = channel_value(source, next);
    if (!std::isfinite(value))
      place.fail("channels." + channel_name(source.channel) + ": too large in SI units");
  }
  if (map_.rate != 0)
    rows_.times.push_back(static_cast<double>(row) / map_.rate);
  else if (!rows_.accept(values.front(), columns_.front().name, texts.front(), place))
    return;
  for (const ColumnSource& source : map_.columns)
    record_.column(source.channel).push_back(channels[static_cast<std::size_t>(source.channel)]);
}

Record MappedRows::finish() {
  if (rows_.times.empty())
    throw BadData(name_, left_out_ > 0 ? "no row has a number in all columns: " + first_left_out_
                                       : "no data: there are only column names");
  record_.warnings = rows_.warnings();
  if (left_out_ > 0)
    record_.warnings.push_back(
        std::to_string(left_out_) + (left_out_ == 1 ? " row has" : " rows have") +
        " no number in a column that is read and are left out; the first: " + first_left_out_);
  record_.time = std::move(rows_.times);
  rows_.stamps().count_into(record_);
  if (clock_) record_.origin = clock_->origin();
  return std::move(record_);
}

}  // namespace backlash::record
