// SPDX-License-Identifier: BSD-3-Clause
// Numbers of several rigs side by side, worked on at once by the vector units. With AVX2 four at a time,
// without it two and two; either way the same operations in the same order, so that results do not depend on
// the processor: no fused multiply-add, which rounds once where others round twice.
#pragma once

#include <cmath>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace backlash::simulation {

constexpr int kLanes = 4;
/// On the stack, or in a struct that says alignas(sizeof(Lanes)): memory for other things is aligned to
/// alignof(), which g++ caps at 16 bytes without AVX, and functions compiled for AVX2 count on 32.
using Lanes = double __attribute__((vector_size(8 * kLanes)));

#define BACKLASH_LANES inline __attribute__((always_inline))

BACKLASH_LANES Lanes larger(const Lanes& a, const Lanes& b) {
  return a > b ? a : b;
}

BACKLASH_LANES Lanes smaller(const Lanes& a, const Lanes& b) {
  return a < b ? a : b;
}

BACKLASH_LANES Lanes magnitude(const Lanes& a) {
  return a < 0 ? -a : a;
}

/// Of numbers >= 0.
BACKLASH_LANES Lanes root(const Lanes& a) {
#if defined(__SSE2__)  // in a loop compilers make a call of sqrt()
  const __m128d low = _mm_sqrt_pd(__builtin_shufflevector(a, a, 0, 1));
  const __m128d high = _mm_sqrt_pd(__builtin_shufflevector(a, a, 2, 3));
  return __builtin_shufflevector(low, high, 0, 1, 2, 3);
#else
  Lanes r = a;
  for (int i = 0; i < kLanes; ++i) r[i] = std::sqrt(r[i]);
  return r;
#endif
}

}  // namespace backlash::simulation
