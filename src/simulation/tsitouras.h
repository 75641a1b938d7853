// SPDX-License-Identifier: BSD-3-Clause
// The explicit Runge-Kutta pair 5(4) of Tsitouras (2011), "Runge-Kutta pairs of order 5(4) satisfying only
// the first column simplifying assumption", Computers & Mathematics with Applications 62:770-775, Table 1 and
// its interpolant. First same as last: the seventh stage is the derivative at the end of the step, and has a
// weight in the error.
#pragma once

namespace backlash::simulation::tsitouras {

constexpr int kStages = 7;

constexpr double kC[kStages] = {0, 0.161, 0.327, 0.9, 0.9800255409045097, 1, 1};

/// The last row are the weights of the solution.
constexpr double kA[kStages][kStages] = {
    {},
    {0.161},
    {-0.008480655492356989, 0.335480655492357},
    {2.8971530571054935, -6.359448489975075, 4.3622954328695815},
    {5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525},
    {5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383},
    {0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081,
     2.324710524099774}};

/// Of the difference between the solution and that of order 4.
constexpr double kError[kStages] = {-0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995,
                                    -0.1447110071732629,     0.5823571654525552,     -0.45808210592918697,
                                    0.015151515151515152};

/// Weights of the solution at a share u of the step, 0 <= u <= 1, order 4.
template <typename Real>
__attribute__((always_inline)) inline void interpolant(const Real& u, Real* weights) {
  const Real uu = u * u;
  weights[0] =
      -1.0530884977290216 * u * (u - 1.3299890189751412) * (uu - 1.4364028541716351 * u + 0.7139816917074209);
  weights[1] = 0.1017 * uu * (uu - 2.1966568338249754 * u + 1.2949852507374631);
  weights[2] = 2.490627285651252793 * uu * (uu - 2.38535645472061657 * u + 1.57803468208092486);
  weights[3] = -16.54810288924490272 * (u - 1.21712927295533244) * (u - 0.61620406037800089) * uu;
  weights[4] = 47.37952196281928122 * (u - 1.203071208372362603) * (u - 0.658047292653547382) * uu;
  weights[5] = -34.87065786149660974 * (u - 1.2) * (u - 0.666666666666666667) * uu;
  weights[6] = 2.5 * (u - 1) * (u - 0.6) * uu;
}

}  // namespace backlash::simulation::tsitouras
