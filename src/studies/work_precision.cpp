// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/work_precision.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>
#include <vector>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::studies {
namespace {

constexpr double kReferenceTolerance = 1e-13;
constexpr int kLoosest = 6, kTightest = 22;  // half decades
constexpr int kRepeats = 5;

double cpu_now() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double cost_of(const WorkPoint& point, Cost kind) {
  return kind == Cost::evaluations ? point.evaluations : point.cpu_time;
}

}  // namespace

WorkPrecision::WorkPrecision(std::string problem, const Solve& solve, const std::function<void()>& tick,
                             const std::vector<std::string>& methods)
    : problem_(std::move(problem)) {
  simulation::IntegratorStatistics ignored;
  reference_ = solve("verner", kReferenceTolerance, ignored);
  agreement_ = error_of(solve("dormand_prince", kReferenceTolerance, ignored));
  for (const std::string& method : methods) {
    for (int half = kLoosest; half <= kTightest; ++half)
      points_.push_back(measure(solve, method, std::pow(10, -0.5 * half)));
    if (tick) tick();
  }
}

double WorkPrecision::error_of(const std::vector<double>& result) const {
  double square = 0, size = 0;
  for (std::size_t i = 0; i < reference_.size(); ++i) {
    square += std::pow(result.at(i) - reference_[i], 2);
    size += std::pow(reference_[i], 2);
  }
  return std::sqrt(square / size);
}

WorkPoint WorkPrecision::measure(const Solve& solve, const std::string& method,
                                 double relative_tolerance) const {
  WorkPoint point{method, relative_tolerance};
  std::vector<double> times(kRepeats);
  for (double& time : times) {
    simulation::IntegratorStatistics statistics;
    const double start = cpu_now();
    point.error = error_of(solve(method, relative_tolerance, statistics));
    time = cpu_now() - start;
    point.evaluations = static_cast<double>(statistics.evaluations);
    point.steps = static_cast<double>(statistics.steps);
  }
  point.cpu_time = signal::median(std::move(times));
  return point;
}

double WorkPrecision::cost(const std::string& method, double error, Cost kind) const {
  const WorkPoint* better = nullptr;  // the point at the next tighter tolerance
  for (auto point = points_.rbegin(); point != points_.rend(); ++point) {
    if (point->method != method) continue;
    if (!(point->error <= error)) {
      if (!better) return std::nan("");
      const double share = std::log(point->error / error) / std::log(point->error / better->error);
      return cost_of(*point, kind) * std::pow(cost_of(*better, kind) / cost_of(*point, kind), share);
    }
    better = &*point;
  }
  return better ? cost_of(*better, kind) : std::nan("");  // already the loosest tolerance gets there
}

std::string WorkPrecision::cheapest(double error, Cost kind) const {
  std::string best;
  double least = 0;
  for (const std::string& method : simulation::integrator_methods()) {
    const double own = cost(method, error, kind);
    if (std::isnan(own) || (!best.empty() && own >= least)) continue;
    best = method;
    least = own;
  }
  return best;
}

}  // namespace backlash::studies
