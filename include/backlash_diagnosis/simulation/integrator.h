// SPDX-License-Identifier: BSD-3-Clause
// Initial value problems by SUNDIALS, whose types stay inside the .cpp.
//
// Explicit Runge-Kutta (ARKODE) is the default: a geared joint with play is a sequence of short impacts, each
// of which makes the history of a multistep method worthless. Multistep methods need fewer evaluations, but
// these are cheap here and their own work is not (doc/integrators.md). Sarkar, Ellis and Moore (1997,
// Section 6.3) found BDF wrong for the contact and Verner's pair right; so it is at tolerances that are loose
// against the penetration.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::simulation {

struct SolverSettings {
  std::string method = "dormand_prince";  // one of integrator_methods()
  double relative_tolerance = 1e-6;       // -
  double position_tolerance = 1e-10;      // absolute, rad
  double velocity_tolerance = 1e-7;       // absolute, rad/s
};

/// ARKODE explicit pairs: bogacki_shampine, cash_karp, dormand_prince, fehlberg, tsitouras (2011), verner
/// (6(5), the pair of DVERK); CVODE: bdf, adams.
const std::vector<std::string>& integrator_methods();

SolverSettings read_solver(const YamlReader& yaml);

struct IntegratorStatistics {
  long steps = 0, evaluations = 0, error_test_failures = 0;
};

/// What an error of one state is measured by: absolute + relative_tolerance * min(|state|, largest). An angle
/// that has turned far is to be known no less precisely than one that has not.
struct StateTolerance {
  StateTolerance(double absolute_error, double largest_size = std::numeric_limits<double>::infinity())
      : absolute(absolute_error), largest(largest_size) {}
  double absolute, largest;
};

class Integrator {
 public:
  using Derivative = std::function<void(double t, const double* state, double* rate)>;
  /// Writes `event_count` values; a rise of one of them through zero is an event.
  using Events = std::function<void(double t, const double* state, double* values)>;
  static constexpr int kNoEvent = -1;

  /// `tolerances` has one entry per state. Without events nothing is spent on finding them. Throws
  /// InvalidParameter for an unknown method or a tolerance <= 0.
  Integrator(Derivative derivative, std::vector<StateTolerance> tolerances, const SolverSettings& settings,
             Events events = nullptr, int event_count = 0);
  ~Integrator();
  Integrator(Integrator&&) noexcept;
  Integrator& operator=(Integrator&&) noexcept;

  /// Starts anew from `state` at `t`, forgetting step size and history. `stop` is a time beyond which the
  /// derivative is not evaluated (infinite: none): the next jump of the right-hand side. `longest_step` [s]
  /// (infinite: as the error allows) for events that depend on time more than the state does. `first_step`
  /// [s]: tried first, 0: estimated, which takes three derivatives and is far too short of a smooth motion.
  void restart(double t, const double* state, double stop,
               double longest_step = std::numeric_limits<double>::infinity(), double first_step = 0);

  /// State at `t`, or at the first event on the way: then time() is that of the event (to some 100 roundings
  /// of t and of the step; the value has risen to 0 or above) and its index is returned, kNoEvent otherwise.
  /// A value that is exactly zero at a restart gives no event before it has been negative. `t` lies not
  /// before the last returned time, not beyond the stop time (both to within rounding). Throws
  /// IntegrationError, also where more than 10^7 steps would be needed; passes on what the derivative throws.
  /// After either only restart() helps.
  int integrate_to(double t, double* state);

  /// Last returned time [s].
  double time() const;

  IntegratorStatistics statistics() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace backlash::simulation
