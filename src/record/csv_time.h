// SPDX-License-Identifier: BSD-3-Clause
// The time of the rows of a CSV.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/record/unit.h"
#include "csv_lines.h"

namespace backlash::record {

/// Text of a unit of time as seconds. A stamp that counts from 1970 has more digits than a double: times are
/// then those since the first stamp, and none of its digits are lost.
class StampReader {
 public:
  explicit StampReader(const Unit& unit);

  /// `value` in s, or the `problem`.
  ParsedNumber read(std::string_view text);

  double origin() const { return origin_; }  ///< s since 1970 of time 0; 0 where times are as in the file

 private:
  struct Stamp {
    std::int64_t whole = 0;
    double part = 0;
    double value() const { return static_cast<double>(whole) + part; }
  };
  static Stamp exact(std::string_view text, double value);
  std::optional<Stamp> time_of_day(std::string_view text) const;

  const Unit& unit_;
  std::optional<Stamp> first_;
  double origin_ = 0;
};

/// Stamps that increase, row by row.
class RowTimes {
 public:
  /// False for a repeated stamp, whose row is dropped; throws BadData for one out of order.
  bool accept(double stamp, const std::string& name, std::string_view text, const Place& place);

  std::vector<double> times;
  std::vector<std::string> warnings() const;
  const StampChecker& stamps() const { return stamps_; }

 private:
  [[noreturn]] void fail_back(const std::string& name, std::string_view text, const Place& place) const;

  StampChecker stamps_;
  std::string first_repeated_;  // where
};

}  // namespace backlash::record
