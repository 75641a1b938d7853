// SPDX-License-Identifier: BSD-3-Clause
// Where within an integration step a quantity passes 0, from a cubic through both ends of the step.
#pragma once

#define DIAGNOSIS_IN_LINE inline __attribute__((always_inline))

namespace backlash::signal {

/// `share` limited to [0, 1]; NaN gives 0. T: double, or a vector of doubles (lanes).
template <typename T>
DIAGNOSIS_IN_LINE T share_within(const T& share) {
  const T not_less = share > 0 ? share : T{};
  return not_less < 1 ? not_less : T{} + 1;
}

/// The share u of the step at which
///   f(u) = begin + u first + u^2 second + u^3 third,   begin <= 0 < begin + chord = f(1)
/// is 0, by Newton's method from the chord's root. Where f is flat the slope of the chord is used. Always in
/// [0, 1].
template <typename T>
DIAGNOSIS_IN_LINE T root_in_step(const T& begin, const T& chord, const T& first, const T& second,
                                 const T& third) {
  constexpr int kIterations = 4;  // choice, two would do
  constexpr double kFlat = 0.1;   // slope over that of the chord: choice
  T u = share_within<T>(-begin / chord);
  for (int i = 0; i < kIterations; ++i) {
    const T there = begin + u * (first + u * (second + u * third)),
            slope = first + u * (2 * second + 3 * u * third);
    const T taken = slope > kFlat * chord ? slope : chord;
    u = share_within<T>(u - there / taken);
  }
  return u;
}

/// The same for the cubic from `begin` to `end` with the slopes `first` and `last` [per step] at its ends.
template <typename T>
DIAGNOSIS_IN_LINE T root_by_slopes(const T& begin, const T& end, const T& first, const T& last) {
  const T chord = end - begin;
  return root_in_step<T>(begin, chord, first, 3 * chord - 2 * first - last, first + last - 2 * chord);
}

/// The same for the parabola through `begin`, `middle` (half a step) and `end`.
template <typename T>
DIAGNOSIS_IN_LINE T root_by_middle(const T& begin, const T& middle, const T& end) {
  const T chord = end - begin, first = 4 * middle - 3 * begin - end;
  return root_in_step<T>(begin, chord, first, chord - first, T{});
}

}  // namespace backlash::signal
