// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/output_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "multi_start.h"

namespace backlash::identification {
namespace {

/// The row of a finding: its distance from what the rig says, in standard errors.
std::function<double(const model::Rig&)> prior_row(const Finding& finding) {
  return [finding](const model::Rig& rig) {
    double value = 0;
    for (const auto& [name, factor] : finding.combination)
      value += factor * rig_file::servo_parameter(name).get(rig);
    return (finding.measured.value - value) / finding.measured.standard_error;
  };
}

Machine start_machine(const model::Rig& rig, std::size_t records, const OutputErrorSettings& settings) {
  Machine machine;
  machine.rig = rig;
  machine.calibrations.resize(records);
  for (const std::string& name : settings.parameters)
    machine.parameters.push_back(machine_parameter(name, rig));
  if (rig.coupled) machine.priors = rows_as_declared(rig);
  for (const Finding& finding : settings.findings) machine.priors.push_back(prior_row(finding));
  return machine;
}

constexpr double kFlat = 0.01;       // simulation: below, fits from beside an end no longer come back to it
constexpr double kBeside = 0.1;      // choice: of the logarithms, to either side
constexpr int kOtherEnds = 3;        // choice (time)
constexpr double kHardlyMore = 1.1;  // choice: of the sum of squares
constexpr double kVanishes = 2;      // choice: standard errors, below which a play may be none

bool is_play(const FitParameter& p) {
  return p.name == rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::backlash).name;
}

/// Teeth without play are another machine than those with a little: no force jumps when they change flanks.
/// So where the play vanishes it is held against the one with some. Nothing where that leaves less.
std::optional<BandFit> without_play(const BandFit& fitted, const std::vector<ServoData>& records,
                                    const FitSettings& settings) {
  Machine machine = fitted.start;
  const auto play = std::find_if(machine.parameters.begin(), machine.parameters.end(), is_play);
  if (play == machine.parameters.end()) return std::nullopt;
  const signal::Measured found =
      Unknowns(fitted.start).parameter(fitted.fit, std::size_t(play - machine.parameters.begin()));
  if (!(found.value < kVanishes * found.standard_error)) return std::nullopt;
  play->set(machine.rig, 0);
  machine.parameters.erase(play);
  BandFit other = fit_to_records(records, machine, settings);
  const auto left = [&](const MachineFit& fit) {
    return fitted.records.rows(fit.machine.rig, fit.machine.calibrations).norm();
  };
  if (!(left(other.fit) <= left(fitted.fit))) return std::nullopt;
  judge_errors(other.fit, other.start, other.records);
  return other;
}

/// 1 where the rows tell all values apart, 0 where two are one.
double flatness(const Eigen::MatrixXd& jacobian) {
  const Eigen::MatrixXd scaled = jacobian * jacobian.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd normal = scaled.transpose() * scaled;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(normal, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
}

/// Where values nearly mix, the sum of squares has a valley, rough by standstills and touches of the load: a
/// fit ends anywhere in it. Fits that begin beside its end say where else. The best is taken; of the others
/// that leave hardly more, the root mean square of the distance to it is an error.
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

}  // namespace

OutputError fit_output_error(const model::Rig& start, const std::vector<ServoData>& records,
                             const OutputErrorSettings& asked) {
  const FitSettings settings = with_bands(asked.fit, start, records);
  BandFit fitted = fit_to_records(records, start_machine(start, records.size(), asked), settings);
  const std::map<std::string, double> valley = search_valley(fitted, settings);
  judge_errors(fitted.fit, fitted.start, fitted.records);
  OutputError result;
  if (auto other = without_play(fitted, records, settings)) {
    const auto play = std::find_if(fitted.start.parameters.begin(), fitted.start.parameters.end(), is_play);
    const signal::Measured least = Unknowns(fitted.start).parameters(fitted.fit).at(play->name);
    result.parameters[play->name] = {0, least.value + least.standard_error};
    fitted = std::move(*other);
  }
  allow_for_misfit(fitted.fit, fitted.records);
  const Machine& machine = fitted.fit.machine;
  result.rig = machine.rig;
  for (const auto& [name, value] : Unknowns(fitted.start).parameters(fitted.fit))
    result.parameters[name] = value;
  for (const auto& [name, error] : valley)
    result.parameters.at(name).standard_error = std::hypot(result.parameters.at(name).standard_error, error);
  result.calibrations = machine.calibrations;
  for (std::size_t r = 0; r < records.size(); ++r)
    result.predictions.push_back(predict_servo(machine.rig, records[r], settings, machine.calibrations[r]));
  return result;
}

ServoPrediction predict_calibrated(const model::Rig& rig, const ServoData& data, const FitSettings& asked,
                                   Calibration& calibration) {
  OutputErrorSettings alone;
  alone.fit = with_bands(asked, rig, {data});
  OutputError fit = fit_output_error(rig, {data}, alone);
  calibration = fit.calibrations.front();
  return std::move(fit.predictions.front());
}

}  // namespace backlash::identification
