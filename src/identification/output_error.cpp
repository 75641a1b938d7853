#include "backlash_diagnosis/identification/output_error.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/bandwidth.h"
#include "backlash_diagnosis/identification/noise_floor.h"
#include "backlash_diagnosis/identification/rig_parameters.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/record/zero_phase.h"

namespace backlash {
namespace {

constexpr double kHold = 0.5;             // samples, mean delay of a held torque
constexpr double kLargestDelay = 3;  // samples
constexpr Eigen::Index kRowsPerBlock = 200;
constexpr double kEnds = 3;           // periods of the cutoff at either end, where the filter has not settled
constexpr double kSureSpeed = 5;      // standard deviations of the motor speed, from which it has a sign
constexpr double kRateNoise = 0.95;   // of a five-point difference, position noise over interval
constexpr long kReach = 2;            // samples to either side that it uses

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> d(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) d[k] = a[k] - b[k];
  return d;
}

// A second difference is the mean of the acceleration over two intervals with triangular weights, exactly. So
// torques are averaged alike: one that is smooth, by Simpson's weights; one that is held from its sample to
// the next, by half and half.
std::vector<double> over_second_difference(const std::vector<double>& x) {
  std::vector<double> mean = x;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) mean[k] = (x[k - 1] + 10 * x[k] + x[k + 1]) / 12;
  return mean;
}

std::vector<double> held_over_second_difference(const std::vector<double>& x) {
  std::vector<double> mean = x;
  for (std::size_t k = 1; k < x.size(); ++k) mean[k] = 0.5 * (x[k - 1] + x[k]);
  return mean;
}

/// +1 or -1 where the motor slides that way over both intervals about the sample and all that its rate was
/// taken from; 0 where it may stand or turn round, where dry friction takes any value.
std::vector<int> sliding(const ServoData& data) {
  const double slowest = kSureSpeed * kRateNoise * position_noise(data.motor) / data.interval;
  const long n = static_cast<long>(data.size());
  std::vector<int> direction(n), sure(n);
  for (long k = 0; k < n; ++k) direction[k] = (data.motor_rate[k] > slowest) - (data.motor_rate[k] < -slowest);
  for (long k = 0; k < n; ++k) {
    sure[k] = direction[k];
    for (long j = std::max(0L, k - kReach); j <= std::min(n - 1, k + kReach); ++j)
      if (direction[j] != direction[k]) sure[k] = 0;
  }
  return sure;
}

/// Over the samples that count (all where `counts` is empty).
ChannelError relative(const std::vector<double>& measured, const std::vector<double>& predicted,
                      const std::vector<char>& counts, double floor) {
  double n = 0, sum = 0, square = 0, residual = 0;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (!counts.empty() && !counts[k]) continue;
    ++n;
    sum += measured[k];
    square += measured[k] * measured[k];
    residual += std::pow(measured[k] - predicted[k], 2);
  }
  const double spread = std::sqrt(square - sum * sum / n);
  return {std::sqrt(residual) / spread, floor * std::sqrt(n) / spread};
}

}  // namespace

