// SPDX-License-Identifier: BSD-3-Clause
// Running the package's Python scripts, which are installed beside its executables.
#pragma once

#include <string>
#include <vector>

namespace backlash::report {

/// Runs the script `name` beside the executable of this process with Debian's Python and waits for it; its
/// output goes where that of this process goes. Returns its exit code (128 + signal). Throws Error where the
/// script or Python is missing.
int run_script(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace backlash::report
