// SPDX-License-Identifier: BSD-3-Clause
// The values of a machine as its rig file declares them, and how each is known, for people to read.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::rig_file {

struct DeclaredValue {
  std::string name;         ///< "motor.inertia": its key below gear_train; "commissioned.sensor_gain"
  double value = 0;         ///< as the file says it, or what holds where it says nothing
  std::string unit;         ///< of a value that `waveform` fits, else of the file's comment; empty: none
  std::string uncertainty;  ///< "30 %", "0.0005 N m", "15 %, by default"; empty: taken as exact, or not known
  std::string source;  ///< what the file says of it: its `source`, or the comment of its line behind the unit
  int quantity = -1;   ///< place in diagnosis::waveform_quantities() where `waveform` fits it
  double share = 0;    ///< of its coupling, in the unit, which `waveform` counts with it
};

/// Numbers of the sections gear_train and commissioned in the order of the file, then what `waveform` takes
/// where the file says nothing.
std::vector<DeclaredValue> declared_values(const RigFile& file);

}  // namespace backlash::rig_file