ServoPrediction predict_servo(const Rig& rig, const ServoData& data, const OutputErrorSettings& settings,
                              const Calibration& calibration) {
  const auto smooth = [&](const std::vector<double>& values) {
    return low_pass(values, data.interval, settings.cutoff);
  };
  ServoPrediction p;
  const RecordedMotion motion{data.interval,
                              &data.motor,
                              &data.motor_rate,
                              &data.load_rate,
                              data.load.front() - calibration.encoder_offset,
                              data.load_rate.front()};
  p.load = simulate_driven_load(rig, motion, settings.feedback);
  const double inertia = GearTrain(rig).motor_inertia();
  std::vector<double> torque(data.size());
  const std::vector<double> acting = delayed(
      calibration.held ? held_over_second_difference(data.torque) : over_second_difference(data.torque),
      calibration.torque_delay);
  const std::vector<int> direction = sliding(data);
  const long n = static_cast<long>(data.size()), ends = std::lround(kEnds / (settings.cutoff * data.interval));
  p.counts.assign(n, 0);
  for (long k = 0; k < n; ++k) {
    const FrictionLimits& f = p.load.motor_friction[k];
    p.counts[k] = direction[k] != 0 && k >= ends && k < n - ends;
    torque[k] = direction[k] == 0 ? acting[k]  // friction takes what balances
                                  : inertia * data.motor_acceleration[k] - p.load.motor_mean[k] +
                                        (direction[k] > 0 ? f.forward : -f.backward);
  }
  p.torque = smooth(torque);
  p.measured_torque = smooth(acting);
  p.measured_deflection = smooth(difference(data.motor, data.load));
  p.deflection = smooth(difference(data.motor, p.load.load));
  for (double& d : p.deflection) d -= calibration.encoder_offset;
  const NoiseFloors floors = noise_floors(rig, data, p.load.load, settings.cutoff, settings.feedback);
  p.torque_floor = floors.torque;
  p.deflection_floor = floors.deflection;
  p.torque_error = relative(p.measured_torque, p.torque, p.counts, p.torque_floor);
  p.deflection_error = relative(p.measured_deflection, p.deflection, {}, p.deflection_floor);
  return p;
}

namespace {

/// Residuals of one record in units of their floors, both channels of a moment side by side, as many rows as
/// a signal of this bandwidth has independent values.
void append_residuals(const ServoPrediction& p, const ServoData& data, double cutoff,
                      std::vector<double>& rows) {
  const std::size_t stride = std::max(1L, std::lround(0.4 / (cutoff * data.interval)));
  for (std::size_t k = 0; k < data.size(); k += stride) {
    rows.push_back(p.counts[k] ? (p.measured_torque[k] - p.torque[k]) / p.torque_floor : 0);
    rows.push_back((p.measured_deflection[k] - p.deflection[k]) / p.deflection_floor);
  }
}

double misfit(const Finding& finding, const Rig& rig) {
  double value = 0;
  for (const auto& [name, factor] : finding.combination) value += factor * servo_parameter(name).get(rig);
  return (finding.measured.value - value) / finding.measured.standard_error;
}

/// The unknowns of a fit: parameters of the rig, then delay and offset of each record.
class Unknowns {
 public:
  Unknowns(const Rig& start, const std::vector<std::string>& names, std::vector<Calibration> calibrations)
      : start_(start), calibrations_(std::move(calibrations)), records_(calibrations_.size()) {
    for (const std::string& name : names) fitted_.push_back(&servo_parameter(name));
  }
  Eigen::Index size() const { return Eigen::Index(fitted_.size() + 2 * records_); }

  Eigen::VectorXd values() const {
    Eigen::VectorXd p = Eigen::VectorXd::Zero(size());
    for (std::size_t i = 0; i < fitted_.size(); ++i) p[i] = fitted_[i]->get(start_);
    for (std::size_t r = 0; r < records_; ++r) {
      p[fitted_.size() + 2 * r] = calibrations_[r].torque_delay;
      p[fitted_.size() + 2 * r + 1] = calibrations_[r].encoder_offset;
    }
    return p;
  }
  Eigen::VectorXd scale() const {
    Eigen::VectorXd s = values().cwiseAbs();
    for (std::size_t i = 0; i < fitted_.size(); ++i)
      if (!fitted_[i]->positive || s[i] == 0) s[i] = 1;
    const double gap = start_.mesh.backlash / start_.mesh.lever();
    for (std::size_t r = 0; r < records_; ++r) {
      s[fitted_.size() + 2 * r] = 1;
      s[fitted_.size() + 2 * r + 1] = gap > 0 ? gap : 1e-4;
    }
    return s;
  }
  Rig rig(const Eigen::VectorXd& p) const {
    Rig rig = start_;
    for (std::size_t i = 0; i < fitted_.size(); ++i) {
      if (fitted_[i]->positive && !(p[i] > 0)) throw InvalidParameter(fitted_[i]->name, p[i], "must be > 0");
      fitted_[i]->set(rig, p[i]);
    }
    return rig;
  }
  Calibration calibration(const Eigen::VectorXd& p, std::size_t record) const {
    const Eigen::Index at = fitted_.size() + 2 * record;
    if (std::fabs(p[at]) > kLargestDelay) throw InvalidParameter("torque_delay", p[at], "beyond calibration");
    return {p[at], p[at + 1], calibrations_[record].held};
  }
  std::map<std::string, Measured> parameters(const LeastSquaresFit& fit) const {
    std::map<std::string, Measured> all;
    for (std::size_t i = 0; i < fitted_.size(); ++i) all[fitted_[i]->name] = fit.parameter(i);
    return all;
  }

