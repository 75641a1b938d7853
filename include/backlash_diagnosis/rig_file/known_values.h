// SPDX-License-Identifier: BSD-3-Clause
// How well the values of a gear train are known, in its rig file:
//
//   viscous_damping: {value: 0.0048, uncertainty: 30 %, source: data sheet}
//
// one standard deviation, relative or in the unit of the value. A relative one is that of the logarithm. What
// a commissioning found beyond the keys of gear_train stands in a section of its own:
//
//   commissioned:
//     common_scale: {value: 1, uncertainty: 6.1 %}   factor that all values of diagnosis/waveform.h's
//     symmetry share sensor_gain: {value: 1.012, uncertainty: 0.2 %} sensor_delay, sensor_time_constant (s),
//     friction_speed (rad/s): the same
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_document.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::rig_file {

/// Puts what the file says of uncertainties into the settings of its diagnosis, and of the backlash into
/// RigFile::backlash_error. Throws BadData.
void read_known_values(const YamlReader& yaml, RigFile& file);

/// The rig file with the values of a commissioned machine in place of its own; what the records do not
/// determine stays as it is. `source` says what they were identified from. Throws BadData, CannotIdentify.
std::string commissioned_text(const RigFile& file, const diagnosis::WaveformCommissioning& found,
                              const std::string& source);

/// Puts into a document of two inertias what its fit left of motor minus load position, rms beyond noise
/// [rad]: GapTraverseSettings::unexplained. `source` says what it was identified from.
void set_unexplained_deflection(RigDocument& document, double rms, const std::string& source);

}  // namespace backlash::rig_file
