// SPDX-License-Identifier: BSD-3-Clause
// Named test runs of a rig: what moves it and for how long, so that a procedure of a page, a node and a
// command mean the same by a name.
//
//   test_runs:                      or the name of a file beside the rig file that holds this key
//     square_wave:
//       duration: 20                # s
//       excitation: {...}           # as at the top of a rig file
//       without_load: true          # optional: the driver alone, taken out of mesh
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/simulation/excitation.h"

namespace backlash::rig_file {

struct RigFile;

struct TestRun {
  std::string name;
  double duration = 0;  // s
  simulation::ExcitationSettings excitation;
  bool without_load = false;
};

/// The runs of a rig file in their order; none without the key. Throws BadData, MissingInput.
std::vector<TestRun> read_test_runs(const YamlReader& rig_file, const model::Rig& rig);

/// BadData where an excitation, read from this map, cannot act on this rig.
void check_excitation(const YamlReader& yaml, const simulation::ExcitationSettings& excitation,
                      const model::Rig& rig);

/// The run of this name. Throws InvalidParameter with the names that there are.
const TestRun& find_test_run(const std::vector<TestRun>& runs, const std::string& name);

/// Makes the run the rig file's own simulation.
void apply_test_run(const TestRun& run, RigFile& file);

}  // namespace backlash::rig_file
