// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a CSV record, in the package's own format and as one that a channel map reads.
#include <cmath>
#include <sstream>

#include "backlash_diagnosis/record/csv.h"
#include "fuzz.h"

using namespace backlash;

namespace {

void check_record(const record::Record& record) {
  fuzz::require(record.size() > 0 && record.can_show_backlash(), "a record without any such channel");
  for (std::size_t i = 0; i < record.size(); ++i)
    fuzz::require(std::isfinite(record.time[i]) && (i == 0 || record.time[i] > record.time[i - 1]),
                  "times that do not increase");
  for (const record::Channel channel : record::kChannels) {
    if (!record.has(channel)) continue;
    fuzz::require(record.column(channel).size() == record.size(), "columns of unequal length");
    for (const double value : record.column(channel)) fuzz::require(!std::isinf(value), "an infinite value");
  }
  fuzz::require(record.size() < 2 || record.sampling_interval() > 0, "an interval that is not positive");
}

/// Those of the seeds: with its unit in the header or below it, and with one of its own.
record::ChannelMap bench() {
  record::ChannelMap map;
  map.time.column = "t";
  map.columns.resize(2);
  map.columns[0].channel = record::Channel::motor_position;
  map.columns[0].column = "phi";
  map.columns[1].channel = record::Channel::motor_torque;
  map.columns[1].column = "Iq";
  map.columns[1].unit = "mA";
  map.columns[1].scale = -2;
  return map;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::read_or_refuse("fuzz.csv", [&] {
    std::istringstream in(text);
    check_record(record::read_csv(in, "fuzz.csv"));
  });
  fuzz::read_or_refuse("fuzz.csv", [&] {
    std::istringstream in(text);
    check_record(record::read_csv(in, "fuzz.csv", bench(), ""));
  });
  return 0;
}
