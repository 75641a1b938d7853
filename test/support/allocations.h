// SPDX-License-Identifier: BSD-3-Clause
// Counts what is asked of the heap while an AllocationCount lives. Replaces operator new of a whole test
// binary: include it in one file of each.
#pragma once

#include <atomic>
#include <cstdlib>
#include <new>

namespace backlash::test {

inline std::atomic<bool> counting_allocations{false};
inline std::atomic<long> allocations{0};

class AllocationCount {
 public:
  AllocationCount() {
    allocations = 0;
    counting_allocations = true;
  }
  ~AllocationCount() { counting_allocations = false; }
  long stop() {
    counting_allocations = false;
    return allocations;
  }
};

inline void* counted(std::size_t size) {
  if (counting_allocations) ++allocations;
  if (void* place = std::malloc(size > 0 ? size : 1)) return place;
  throw std::bad_alloc();
}

}  // namespace backlash::test

void* operator new(std::size_t size) {
  return backlash::test::counted(size);
}
void* operator new[](std::size_t size) {
  return backlash::test::counted(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (backlash::test::counting_allocations) ++backlash::test::allocations;
  return std::malloc(size > 0 ? size : 1);
}
void operator delete(void* place) noexcept {
  std::free(place);
}
void operator delete[](void* place) noexcept {
  std::free(place);
}
void operator delete(void* place, std::size_t) noexcept {
  std::free(place);
}
void operator delete[](void* place, std::size_t) noexcept {
  std::free(place);
}