 private:
  Rig start_;
  std::vector<const RigParameter*> fitted_;
  std::vector<Calibration> calibrations_;
  std::size_t records_;
};

}  // namespace

namespace {

OutputError fit_from(const Rig& start, const std::vector<ServoData>& records, const OutputErrorSettings& settings,
                     const std::vector<Calibration>& calibrations) {
  const Unknowns unknowns(start, settings.parameters, calibrations);
  const auto residuals = [&](const Eigen::VectorXd& p) {
    const Rig rig = unknowns.rig(p);
    std::vector<double> rows;
    for (std::size_t r = 0; r < records.size(); ++r)
      append_residuals(predict_servo(rig, records[r], settings, unknowns.calibration(p, r)), records[r],
                       settings.cutoff, rows);
    for (const Finding& finding : settings.findings) rows.push_back(misfit(finding, rig));
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(rows.data(), rows.size()));
  };
  NonlinearOptions options;
  options.iterations = settings.iterations;
  options.step = settings.step;
  LeastSquaresFit fit = fit_nonlinear(residuals, unknowns.values(), unknowns.scale(), options);
  // A block is as long as the slowest oscillation that a servo record shows, and there are enough of them.
  const Eigen::Index rows = fit.residuals.size(), known = Eigen::Index(settings.findings.size());
  const Eigen::Index block = std::clamp<Eigen::Index>(rows / (4 * unknowns.size()), 1, kRowsPerBlock);
  fit.covariance = block_covariance(fit, block, known);
  OutputError result;
  result.rig = unknowns.rig(fit.values);
  result.parameters = unknowns.parameters(fit);
  for (std::size_t r = 0; r < records.size(); ++r)
    result.calibrations.push_back(unknowns.calibration(fit.values, r));
  return result;
}

}  // namespace

OutputError fit_output_error(const Rig& start, const std::vector<ServoData>& records,
                             const OutputErrorSettings& settings) {
  OutputError result = fit_from(start, records, settings, std::vector<Calibration>(records.size()));
  std::vector<Calibration> calibrations = result.calibrations;
  bool changed = false;
  for (Calibration& c : calibrations) {
    if (c.torque_delay > -0.5 * kHold) continue;
    c.held = false;  // what acts half a sample earlier than a held torque is not held
    c.torque_delay += kHold;
    changed = true;
  }
  if (changed) result = fit_from(result.rig, records, settings, calibrations);
  for (std::size_t r = 0; r < records.size(); ++r) {
    const ServoPrediction p = predict_servo(result.rig, records[r], settings, result.calibrations[r]);
    result.torque.push_back(p.torque_error);
    result.deflection.push_back(p.deflection_error);
  }
  return result;
}

ServoPrediction predict_calibrated(const Rig& rig, const ServoData& data, const OutputErrorSettings& settings,
                                   Calibration& calibration) {
  OutputErrorSettings alone = settings;
  alone.parameters.clear();
  calibration = fit_output_error(rig, {data}, alone).calibrations.front();
  return predict_servo(rig, data, settings, calibration);
}

}  // namespace backlash
