// SPDX-License-Identifier: BSD-3-Clause
// One tooth between two flanks: the smallest machine with backlash, and one with closed forms to judge an
// integrator by.
//
//   m x'' = P - F(x, x') + F(-x - gap, -x')      F(d, d') = K d^n (1 + 3/2 alpha d') for d > 0, else 0
//
// x [m] is the penetration of the forward flank (negative: apart), P >= 0 [N] presses the tooth into it.
// Contact is that of Hunt and Crossley (Sarkar, Ellis and Moore 1997, Eqs. 10 and 11).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::studies {

/// What a tooth is and how it starts: `distance` before the forward flank, moving towards it with `speed`.
struct Tooth {
  std::string name;
  double mass;                        // kg, > 0
  double stiffness, exponent, alpha;  // N/m^n > 0; 1 <= n <= 1.5; s/m >= 0
  double gap;                         // m, free travel between the flanks, >= distance
  double force;                       // N, >= 0
  double distance;                    // m, > 0
  double speed;                       // m/s, >= 0; not 0 where the force is 0
  double duration;                    // s
  double loose, tight;                // relative tolerances to be drawn

  double impact_speed() const;  // of the first touch [m/s], from the energy
  double depth() const;         // of the first penetration without damping and force [m]
  double start_energy() const;  // J, kinetic and that of the force down to the forward flank
};

/// Throws BadData.
Tooth read_tooth(const YamlReader& yaml);

/// How a solver's relative tolerance becomes its absolute ones.
enum class AbsoluteTolerance {
  scaled,  // times the tooth's depth [m] and impact speed [m/s]: the same demand on all states
  plain,   // the same number in m and in m/s, as a code with one tolerance for all states takes it
};
const char* to_string(AbsoluteTolerance kind);

/// A motion at equal time steps from 0 to the duration.
struct ToothMotion {
  std::vector<double> penetration, speed, force;  // m, m/s, N (contact forces; > 0 from the forward flank)
  double most_energy = 0;  // J, largest of all samples: kinetic, elastic and of the force
  double end_energy = 0;   // J, of the last sample
  double loop_area = 0;    // J, work of the contact forces on the samples (trapezoids)
  double opposite = 0;     // m, deepest penetration of the other flank
};

class ToothSimulator {
 public:
  ToothSimulator(const Tooth& tooth, const std::string& method, double relative_tolerance,
                 AbsoluteTolerance absolute);
  ToothSimulator(const ToothSimulator&) = delete;  // the integrator refers to this object
  ToothSimulator& operator=(const ToothSimulator&) = delete;

  /// `samples` >= 1 after the start. Throws IntegrationError.
  ToothMotion run(int samples);

  simulation::IntegratorStatistics statistics() const { return integrator_.statistics(); }

 private:
  double contact_force(double x, double speed) const;
  double energy(double x, double speed) const;

  Tooth tooth_;
  std::shared_ptr<const model::ContactLaw> law_;
  simulation::Integrator integrator_;
};

}  // namespace backlash::studies
