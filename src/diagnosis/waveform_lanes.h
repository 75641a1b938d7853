// SPDX-License-Identifier: BSD-3-Clause
// Several machines side by side in the registers of the processor, and powers of them: the library's pow()
// would take them one by one.
#pragma once

#include <cstdint>

#include "waveform_motion.h"

#define WAVEFORM_INLINE inline __attribute__((always_inline))

namespace backlash::diagnosis {

/// On the stack only: memory for a std::vector of them is aligned to alignof(), which g++ caps at 16 bytes
/// without AVX, and functions compiled for AVX2 take them to lie at multiples of 32 or 64.
using WaveformLanes = double __attribute__((vector_size(8 * kWaveformSets)));

/// a^n for a >= 0, 1 <= n <= 2, to 1e-13 of the value; what is below 1e-150 counts as 0.
///   a = 2^k m, m about 1;   ln m = 2 artanh((m - 1)/(m + 1));   a^n = a exp((n - 1) ln a)
WAVEFORM_INLINE WaveformLanes lanes_power(const WaveformLanes& a, double n) {
  using Lanes = WaveformLanes;
  using Bits = std::int64_t __attribute__((vector_size(8 * kWaveformSets)));
  constexpr double kLn2 = 0.693147180559945309, kLn2High = 0.693147180369123816,
                   kLn2Low = 1.90821492927058770e-10;
  constexpr double kWhole = 6755399441055744.0;            // 1.5 * 2^52: its low bits hold a whole number
  constexpr std::int64_t kWholeBits = 0x4338000000000000;  // of it
  const Lanes x = a > 1e-150 ? a : Lanes{} + 1e-150;
  // Casts of values: through references g++ 14 may read a vector before it is written.
  const Bits bits = reinterpret_cast<Bits>(x);
  // Split so that m lies between sqrt(1/2) and sqrt(2): 0x3fe6a09e667f3bcd are the bits of sqrt(1/2).
  const Bits k = (bits - 0x3fe6a09e667f3bcd) >> 52;
  const Bits m_bits = bits - (k << 52), whole = k + kWholeBits;
  const Lanes m = reinterpret_cast<Lanes>(m_bits);
  const Lanes exponent = reinterpret_cast<Lanes>(whole) - kWhole;
  const Lanes s = (m - 1) / (m + 1), z = s * s;
  Lanes sum = Lanes{} + 1.0 / 17;
  for (const double odd : {15, 13, 11, 9, 7, 5, 3, 1}) sum = sum * z + 1 / odd;
  const Lanes log = exponent * kLn2 + 2 * s * sum;

  const Lanes y = (n - 1) * log, rounded = y * (1 / kLn2) + kWhole, turns = rounded - kWhole;
  const Lanes r = y - turns * kLn2High - turns * kLn2Low;
  Lanes power = Lanes{} + 1;
  for (const double i : {12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1}) power = power * r * (1 / i) + 1;
  const Bits scaled = reinterpret_cast<Bits>(power) + (reinterpret_cast<Bits>(rounded) << 52);
  const Lanes result = a * reinterpret_cast<Lanes>(scaled);
  return a > 1e-150 ? result : Lanes{};
}

}  // namespace backlash::diagnosis
