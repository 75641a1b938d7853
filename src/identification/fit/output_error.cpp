// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/output_error.h"

#include <cmath>
#include <random>

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "joint_fit.h"

namespace backlash {
namespace {

constexpr double kHold = 0.5;        // samples, mean delay of a held torque
constexpr double kRoughCutoff = 15;  // Hz, of the first round: what moves slowly has fewer wrong minima
constexpr double kClean = 2;         // times the noise floor, up to which nothing is missing
constexpr double kAlike = 0.03;      // relative difference of what two starts leave in the same minimum
constexpr int kOtherStarts = 8;
constexpr double kBeside = 0.4;  // of the logarithm of a parameter
constexpr double kRoughTolerance = 1e-3;

std::function<double(const Rig&)> belief(const Finding& finding) {
  return [finding](const Rig& rig) {
    double value = 0;
    for (const auto& [name, factor] : finding.combination) value += factor * servo_parameter(name).get(rig);
    return (finding.measured.value - value) / finding.measured.standard_error;
  };
}

/// The fit of all records, round after round.
class Rounds {
 public:
  Rounds(const Rig& start, const std::vector<ServoData>& records, const OutputErrorSettings& settings)
      : settings_(settings), data_(&records) {
    machine_.rig = start;
    machine_.calibrations.resize(records.size());
    for (const std::string& name : settings.parameters)
      machine_.parameters.push_back(machine_parameter(name, start));
    for (const Finding& finding : settings.findings) machine_.beliefs.push_back(belief(finding));
  }

  /// Weighs with the present rig and fits.
  void run(double cutoff, double tolerance) {
    RecordSet records(*data_, std::min(cutoff, settings_.cutoff), settings_.feedback);
    records.weigh(machine_);
    NonlinearOptions options;
    options.iterations = settings_.iterations;
    options.step = settings_.step;
    options.tolerance = tolerance;
    options.parallel = true;
    start_ = machine_;
    fit_ = fit_machine(start_, records, options);
    machine_ = fit_.machine;
    torque_error_ = records.leftover(machine_).torque;
  }

  /// What is left of the torque, in units of the noise floor; infinite where the fit fails.
  double try_run(double cutoff, double tolerance) {
    try {
      run(cutoff, tolerance);
      return torque_error_;
    } catch (const CannotIdentify&) {
      return INFINITY;
    }
  }

  /// What acts half a sample earlier than a held torque is not held.
  void tell_held() {
    for (Calibration& c : machine_.calibrations) {
      if (!c.held || c.torque_delay > -0.5 * kHold) continue;
      c.held = false;
      c.torque_delay += kHold;
    }
  }

  /// Of the last round, which must have been at the cutoff of the settings.
  OutputError result() {
    RecordSet records(*data_, settings_.cutoff, settings_.feedback);
    records.weigh(start_);
    judge_errors(fit_, start_, records);
    OutputError result;
    result.rig = machine_.rig;
    result.parameters = Unknowns(start_).parameters(fit_.fit);
    result.calibrations = machine_.calibrations;
    for (std::size_t r = 0; r < data_->size(); ++r) {
      const ServoPrediction p = predict_servo(machine_.rig, (*data_)[r], settings_, machine_.calibrations[r]);
      result.torque.push_back(p.torque_error);
      result.deflection.push_back(p.deflection_error);
    }
    return result;
  }

 private:
  OutputErrorSettings settings_;
  const std::vector<ServoData>* data_;
  Machine machine_, start_;  // start_: of the last round
  MachineFit fit_;
  double torque_error_ = 0;
};

/// Another start not far away, the same for the same number.
Rig beside(const Rig& start, const std::vector<std::string>& names, int number) {
  std::mt19937 random(number);
  Rig rig = start;
  for (const std::string& name : names) {
    const FitParameter parameter = machine_parameter(name, start);
    const double share = double(random()) / double(std::mt19937::max());
    if (parameter.positive) parameter.set(rig, parameter.get(rig) * std::exp(kBeside * (2 * share - 1)));
  }
  return rig;
}

/// The first round. Where it leaves more than noise, other starts are tried until two end alike: then that is
/// the minimum, and the machine has something that the rig does not.
Rounds rough_fit(const Rig& start, const std::vector<ServoData>& records,
                 const OutputErrorSettings& settings) {
  Rounds best(start, records, settings);
  double least = best.try_run(kRoughCutoff, kRoughTolerance);
  if (settings.parameters.empty()) return best;
  for (int i = 1; i <= kOtherStarts && least > kClean; ++i) {
    Rounds other(beside(start, settings.parameters, i), records, settings);
    const double error = other.try_run(kRoughCutoff, kRoughTolerance);
    const bool alike = std::isfinite(error) && std::fabs(error / least - 1) < kAlike;
    if (error < least) {
      best = std::move(other);
      least = error;
    }
    if (alike) break;
  }
  if (!std::isfinite(least)) best.run(kRoughCutoff, kRoughTolerance);  // says why
  return best;
}

}  // namespace

OutputError fit_output_error(const Rig& start, const std::vector<ServoData>& records,
                             const OutputErrorSettings& settings) {
  Rounds fit = rough_fit(start, records, settings);
  fit.tell_held();
  fit.run(settings.cutoff, kRoughTolerance);
  fit.tell_held();
  fit.run(settings.cutoff, NonlinearOptions().tolerance);
  return fit.result();
}

ServoPrediction predict_calibrated(const Rig& rig, const ServoData& data, const OutputErrorSettings& settings,
                                   Calibration& calibration) {
  OutputErrorSettings alone = settings;
  alone.parameters.clear();
  calibration = fit_output_error(rig, {data}, alone).calibrations.front();
  return predict_servo(rig, data, settings, calibration);
}

}  // namespace backlash
