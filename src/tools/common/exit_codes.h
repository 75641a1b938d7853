// SPDX-License-Identifier: BSD-3-Clause
// How the commands end: the verdict, or after sysexits.h what went wrong.
#pragma once

namespace backlash::tools {

enum ExitCode {
  kHealthy = 0,       // or done
  kWatch = 1,         // worn, not yet a fault
  kFault = 2,         // service or stop
  kInconclusive = 3,  // cannot tell
  kUsage = 64,
  kBadData = 65,
  kMissingInput = 66,
  kInternal = 70,
  kCannotWrite = 73,
};

}  // namespace backlash::tools
