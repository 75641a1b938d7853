// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backlash::change_study {

/// Prints false alarms and delays over so many healthy windows.
void study_windows(long windows, unsigned long seed);

}  // namespace backlash::change_study
