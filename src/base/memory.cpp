// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/memory.h"

#include <cstdlib>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace backlash {

void keep_freed_memory() {
#if defined(__GLIBC__)
  // Choices: the largest that every glibc takes, a column of an hour at 1 kHz; and what a record of that
  // length needs.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

}  // namespace backlash
