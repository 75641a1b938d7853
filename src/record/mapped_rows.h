// SPDX-License-Identifier: BSD-3-Clause
// Rows of a file with names and units of its own, of whatever format, as a record by a channel map.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/record/unit.h"
#include "csv_decimal.h"
#include "csv_lines.h"
#include "csv_time.h"

namespace backlash::record {

/// A column that the map reads: of the time, of a channel, or of a part of a computed one.
struct MappedColumn {
  const ColumnSource* source;
  std::string key;        // "motor_position", as in the map
  std::size_t place = 0;  // in the header
  std::string name = {};  // in the header
  bool below = false;     // the name stands in the row below
  const Unit* unit = nullptr;
};

class MappedRows {
 public:
  MappedRows(const std::string& name, const ChannelMap& map);

  /// All columns that are read; the first is the time, where it is one.
  const std::vector<MappedColumn>& columns() const { return columns_; }

  /// Looks for all columns in a header: by whole text, without its unit, or by number; `below`: names that
  /// stand in the row of units. How many were found, and why not the first that was not.
  struct Match {
    std::size_t found = 0;
    std::string refusal;
  };
  Match find(const std::vector<std::string>& header, const std::vector<std::string>& below = {});

  /// Whether a row of units stands below the header: no field that is read begins as a number.
  bool is_units_row(const std::vector<std::string>& row) const;

  /// Of the header found, the row of units below it (may be empty) and the map, which must agree. Throws
  /// BadData at `header_line` or `row_line`.
  void resolve_units(const std::vector<std::string>& units, const Place& place, std::size_t header_line,
                     std::size_t row_line);

  /// The text of each of columns(), of one row. A row with the word nan, inf or null is left out. Throws
  /// BadData.
  void add(const std::vector<std::string>& texts, const Place& place);

  DecimalMark& mark() { return mark_; }

  /// Throws BadData where there was no row.
  Record finish();

 private:
  void add_columns(const ColumnSource& source, const std::string& key);
  std::string find_column(MappedColumn& column, const std::vector<std::string>& header,
                          const std::vector<std::string>& below) const;
  const Unit* unit_of(const MappedColumn& column, std::string_view row, const Place& place,
                      std::size_t header_line, std::size_t row_line) const;
  void check_kind(const MappedColumn& column, const Place& place, std::size_t line) const;
  double read_field(const MappedColumn& column, const std::string& text, const Place& place);
  double channel_value(const ColumnSource& source, const double*& values) const;
  bool is_time(const MappedColumn& column) const { return column.source == &map_.time; }
  bool is_channel(const MappedColumn& column) const;
  bool leaves_out(const std::vector<std::string>& texts, const Place& place);

  const std::string name_;
  const ChannelMap& map_;
  Record record_;
  std::vector<MappedColumn> columns_;
  DecimalMark mark_;
  RowTimes rows_;
  std::optional<StampReader> clock_;
  std::size_t row_ = 0, left_out_ = 0;
  std::string first_left_out_;
};

/// Element of a tuple "(1, 2, 3)" or "[1 2 3]", from 1; none where it has not so many. A bare number is the
/// first of one.
std::optional<std::string> element_of(std::string_view text, std::size_t element);

/// Whether a field is a number, the word that stands for none, or a time of day.
bool may_be_number(std::string_view text, bool comma);

/// "a, b, ..." for messages, of the first columns.
std::string names_in(const std::vector<std::string>& fields);

}  // namespace backlash::record
