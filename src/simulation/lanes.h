// SPDX-License-Identifier: BSD-3-Clause
// Numbers of several rigs side by side, worked on at once by the vector units: eight with AVX-512, four with
// AVX2, else two. Whatever the number, the same operations in the same order, so that results do not depend
// on the processor: no fused multiply-add, which rounds once where others round twice. One rig is worked on
// by the same code with a double in their place (one_lane.h).
#pragma once

#include <type_traits>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "one_lane.h"

namespace backlash::simulation {

/// On the stack, or in a struct that says alignas(sizeof(Lanes8)): memory for other things is aligned to
/// alignof(), which g++ caps at 16 bytes without AVX, and functions compiled for AVX2 count on 32 and more.
/// No more of them than the processor works on at once: g++ makes single numbers of the comparisons of
/// others.
using Lanes2 = double __attribute__((vector_size(16)));
using Lanes4 = double __attribute__((vector_size(32)));
using Lanes8 = double __attribute__((vector_size(64)));

/// Of numbers >= 0. In a loop over the lanes compilers make a call of sqrt().
BACKLASH_LANES Lanes2 root(const Lanes2& a) {
#if defined(__SSE2__)
  return _mm_sqrt_pd(a);
#else
  return Lanes2{root(a[0]), root(a[1])};
#endif
}

BACKLASH_LANES Lanes4 root(const Lanes4& a) {
  const Lanes2 low = root(Lanes2(__builtin_shufflevector(a, a, 0, 1))),
               high = root(Lanes2(__builtin_shufflevector(a, a, 2, 3)));
  return __builtin_shufflevector(low, high, 0, 1, 2, 3);
}

BACKLASH_LANES Lanes8 root(const Lanes8& a) {
  const Lanes4 low = root(Lanes4(__builtin_shufflevector(a, a, 0, 1, 2, 3))),
               high = root(Lanes4(__builtin_shufflevector(a, a, 4, 5, 6, 7)));
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

template <typename Lanes, std::enable_if_t<(kLanesOf<Lanes> > 1), int> = 0>
BACKLASH_LANES double lane(const Lanes& a, int i) {
  return a[i];
}

template <typename Lanes, std::enable_if_t<(kLanesOf<Lanes> > 1), int> = 0>
BACKLASH_LANES void set_lane(Lanes& a, int i, double value) {
  a[i] = value;
}

/// Of numbers >= 0. By reference, as how a vector is returned depends on the processor.
template <typename Lanes>
__attribute__((noinline)) void to_power(Lanes& a, double exponent) {
  for (int i = 0; i < kLanesOf<Lanes>; ++i) a[i] = any_power(a[i], exponent);
}

template <typename Lanes, std::enable_if_t<(kLanesOf<Lanes> > 1), int> = 0>
BACKLASH_LANES Lanes any_power(const Lanes& a, double exponent) {
  Lanes r = a;
  to_power(r, exponent);
  return r;
}

/// Of one lane or more.
template <typename Real>
BACKLASH_LANES bool any_positive(const Real& a) {
  bool any = false;
  for (int i = 0; i < kLanesOf<Real>; ++i) any |= lane(a, i) > 0;
  return any;
}

}  // namespace backlash::simulation
