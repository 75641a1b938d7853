// SPDX-License-Identifier: BSD-3-Clause
// A whole rig file: the machine, its test run and its diagnosis. The one loader for it.
#pragma once

#include <optional>
#include <string>

#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/rig_file/drive.h"
#include "backlash_diagnosis/rig_file/test_runs.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::rig_file {

struct RigFile {
  model::Rig rig;
  simulation::SimulationSettings simulation;
  diagnosis::DiagnosisSettings diagnosis;  // with the rig's elastic deflection and base radius filled in
  std::vector<TestRun> test_runs;
  std::optional<Drive> drive;
  record::ChannelMap channels;  // where a robot publishes them
  /// Standard deviation of the logarithm of the declared backlash, of the gear when new; absent: not said.
  std::optional<double> backlash_error;
  std::string source;  // path, or "built-in sarkar_1997"
  std::string text;    // as read
  std::string digest;  // 64-bit FNV-1a of the text, hexadecimal
};

/// Throws MissingInput, BadData (file, line, key, value, limit), InvalidParameter.
RigFile load_rig_file(const std::string& path);

/// The same from text; `source` stands for the path in messages.
RigFile rig_file_from_text(const std::string& text, const std::string& source);

/// Whether a file is a URDF, as it begins like XML. Throws MissingInput.
bool is_urdf(const std::string& path);

/// Whether a rig file is that of an arm: it has `urdf`. Throws MissingInput, BadData; for a URDF, too.
bool is_arm_rig(const std::string& path);

/// The rig with the machine's values of a waveform fit in place of its own: the inverse of what
/// RigFile::diagnosis.waveform was made by. Not below what half a coupling's inertia leaves; what the rig has
/// no place for (friction_speed, the sensor's gain and lag) is left out.
model::Rig with_machine(model::Rig rig, const diagnosis::WaveformSettings& machine);

/// config/sarkar_1997.yaml as it was when the library was built: what nodes use without a rig file.
RigFile default_rig_file();

}  // namespace backlash::rig_file
