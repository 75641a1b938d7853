// SPDX-License-Identifier: BSD-3-Clause
// Two inertias with a spring and a damper between them, and what the frequency response says about them
// (Yumrukcal 2013, Sections 2.4 and 5.3.2; corrected forms). Motor side JM, load side JL, both seen from the
// load side of the reduction; s = j 2 pi f.
//
//   wM/T = (JL s^2 + b s + k) / (s (JL + JM) (Jp s^2 + b s + k))       (2.32) rad/s per N m
//   wL/T = (b s + k) / (s (JL + JM) (Jp s^2 + b s + k))                (2.35)
//   F_R = sqrt(k / Jp) / (2 pi),  F_AR = sqrt(k / JL) / (2 pi)         (2.33) Hz; 2 pi missing in print
//   Jp = JL JM / (JL + JM)                                             (2.34) kg m^2
//   z = b / (2 sqrt(k Jp))                                             (5.10) damping ratio
//
// With viscous friction cM, cL on both sides, Z = b + k / s, ZM = JM s + cM, ZL = JL s + cL:
//   wM/T = (ZL + Z) / (ZM ZL + Z (ZM + ZL)),   wL/T = Z / (ZM ZL + Z (ZM + ZL))
#pragma once

#include <complex>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/frequency_response.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct TwoMass {
  double motor_inertia = 0, load_inertia = 0;  // kg m^2, > 0
  double stiffness = 0;                        // N m/rad, > 0
  double damping = 0;                          // N m s/rad, of the mesh
  double motor_viscous = 0, load_viscous = 0;  // N m s/rad, against the frame

  double total_inertia() const { return motor_inertia + load_inertia; }
  double reduced_inertia() const { return motor_inertia * load_inertia / total_inertia(); }
  double resonance() const;       // Hz, F_R, of the undamped system
  double anti_resonance() const;  // Hz, F_AR, of the undamped system
  double damping_ratio() const;   // -, z
  /// Speed per torque [rad/s per N m] at `frequency` [Hz] > 0.
  std::complex<double> motor_response(double frequency) const;
  std::complex<double> load_response(double frequency) const;
};

struct Resonances {
  signal::Measured resonance, anti_resonance;  // Hz
};

/// Where |wM/T| has its maximum above and its minimum below: extrema of the cubics through 1/|H|^2 (maximum)
/// and |H|^2 (minimum) within a factor two of the extremum, weighted. To 0.15 % of the extrema, which for z
/// up to 0.2 are within 1 % of F_R and F_AR of the undamped system. Standard errors are those of the fit, at
/// least what the points' own errors give. Throws CannotIdentify where there is no such pair with three
/// points on either side of each.
Resonances find_resonances(const FrequencyResponse& motor);

/// Inertia from 1 / (w |H|) between two frequencies [Hz], robust weighted mean, the plateau taken as it is as
/// the thesis does. Below the resonances that is off by (f/F_AR)^2 - (f/F_R)^2; above, it reads too little:
/// 40 to 60 Hz next to a resonance at 36 Hz gives half of the motor inertia. Friction c adds (c / (w J))^2
/// / 2. Throws CannotIdentify with fewer than three points in the band, InvalidParameter unless 0 <= from <
/// to.
signal::Measured inertia_plateau(const FrequencyResponse& motor, double from, double to);

/// The same with the undamped response to either side of known frequencies taken out:
///   total inertia |1 - (f/F_AR)^2| / |1 - (f/F_R)^2|,   motor inertia |1 - (F_AR/f)^2| / |1 - (F_R/f)^2|
/// times 1 / (w |H|). Total below F_AR / 2; motor above 1.5 F_R, where with z = 0.15 the damping that it
/// leaves out still makes some per cent. The standard error holds what the two halves of the band
/// differ by. Throws CannotIdentify with fewer than five points in a band.
struct InertiaPlateaus {
  signal::Measured total, motor;  // kg m^2
};
InertiaPlateaus find_inertias(const FrequencyResponse& motor, const Resonances& resonances);

/// Two inertias and two frequencies for three unknowns: which inertia is taken as measured (Table 5.1).
enum class KnownInertia {
  total_inertia,  // (a) motor inertia from the ratio of the frequencies (5.5); the thesis prefers this
  motor_inertia,  // (b) total inertia from it
  both_inertias,  // (c) ratio of the frequencies left unexplained
};

/// A row of Table 5.1.
struct StiffnessSplit {
  signal::Measured motor_inertia, load_inertia, reduced_inertia;   // kg m^2
  signal::Measured stiffness_anti_resonance, stiffness_resonance;  // N m/rad, Ks1 from F_AR and Ks2 from F_R
  signal::Measured resonance, anti_resonance;                      // Hz, F_R from Ks1 and F_AR from Ks2
};

/// Standard errors by linear propagation, inputs taken for independent. Inertias that the choice does not
/// keep are not read. Throws CannotIdentify where a needed value is not > 0, the resonance not above the
/// anti-resonance, or the total not above the motor inertia.
StiffnessSplit split_stiffness(KnownInertia known, const Resonances& measured,
                               const signal::Measured& total_inertia, const signal::Measured& motor_inertia);

/// All parameters from the whole response at once.
struct TwoMassFit {
  signal::Measured motor_inertia, load_inertia, total_inertia;  // kg m^2
  signal::Measured stiffness;                                   // N m/rad
  signal::Measured damping, damping_ratio;                      // N m s/rad, -
  signal::Measured motor_viscous, load_viscous, viscous;        // N m s/rad; `viscous` is their sum
  signal::Measured delay;                                       // s, of the speed against the torque
  signal::Measured resonance, anti_resonance;                   // Hz, of the undamped system
  double misfit = 0;  // rms of the residuals in units of their errors

  TwoMass model() const;
};

/// Least squares of ln(H / model) + j w delay, weighted with the standard errors (pooled over five
/// neighbours, at least 0.001); points that miss by more than
/// five deviations are dropped once, a tenth of all at most. Standard errors from the residuals'
/// own scatter, at least what the points' errors give, and 0.1 % of the value, which sampling and transients
/// leave however many points there are.
/// Viscous friction is what is in phase with the speed: where the speed reverses it holds Coulomb friction
/// and depends on the amplitude; of motor and load viscous the sum is known best. Throws
/// CannotIdentify where find_resonances or find_inertias do, or where the fit ends nowhere.
TwoMassFit fit_two_mass(const FrequencyResponse& motor);

}  // namespace backlash::identification
