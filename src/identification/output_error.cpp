#include "backlash_diagnosis/identification/output_error.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/noise_floor.h"
#include "backlash_diagnosis/identification/rig_parameters.h"
#include "servo_prediction.h"

namespace backlash {
namespace {

constexpr double kHold = 0.5;         // samples, mean delay of a held torque
constexpr double kLargestDelay = 3;   // samples
constexpr double kBlock = 1;          // s: the slowest oscillation that a servo record shows
constexpr double kFarthest = 30;      // times the start or a part of it: no parameter is sought beyond
constexpr double kRoughCutoff = 15;   // Hz, of the first round: what moves slowly has fewer wrong minima
constexpr double kClean = 2;     // times the noise floor, up to which nothing is missing
constexpr double kAlike = 0.03;  // relative difference of what two starts leave in the same minimum
constexpr double kWideStep = 1e-2;  // of the differences that the errors are taken from
constexpr int kOtherStarts = 8;
constexpr double kBeside = 0.4;  // of the logarithm of a parameter
constexpr double kRoughTolerance = 1e-3;

/// Standard deviation of either residual of one record [N m, rad].
struct Weights {
  double torque, deflection;
};

/// What counts of one record is one row per channel and `stride` samples: as many as a signal of this
/// bandwidth has independent values.
std::size_t stride(const PreparedServo& record) {
  return std::max(1L, std::lround(0.4 / (record.cutoff * record.data.interval)));
}

void append_residuals(const PreparedServo& record, const ServoResiduals& r, const Weights& weights,
                      std::vector<double>& rows) {
  for (std::size_t k = 0; k < record.data.size(); k += stride(record)) {
    rows.push_back(record.counts[k] ? r.torque[k] / weights.torque : 0);
    rows.push_back(record.settled[k] ? r.deflection[k] / weights.deflection : 0);
  }
}

double rms(const std::vector<double>& values, const std::vector<char>& counts) {
  double square = 0, count = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    square += counts[k] ? values[k] * values[k] : 0;
    count += counts[k];
  }
  return std::sqrt(square / std::max(1.0, count));
}

/// The larger of noise floor and actual residual: a misfit must not overrule what other records say well.
Weights weigh(const Rig& rig, const PreparedServo& record, const Calibration& calibration) {
  const ServoResiduals r = record.residuals(rig, calibration);
  const NoiseFloors floor = noise_floors(rig, record.data, r.load.load, record.cutoff, record.feedback);
  return {std::max(floor.torque, rms(r.torque, record.counts)),
          std::max(floor.deflection, rms(r.deflection, record.settled))};
}

double misfit(const Finding& finding, const Rig& rig) {
  double value = 0;
  for (const auto& [name, factor] : finding.combination) value += factor * servo_parameter(name).get(rig);
  return (finding.measured.value - value) / finding.measured.standard_error;
}

/// The unknowns of a fit: parameters of the rig (of those that are positive the logarithm, relative to the
/// start), then delay and offset of each record.
class Unknowns {
 public:
  Unknowns(const Rig& start, const std::vector<std::string>& names, std::vector<Calibration> calibrations)
      : start_(start), calibrations_(std::move(calibrations)), records_(calibrations_.size()) {
    for (const std::string& name : names) {
      fitted_.push_back(&servo_parameter(name));
      if (const double value = fitted_.back()->get(start); fitted_.back()->positive && !(value > 0))
        throw InvalidParameter(name, value, "must be > 0");
    }
  }
  Eigen::Index size() const { return Eigen::Index(fitted_.size() + 2 * records_); }

  Eigen::VectorXd values() const {
    Eigen::VectorXd p = Eigen::VectorXd::Zero(size());
    for (std::size_t i = 0; i < fitted_.size(); ++i)
      if (!fitted_[i]->positive) p[i] = fitted_[i]->get(start_);
    for (std::size_t r = 0; r < records_; ++r) {
      p[fitted_.size() + 2 * r] = calibrations_[r].torque_delay;
      p[fitted_.size() + 2 * r + 1] = calibrations_[r].encoder_offset;
    }
    return p;
  }
  Eigen::VectorXd scale() const {
    Eigen::VectorXd s = Eigen::VectorXd::Ones(size());
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
      if (fitted_[i]->positive && std::fabs(p[i]) > std::log(kFarthest))
        throw InvalidParameter(fitted_[i]->name, std::exp(p[i]), "of its start: too far");
      fitted_[i]->set(rig, fitted_[i]->positive ? fitted_[i]->get(start_) * std::exp(p[i]) : p[i]);
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
    for (std::size_t i = 0; i < fitted_.size(); ++i) {
      Measured& m = all[fitted_[i]->name] = fit.parameter(i);
      if (fitted_[i]->positive) m.value = fitted_[i]->get(start_) * std::exp(m.value), m.standard_error *= m.value;
    }
    return all;
  }

 private:
  Rig start_;
  std::vector<const RigParameter*> fitted_;
  std::vector<Calibration> calibrations_;
  std::size_t records_;
};

/// The covariance of neighbouring rows is itself an estimate from few blocks and now and then far too small.
void take_larger(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& other) {
  const Eigen::VectorXd growth = (other.diagonal().cwiseQuotient(covariance.diagonal())).cwiseMax(1).cwiseSqrt();
  covariance = growth.asDiagonal() * covariance * growth.asDiagonal();
}

/// The fit of all records, round after round.
class Fit {
 public:
  Fit(const Rig& start, const std::vector<ServoData>& records, const OutputErrorSettings& settings)
      : settings_(settings), rig_(start), calibrations_(records.size()) {
    data_ = &records;
  }

