// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a CSV record.
#include <cmath>
#include <sstream>

#include "backlash_diagnosis/record/csv.h"
#include "fuzz.h"

using namespace backlash;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::read_or_refuse("fuzz.csv", [&] {
    std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
    const record::Record record = record::read_csv(in, "fuzz.csv");
    fuzz::require(record.size() > 0 && record.can_show_backlash(), "a record without any such channel");
    for (std::size_t i = 0; i < record.size(); ++i)
      fuzz::require(std::isfinite(record.time[i]) && (i == 0 || record.time[i] > record.time[i - 1]),
                    "times that do not increase");
    for (const record::Channel channel : record::kChannels) {
      if (!record.has(channel)) continue;
      fuzz::require(record.column(channel).size() == record.size(), "columns of unequal length");
      for (const double value : record.column(channel))
        fuzz::require(std::isfinite(value), "a value that is not finite");
    }
    fuzz::require(record.size() < 2 || record.sampling_interval() > 0, "an interval that is not positive");
  });
  return 0;
}
