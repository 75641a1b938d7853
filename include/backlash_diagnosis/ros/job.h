// SPDX-License-Identifier: BSD-3-Clause
// Long work beside a node: an offline command as a process of its own, so that whatever it does, the node
// goes on. It runs at the lowest priority and with bounded memory, ends with the node, and is the first that
// the kernel ends where memory is short.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash {
class ScratchFolder;
}  // namespace backlash

namespace backlash::ros_bridge {

/// Memory that a job may hold [GB]; a choice: many times what a search of ten minutes of records needs.
constexpr double kJobMemory = 4;

/// The command did not end as it should: its last words, or the signal that ended it.
class JobFailed : public Error {
 public:
  using Error::Error;
};

struct Job {
  std::vector<std::string> words;  // path of the program and its arguments
  std::vector<int> done = {0};     // exit codes that are no failure
  double memory = kJobMemory;      // GB, > 0
  Progress progress;               // asked ten times a second at least, from the thread that waits
  BestSoFar best_so_far;           // may be empty, as `progress`
};

/// Runs a job and waits for it. The program reports its progress as the option --feedback of the offline
/// commands does: {"fraction":0.5,"phase":"...","best":"..."} on each line of its standard output; other
/// lines are passed over. Throws JobFailed; Cancelled within a second after `progress` wants no more.
void run_job(const Job& job);

/// Path of an offline command: beside this program. Throws MissingInput.
std::string command_path(const std::string& name);

/// A file with the text of a rig file: its own, while that is as it was read, else one in `scratch`.
std::string file_of(const rig_file::RigFile& rig, const ScratchFolder& scratch);

}  // namespace backlash::ros_bridge
