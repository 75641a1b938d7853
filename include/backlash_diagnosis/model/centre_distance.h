// SPDX-License-Identifier: BSD-3-Clause
// From the stop of a hinged pinion bracket to backlash and what a sensor sees of it: the appendix of
// Yumrukcal (2013), Eqs. A.1 to A.4. First order in the change, as printed; the exact play at a centre
// distance is that of gear_geometry(), which exceeds A.3 by the fraction dC / (2 C tan^2 phi) in next order
// (C: centre distance).
#pragma once

namespace backlash::model {

/// A bracket that turns the pinion about a pivot, held by a stop. Throws InvalidParameter from the functions
/// below for lengths that are not > 0 and angles outside -89 to 89 deg.
struct HingedBracket {
  double pivot_to_stop = 0;    // m, r1, to the axis of the stop
  double pivot_to_pinion = 0;  // m, r2, to the centre of the pinion
  double angle = 0;            // rad, psi, between the tangent of the mesh and the line from pivot to pinion
};

/// A.1: centre-distance change [m] for a stop moved by `stop` [m] from where there is no play.
double centre_distance_change(const HingedBracket& bracket, double stop);

/// Its inverse [m].
double stop_setting_for(const HingedBracket& bracket, double centre_distance_change);

/// A.2: play along the pitch circle [m], B = 2 dC tan(phi), for a centre-distance change [m] and the pressure
/// angle phi [rad].
double small_change_pitch_circle_backlash(double centre_distance_change, double pressure_angle);

/// A.3: the same along the line of action [m], B cos(phi) = 2 dC sin(phi).
double small_change_backlash(double centre_distance_change, double pressure_angle);

/// A.4: what one step of a position sensor [rad at the pinion's shaft, > 0] is along the pitch circle [m],
/// (N m / 2) step. Multiply by cos(phi) for the line of action. Throws InvalidParameter.
double resolution_on_pitch_circle(int teeth, double module, double step);

}  // namespace backlash::model
