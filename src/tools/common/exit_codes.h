// SPDX-License-Identifier: BSD-3-Clause
// How the commands end: the verdict, or after sysexits.h what went wrong.
#pragma once

#include "backlash_diagnosis/diagnosis/verdict.h"

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

inline int exit_code(diagnosis::Grade grade) {
  switch (grade) {
    case diagnosis::Grade::good:
    case diagnosis::Grade::ungraded:
      return kHealthy;
    case diagnosis::Grade::watch:
      return kWatch;
    case diagnosis::Grade::service:
    case diagnosis::Grade::stop:
      return kFault;
    case diagnosis::Grade::cannot_tell:
      break;
  }
  return kInconclusive;
}

}  // namespace backlash::tools
