// SPDX-License-Identifier: BSD-3-Clause
// A CSV with names and units of its own, read by a channel map.
#pragma once

#include <cstddef>
#include <iosfwd>
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

class MappedCsv {
 public:
  MappedCsv(std::istream& in, const std::string& name, const ChannelMap& map);

  /// Whether one of the first lines has all columns of the map; the rows follow.
  bool find_header();

  /// After find_header() without success: whether the file begins as one in the package's own format, else
  /// the BadData that says which column lacks.
  bool first_line_is_own() const { return first_line_is_own_; }
  [[noreturn]] void refuse() const;

  /// After find_header(). Throws BadData.
  Record read();

 private:
  struct Column {
    const ColumnSource* source;
    std::string key;  // "motor_position", as in the map
    std::size_t place = 0;
    std::string name = {};  // in the header
    const Unit* unit = nullptr;
    std::vector<double>* target = nullptr;  // of the time: none
  };

  bool holds_all_columns(std::string_view line, char separator);
  std::string find_column(Column& column) const;
  bool is_units_row() const;
  void resolve_units(bool row);
  const Unit* unit_of(const Column& column, std::string_view row) const;
  void check_kind(const Column& column, std::size_t line) const;
  void read_row(std::string_view line);
  double read_field(const Column& column);
  [[noreturn]] void fail_unit(std::size_t line, const Column& column, std::string_view unit,
                              const std::string& reason) const;

  LineReader lines_;
  const std::string name_;
  const ChannelMap& map_;
  Record record_;
  std::vector<Column> columns_;  // the first is the time
  char separator_ = ',';
  std::vector<std::string> header_, fields_;
  std::size_t header_line_ = 0;
  DecimalMark mark_;
  RowTimes rows_;
  std::optional<StampReader> clock_;

  // The line that looked most like the header.
  bool first_line_is_own_ = false;
  std::size_t best_line_ = 1, best_found_ = 0, best_fields_ = 0;
  std::string refusal_;
};

}  // namespace backlash::record
