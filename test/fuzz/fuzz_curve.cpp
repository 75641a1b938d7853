// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a monitoring curve, a baseline and limits; a curve that is accepted survives being written and
// read.
#include "backlash_diagnosis/diagnosis/baseline.h"
#include "backlash_diagnosis/diagnosis/limits.h"
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"
#include "fuzz.h"

using namespace backlash;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto yaml = [&] { return YamlReader::from_text(text, "fuzz.yaml"); };
  fuzz::read_or_refuse("fuzz.yaml", [&] {
    const std::string written = diagnosis::MonitoringCurve::from_yaml(yaml()).to_yaml();
    try {
      const diagnosis::MonitoringCurve again =
          diagnosis::MonitoringCurve::from_yaml(YamlReader::from_text(written, "written.yaml"));
      fuzz::require(again.to_yaml() == written, "a curve that changes when it is written");
    } catch (const Error& error) {
      fuzz::broken(std::string("a curve that cannot be read back: ") + error.what());
    }
  });
  fuzz::read_or_refuse("fuzz.yaml", [&] {
    const std::string written = diagnosis::to_yaml(diagnosis::baseline_from_yaml(yaml()));
    try {
      (void)diagnosis::baseline_from_yaml(YamlReader::from_text(written, "written.yaml"));
    } catch (const Error& error) {
      fuzz::broken(std::string("a baseline that cannot be read back: ") + error.what());
    }
  });
  fuzz::read_or_refuse("fuzz.yaml", [&] { (void)diagnosis::read_limits(yaml()); });
  return 0;
}
