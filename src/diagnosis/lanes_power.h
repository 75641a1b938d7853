// SPDX-License-Identifier: BSD-3-Clause
// Powers of several numbers side by side in the registers of the processor: the library's pow() would take
// them one by one.
//
// Lanes are vectors of 2, 4 or 8 numbers; on the stack only: memory for a std::vector of them is aligned to
// alignof(), which g++ caps at 16 bytes without AVX, and functions compiled for AVX2 take them to lie at
// multiples of 32 or 64.
#pragma once

#include <cstdint>

#define DIAGNOSIS_LANES inline __attribute__((always_inline))

namespace backlash::diagnosis {

/// Integers of as many bits, beside Lanes: what a comparison of them gives.
template <typename Lanes>
using LaneBits = decltype(Lanes{} < Lanes{});

/// The same without signs.
template <typename Lanes>
struct NaturalLanes {
  typedef std::uint64_t Type __attribute__((vector_size(sizeof(Lanes))));  // NOLINT(modernize-use-using)
};

/// ln x of normal numbers x > 0.
///   x = 2^k m, m about 1;   ln m = 2 artanh((m - 1)/(m + 1))
template <typename Lanes>
DIAGNOSIS_LANES Lanes lanes_log(const Lanes& x) {
  using Bits = LaneBits<Lanes>;
  using Natural = typename NaturalLanes<Lanes>::Type;
  constexpr double kLn2 = 0.693147180559945309;
  constexpr double kWhole = 6755399441055744.0;            // 1.5 * 2^52: its low bits hold a whole number
  constexpr std::int64_t kWholeBits = 0x4338000000000000;  // of it
  // Casts of values: through references g++ 14 may read a vector before it is written.
  const Bits bits = reinterpret_cast<Bits>(x);
  // Split so that m lies between sqrt(1/2) and sqrt(2): 0x3fe6a09e667f3bcd are the bits of sqrt(1/2). AVX2
  // has no shift that keeps signs: 1024 keeps what is shifted above 0.
  const Natural above = reinterpret_cast<Natural>(bits) + (0x4000000000000000 - 0x3fe6a09e667f3bcd);
  const Natural shifted = above >> 52;
  const Bits k = reinterpret_cast<Bits>(shifted) - 1024;
  const Bits m_bits = bits - (k << 52), whole = k + kWholeBits;
  const Lanes m = reinterpret_cast<Lanes>(m_bits);
  const Lanes exponent = reinterpret_cast<Lanes>(whole) - kWhole;
  const Lanes s = (m - 1) / (m + 1), z = s * s;
  // Terms in pairs and pairs of pairs (Estrin), as the processor would wait for each of Horner's.
  const Lanes z2 = z * z, z4 = z2 * z2;
  const Lanes low = (1 + z * (1.0 / 3)) + z2 * (1.0 / 5 + z * (1.0 / 7)),
              high = (1.0 / 9 + z * (1.0 / 11)) + z2 * (1.0 / 13 + z * (1.0 / 15)) + z4 * (1.0 / 17);
  return exponent * kLn2 + 2 * s * (low + z4 * high);
}

/// Of 0 to 12.
constexpr double kPerFactorial[] = {
    1.0,        1.0,         1.0 / 2,      1.0 / 6,       1.0 / 24,       1.0 / 120,      1.0 / 720,
    1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600};

/// e^y for |y| < 700.
template <typename Lanes>
DIAGNOSIS_LANES Lanes lanes_exp(const Lanes& y) {
  using Bits = LaneBits<Lanes>;
  constexpr double kLn2 = 0.693147180559945309, kLn2High = 0.693147180369123816,
                   kLn2Low = 1.90821492927058770e-10;
  constexpr double kWhole = 6755399441055744.0;  // as above
  const Lanes rounded = y * (1 / kLn2) + kWhole, turns = rounded - kWhole;
  const Lanes r = y - turns * kLn2High - turns * kLn2Low;
  const Lanes r2 = r * r, r4 = r2 * r2;  // terms in pairs, as above
  const double* c = kPerFactorial;
  const Lanes low = (c[0] + r * c[1]) + r2 * (c[2] + r * c[3]),
              middle = (c[4] + r * c[5]) + r2 * (c[6] + r * c[7]),
              high = (c[8] + r * c[9]) + r2 * (c[10] + r * c[11]) + r4 * c[12];
  const Lanes power = low + r4 * (middle + r4 * high);
  const Bits scaled = reinterpret_cast<Bits>(power) + (reinterpret_cast<Bits>(rounded) << 52);
  return reinterpret_cast<Lanes>(scaled);
}

/// a^n for a >= 0, 1 <= n <= 2, to 1e-13 of the value; what is below 1e-150 counts as 0.
///   a^n = a exp((n - 1) ln a)
template <typename Lanes>
DIAGNOSIS_LANES Lanes lanes_power(const Lanes& a, double n) {
  const Lanes x = a > 1e-150 ? a : Lanes{} + 1e-150;
  const Lanes result = a * lanes_exp(Lanes((n - 1) * lanes_log(x)));
  return a > 1e-150 ? result : Lanes{};
}

}  // namespace backlash::diagnosis
