// SPDX-License-Identifier: BSD-3-Clause
#include "valley.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash::identification {
namespace {

constexpr double kFlat = 0.01;       // simulation: below, fits from beside an end no longer come back to it
constexpr double kBeside = 0.1;      // choice: of the logarithms, to either side
constexpr int kOtherEnds = 3;        // choice (time)
constexpr double kHardlyMore = 1.1;  // choice: of the sum of squares

/// 1 where the rows distinguish all values, 0 where two are one.
double flatness(const Eigen::MatrixXd& jacobian) {
  const Eigen::VectorXd unit = jacobian.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = jacobian * unit.asDiagonal();
  const Eigen::MatrixXd normal = scaled.transpose() * scaled;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(normal, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
}

}  // namespace

std::map<std::string, double> search_valley(BandFit& fitted, const FitSettings& settings) {
  if (flatness(fitted.fit.fit.jacobian) > kFlat) return {};
  const auto left = [records = fitted.records](const MachineFit& fit) {
    return records.rows(fit.machine.rig, fit.machine.calibrations).squaredNorm();
  };
  std::vector<std::pair<double, Machine>> ends = {{left(fitted.fit), fitted.fit.machine}};
  double least = ends.front().first;
  for (int i = 1; i <= kOtherEnds; ++i) try {
      Machine beside = other_start(ends.front().second, kBeside, settings.seed + std::uint64_t(i));
      MachineFit end = fit_machine(beside, fitted.records, fit_options(settings, settings.tolerance, false));
      ends.emplace_back(left(end), end.machine);
      if (ends.back().first >= least) continue;
      least = ends.back().first;
      fitted.misfit = fitted.records.misfit(end.machine);
      fitted.start = std::move(beside), fitted.fit = std::move(end);
    } catch (const CannotIdentify&) {
    }
  std::map<std::string, double> errors;
  for (const FitParameter& p : fitted.start.parameters) {
    double squares = 0, count = 0;
    for (const auto& [squares_left, machine] : ends) {
      if (squares_left > kHardlyMore * least) continue;
      squares += std::pow(p.get(machine.rig) - p.get(fitted.fit.machine.rig), 2);
      ++count;
    }
    errors[p.name] = std::sqrt(squares / count);
  }
  return errors;
}

}  // namespace backlash::identification