  /// Weighs with the present rig and fits.
  void run(double cutoff, double tolerance) {
    OutputErrorSettings settings = settings_;
    settings.cutoff = std::min(cutoff, settings_.cutoff);
    records_.clear();
    for (const ServoData& data : *data_) records_.emplace_back(data, settings);
    weights_.clear();
    for (std::size_t r = 0; r < records_.size(); ++r)
      weights_.push_back(weigh(rig_, records_[r], calibrations_[r]));
    unknowns_.emplace(rig_, settings_.parameters, calibrations_);
    const Unknowns& unknowns = *unknowns_;
    NonlinearOptions options;
    options.iterations = settings_.iterations;
    options.step = settings_.step;
    options.tolerance = tolerance;
    options.parallel = true;
    fit_ = fit_nonlinear([&](const Eigen::VectorXd& p) { return rows(unknowns, p); }, unknowns.values(),
                         unknowns.scale(), options);
    rig_ = unknowns.rig(fit_.values);
    for (std::size_t r = 0; r < records_.size(); ++r)
      calibrations_[r] = unknowns.calibration(fit_.values, r);
  }

  bool try_run(double cutoff, double tolerance) {
    try {
      run(cutoff, tolerance);
      return true;
    } catch (const CannotIdentify&) {
      return false;
    }
  }

  /// What is left of the torque of all records, in units of the noise floor.
  double torque_error() const {
    double sum = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const PreparedServo& record = records_[r];
      const ServoResiduals left = record.residuals(rig_, calibrations_[r]);
      const double floor =
          noise_floors(rig_, record.data, left.load.load, record.cutoff, record.feedback).torque;
      sum += std::pow(rms(left.torque, record.counts) / floor, 2);
    }
    return std::sqrt(sum / double(records_.size()));
  }

  /// What acts half a sample earlier than a held torque is not held.
  void tell_held() {
    for (Calibration& c : calibrations_) {
      if (!c.held || c.torque_delay > -0.5 * kHold) continue;
      c.held = false;
      c.torque_delay += kHold;
    }
  }

  OutputError result() {
    const Unknowns& unknowns = *unknowns_;
    const Eigen::Index known = Eigen::Index(settings_.findings.size());
    const Eigen::Index rows = fit_.residuals.size() - known;
    const Eigen::Index wanted = 2 * std::lround(kBlock / (double(stride(records_[0])) * records_[0].data.interval));
    const Eigen::Index block = std::clamp<Eigen::Index>(rows / (4 * unknowns.size()), 1, wanted);
    widen_jacobian(fit_, [&](const Eigen::VectorXd& p) { return this->rows(unknowns, p); },
                   kWideStep * unknowns.scale(), true);
    take_larger(fit_.covariance, block_covariance(fit_, block, known));
    OutputError result;
    result.rig = rig_;
    result.parameters = unknowns.parameters(fit_);
    result.calibrations = calibrations_;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const ServoPrediction p = predict_servo(rig_, records_[r].data, settings_, calibrations_[r]);
      result.torque.push_back(p.torque_error);
      result.deflection.push_back(p.deflection_error);
    }
    return result;
  }

 private:
  Eigen::VectorXd rows(const Unknowns& unknowns, const Eigen::VectorXd& p) const {
    const Rig rig = unknowns.rig(p);
    std::vector<double> rows;
    for (std::size_t r = 0; r < records_.size(); ++r)
      append_residuals(records_[r], records_[r].residuals(rig, unknowns.calibration(p, r)), weights_[r], rows);
    for (const Finding& finding : settings_.findings) rows.push_back(misfit(finding, rig));
    return Eigen::Map<Eigen::VectorXd>(rows.data(), Eigen::Index(rows.size()));
  }

  OutputErrorSettings settings_;
  const std::vector<ServoData>* data_;
  std::vector<PreparedServo> records_;
  std::vector<Weights> weights_;
  Rig rig_;
  std::vector<Calibration> calibrations_;
  std::optional<Unknowns> unknowns_;  // of the last round
  LeastSquaresFit fit_;
};

/// Another start not far away, the same for the same number.
Rig beside(const Rig& start, const std::vector<std::string>& names, int number) {
  std::mt19937 random(number);
  Rig rig = start;
  for (const std::string& name : names) {
    const RigParameter& parameter = servo_parameter(name);
    const double share = double(random()) / double(std::mt19937::max());
    if (parameter.positive) parameter.set(rig, parameter.get(rig) * std::exp(kBeside * (2 * share - 1)));
  }
  return rig;
}

/// The first round. Where it leaves more than noise, other starts are tried until two end alike: then that is
/// the minimum, and the machine has something that the rig does not.
Fit rough_fit(const Rig& start, const std::vector<ServoData>& records, const OutputErrorSettings& settings) {
  Fit best(start, records, settings);
  double least = best.try_run(kRoughCutoff, kRoughTolerance) ? best.torque_error() : INFINITY;
  if (settings.parameters.empty()) return best;
  for (int i = 1; i <= kOtherStarts && least > kClean; ++i) {
    Fit other(beside(start, settings.parameters, i), records, settings);
    const double error = other.try_run(kRoughCutoff, kRoughTolerance) ? other.torque_error() : INFINITY;
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
  Fit fit = rough_fit(start, records, settings);
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
