// SPDX-License-Identifier: BSD-3-Clause
// Work against precision of all integration methods on one problem (Hairer, Norsett and Wanner, Solving
// Ordinary Differential Equations I, Section II.10).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::studies {

struct WorkPoint {
  std::string method;
  double tolerance = 0;    // relative
  double error = 0;        // -
  double evaluations = 0;  // of the derivative
  double steps = 0;
  double cpu_time = 0;  // s, median of repeats; differs from run to run
};

/// What a solver at a relative tolerance makes of the problem: numbers of comparable size.
using Solve = std::function<std::vector<double>(const std::string& method, double relative_tolerance,
                                                simulation::IntegratorStatistics& statistics)>;

enum class Cost { evaluations, cpu_time };

class WorkPrecision {
 public:
  /// Solves at each half decade of tolerance from 1e-3 to 1e-11 with each of `methods` and takes norm(y -
  /// reference) / norm(reference) for the error. The reference is verner at 1e-13, agreement() its error
  /// against dormand_prince at 1e-13. `tick` is called after each method. Throws what `solve` throws.
  WorkPrecision(std::string problem, const Solve& solve, const std::function<void()>& tick,
                const std::vector<std::string>& methods = simulation::integrator_methods());

  /// One more point with the same reference.
  WorkPoint measure(const Solve& solve, const std::string& method, double relative_tolerance) const;

  const std::string& problem() const { return problem_; }
  double agreement() const { return agreement_; }
  const std::vector<WorkPoint>& points() const { return points_; }

  /// Cost at which a method reaches an error and stays below it at all tighter tolerances; between two
  /// tolerances on straight lines in logarithms. NaN where it does not get there.
  double cost(const std::string& method, double error, Cost kind) const;
  /// The method with the least cost; empty if none gets there.
  std::string cheapest(double error, Cost kind) const;

 private:
  double error_of(const std::vector<double>& result) const;

  std::string problem_;
  std::vector<double> reference_;
  double agreement_ = 0;
  std::vector<WorkPoint> points_;  // method by method, from loose to tight
};

}  // namespace backlash::studies
