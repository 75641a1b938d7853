// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a table of another program: a CSV without header, entries of JSON, an archive of NumPy, whichever
// they begin as, read by a channel map with an element, a computed channel and a number of 16 bits.
#include <cmath>
#include <fstream>
#include <sstream>
#include <string_view>

#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/channels.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/table_file.h"
#include "fuzz.h"

using namespace backlash;

namespace {

record::ChannelMap channels(const char* time, const char* a, const char* b, const char* c) {
  const std::string text = std::string("channels:\n  time: ") + time + "\n  motor_position: {column: " + a +
                           ", element: 2, unit: rad}\n  motor_torque: {product: [{column: " + b +
                           ", unit: raw, bits: 16}, {column: " + c + ", unit: V}], unit: N m}\n";
  return record::read_channels(YamlReader::from_text(text, "rig.yaml"), "joint");
}

void check(const record::Record& record) {
  fuzz::require(record.size() > 0, "a record without samples");
  for (std::size_t i = 0; i < record.size(); ++i)
    fuzz::require(std::isfinite(record.time[i]) && (i == 0 || record.time[i] > record.time[i - 1]),
                  "times that do not increase");
  for (const record::Channel channel : record::kChannels) {
    fuzz::require(!record.has(channel) || record.column(channel).size() == record.size(),
                  "columns of unequal length");
    for (const double value : record.column(channel))
      fuzz::require(std::isfinite(value), "a value that is not finite");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ScratchFolder folder;
  static const record::ChannelMap named = channels("{column: t, unit: s}", "q", "duty", "supply"),
                                  numbered = channels("{rate: 100}", "1", "2", "3");
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (text.compare(0, 2, "PK") == 0) {
    const std::string path = folder.path("run.npz");
    std::remove(path.c_str());
    std::ofstream(path, std::ios::binary) << text;
    fuzz::read_or_refuse(path, [&] { check(record::read_table(path, named)); });
  } else if (!text.empty() && (text[0] == '{' || text[0] == '[')) {
    fuzz::read_or_refuse("fuzz.json", [&] { check(record::read_json(text, "fuzz.json", named)); });
  } else {
    fuzz::read_or_refuse("fuzz.csv", [&] {
      std::istringstream in(text);
      check(record::read_csv(in, "fuzz.csv", numbered, ""));
    });
    fuzz::read_or_refuse("fuzz.csv", [&] {
      std::istringstream in(text);
      check(record::read_csv(in, "fuzz.csv", named, ""));
    });
  }
  return 0;
}
