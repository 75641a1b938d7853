// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a rig file.
#include <cmath>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "fuzz.h"

using namespace backlash;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (text.find("test_runs") != std::string::npos) return 0;  // may name a file: none of ours to open
  fuzz::read_or_refuse("fuzz.yaml", [&] {
    const rig_file::RigFile file = rig_file::rig_file_from_text(text, "fuzz.yaml");
    fuzz::require(file.simulation.sensors.sampling_rate > 0, "a sampling rate that is not positive");
    fuzz::require(file.rig.motor.inertia > 0 && std::isfinite(file.rig.motor.inertia),
                  "a motor without inertia");
    fuzz::require(file.rig.mesh.backlash >= 0, "a negative backlash");
  });
  return 0;
}
