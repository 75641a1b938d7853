// SPDX-License-Identifier: BSD-3-Clause
// What a program does with memory that it has freed.
#pragma once

namespace backlash {

/// Keeps freed memory for the next use. A command handles columns of megabytes, a copy of them after the
/// other; the C library gives such memory back each time and gets it again page by page, which may take as
/// long as the work on it. For programs that end soon; does nothing where the C library has no such setting.
void keep_freed_memory();

}  // namespace backlash
