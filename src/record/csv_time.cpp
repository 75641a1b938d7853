// SPDX-License-Identifier: BSD-3-Clause
#include "csv_time.h"

#include <charconv>
#include <cmath>

#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

constexpr double kSince1970 = 1e9;    // s: the year 2001; no clock of a machine has counted so long from 0
constexpr double kLargestInt = 9e18;  // below 2^63

std::optional<std::int64_t> integer(std::string_view text) {
  std::int64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Two digits of a clock, below 60.
std::optional<std::int64_t> sixtieth(std::string_view text) {
  const auto value = text.size() == 2 && text.front() != '-' ? integer(text) : std::nullopt;
  return value && *value < 60 ? value : std::nullopt;
}

}  // namespace

StampReader::StampReader(const Unit& unit) : unit_(unit) {}

StampReader::Stamp StampReader::exact(std::string_view text, double value) {
  if (text.find_first_of("eE") != std::string_view::npos || std::fabs(value) >= kLargestInt)
    return {0, value};
  if (text.front() == '+') text.remove_prefix(1);
  const auto point = text.find('.');
  const auto whole = integer(text.substr(0, point));
  if (!whole) return {0, value};  // ".5"
  double part = 0;
  if (point != std::string_view::npos && point + 1 < text.size())
    part = parse_number("0" + std::string(text.substr(point))).value;
  return {*whole, text.front() == '-' ? -part : part};
}

/// "12:00:00.25"
std::optional<StampReader::Stamp> StampReader::time_of_day(std::string_view text) const {
  const auto first = text.find(':'), second = text.rfind(':');
  if (first == std::string_view::npos || first == second || first == 0 || first > 2) return std::nullopt;
  const auto point = std::min(text.find('.'), text.size());
  if (point < second) return std::nullopt;
  const auto hours = integer(text.substr(0, first));
  const auto minutes = sixtieth(text.substr(first + 1, second - first - 1));
  const auto seconds = sixtieth(text.substr(second + 1, point - second - 1));
  if (!hours || *hours < 0 || !minutes || !seconds) return std::nullopt;
  double part = 0;
  if (point < text.size()) {
    const ParsedNumber number = parse_number("0" + std::string(text.substr(point)));
    if (!number || text.find_first_of("eE") != std::string_view::npos) return std::nullopt;
    part = number.value;
  }
  return Stamp{(*hours * 60 + *minutes) * 60 + *seconds, part};
}

ParsedNumber StampReader::read(std::string_view text) {
  Stamp stamp;
  if (unit_.same_as(*find_unit("hh:mm:ss"))) {
    const auto time = time_of_day(text);
    if (!time) return {0, "not a time hh:mm:ss"};
    stamp = *time;
  } else {
    const ParsedNumber number = parse_number(text);
    if (!number) return number;
    stamp = exact(text, number.value);
  }
  if (!first_) {
    first_ = stamp;
    if (const double seconds = unit_.si(stamp.value()); seconds >= kSince1970) origin_ = seconds;
  }
  if (origin_ == 0) return {unit_.si(stamp.value()), nullptr};
  if (stamp.whole < 0) return {unit_.si(stamp.value()) - origin_, nullptr};
  return {unit_.si(static_cast<double>(stamp.whole - first_->whole) + (stamp.part - first_->part)), nullptr};
}

bool RowTimes::accept(double stamp, const std::string& name, std::string_view text, const Place& place) {
  switch (stamps_.next(stamp)) {
    case StampVerdict::accept:
      break;
    case StampVerdict::repeated:
      if (first_repeated_.empty()) first_repeated_ = place.text(place.number());
      return false;
    case StampVerdict::backwards:
      if (!stamps_.resume(stamp)) fail_back(name, text, place);
  }
  times.push_back(stamp + stamps_.offset());
  return true;
}

void RowTimes::fail_back(const std::string& name, std::string_view text, const Place& place) const {
  place.fail(printable(name) + " = " + in_quotes(text) + ": goes back, the row before has " +
             to_text(stamps_.last() - stamps_.offset()) + " s: give what follows as a file of its own");
}

std::vector<std::string> RowTimes::warnings() const {
  std::vector<std::string> warnings;
  const std::string repeated = stamps_.describe(first_repeated_);
  if (!repeated.empty()) warnings.push_back(repeated);
  for (std::string& warning : describe_time_base(times)) warnings.push_back(std::move(warning));
  return warnings;
}

}  // namespace backlash::record
