// SPDX-License-Identifier: BSD-3-Clause
#include "joint_fit.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/finding.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "contact_edge.h"
#include "reach.h"
#include "sampling.h"

namespace backlash::identification {
namespace {

constexpr double kFarthest = 30;  // choice: factor by which a positive parameter may differ from its start; a
                                  // bound that is approached and never reached
constexpr double kDrawn = 0.3;    // simulation: share of what is left that follows what a value changes
constexpr double kNegligible = 2e-3;  // choice: of a signal: no floor is lower, no model need be better
constexpr double kVague = 30;  // choice: times the scale: standard deviation of the prior of a parameter
constexpr double kDefaultGap = 1e-4;  // rad, choice: scale of an encoder offset where the rig has no gap
constexpr double kOversampling =
    1.25;  // theory: rows per second over those of a signal of this bandwidth, 2 cutoff
constexpr double kSkewOfSample = 1e-3;     // simulation: samples, that interpolation leaves wrong of a skew
constexpr double kUnsureOfSampling = 0.3;  // simulation: of what sampling makes of a value
constexpr double kEquations = 5e-5;  // simulation: relative, of a value > 0 that moves the load: how well a
                                     // record is simulated between its samples
constexpr long kFewestBlocks = 4;    // choice: per unknown, for a covariance from blocks

std::size_t stride(const PreparedServo& record) {
  return std::max(1L, std::lround(1 / (2 * kOversampling * record.cutoff * record.data().interval)));
}

double rms(const std::vector<double>& values, const std::vector<char>& counts) {
  double square = 0, count = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    square += counts[k] ? values[k] * values[k] : 0;
    count += counts[k];
  }
  return std::sqrt(square / std::max(1.0, count));
}

/// Standard deviation.
double spread(std::vector<double> values, const std::vector<char>& counts) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    sum += counts[k] ? values[k] : 0;
    count += counts[k];
  }
  for (double& value : values) value -= sum / std::max(1.0, count);
  return rms(values, counts);
}

/// Points that the rig refuses are left out.
fit::AheadFunction ahead(const Unknowns& unknowns, const RecordSet& records) {
  return [&](const std::vector<Eigen::VectorXd>& points) {
    std::vector<Machine> machines;
    for (const Eigen::VectorXd& p : points) try {
        machines.push_back(unknowns.machine(p));
      } catch (const InvalidParameter&) {
      }
    records.prepare(machines);
  };
}

/// A logarithm that approaches kFarthest on either side.
double limited(double logarithm) {
  const double most = std::log(kFarthest);
  return most * std::tanh(logarithm / most);
}

/// The covariance of neighbouring rows is itself an estimate from few blocks and now and then far too small.
void take_larger(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& other) {
  const Eigen::VectorXd growth =
      (other.diagonal().cwiseQuotient(covariance.diagonal())).cwiseMax(1).cwiseSqrt();
  covariance = growth.asDiagonal() * covariance * growth.asDiagonal();
}

/// Of standard errors, from one covariance to another.
double median_growth(const Eigen::VectorXd& after, const Eigen::VectorXd& before) {
  const Eigen::VectorXd growth = after.cwiseQuotient(before).cwiseSqrt();
  return signal::median({growth.data(), growth.data() + growth.size()});
}

/// s: of a coupled machine the deflection under viscous friction, which is declared, looks like a skew.
double skew_of_friction(const model::Rig& rig) {
  const double stiffness =
      rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::stiffness).get(rig);
  return rig.coupled ? kDeclaredUncertainty * rig.motor.viscous_damping / stiffness : 0;
}

/// What samples `interval` [s] apart do not show of a delay.
void add_timing(MachineFit& fit, const Machine& start, double interval) {
  const std::string& skew =
      rig_file::servo_parameter(rig_file::RigPart::sensors, rig_file::ParameterKind::encoder_skew).name;
  const std::string& delay = model::term_type_that([](const model::TermType& type) {
                               return type.calibrates == model::Calibrates::torque_delay;
                             }).search->strength;
  for (std::size_t i = 0; i < start.parameters.size(); ++i) {
    double& variance = fit.fit.covariance(Eigen::Index(i), Eigen::Index(i));
    if (start.parameters[i].name == skew)
      variance += std::pow(kSkewOfSample * interval, 2) + std::pow(skew_of_friction(fit.machine.rig), 2);
    if (start.parameters[i].name == delay) variance += std::pow(kUnsureOfHold * interval, 2);
  }
}

/// A machine whose load is simulated is known no better than it is simulated.
void add_equations(MachineFit& fit, const Machine& start) {
  if (!simulation::load_moves_freely(start.rig)) return;
  for (std::size_t i = 0; i < start.parameters.size(); ++i)
    if (start.parameters[i].positive)
      fit.fit.covariance(Eigen::Index(i), Eigen::Index(i)) += std::pow(kEquations, 2);
}

/// The part beyond noise of a residual so many times the noise.
double share_beyond_noise(double in_floors) {
  return std::sqrt(std::max(0.0, 1 - 1 / (in_floors * in_floors)));
}

/// What is left beyond noise, `left`, may follow what a value changes: it must not be known better than
/// |left| / |change per unit|, or than it is known beside the `rows` of the records.
void allow_for_left(signal::LeastSquaresFit& fit, Eigen::Index rows, double left) {
  Eigen::VectorXd growth = Eigen::VectorXd::Ones(fit.values.size());
  for (Eigen::Index i = 0; i < growth.size(); ++i) {
    const double change = fit.jacobian.col(i).head(rows).norm(), error = std::sqrt(fit.covariance(i, i));
    const double known = fit.jacobian.col(i).tail(fit.jacobian.rows() - rows).norm();  // beside the records
    if (left > 0 && error > 0) growth[i] = std::max(1.0, 1 / std::hypot(change / left, known) / error);
  }
  fit.covariance = growth.asDiagonal() * fit.covariance * growth.asDiagonal();
}

}  // namespace

Eigen::VectorXd all_rows(const Unknowns& unknowns, const RecordSet& records, const Eigen::VectorXd& p) {
  const Machine machine = unknowns.machine(p);
  Eigen::VectorXd rows = records.rows(machine.rig, machine.calibrations);
  const Eigen::Index own = rows.size();
  rows.conservativeResize(own + unknowns.size() + Eigen::Index(machine.priors.size()));
  rows.segment(own, unknowns.size()) = unknowns.prior(p);
  for (std::size_t i = 0; i < machine.priors.size(); ++i)
    rows[own + unknowns.size() + Eigen::Index(i)] = machine.priors[i](machine.rig);
  return rows;
}

double farthest_logarithm() {
  return 3 * std::log(kFarthest);
}

double size(const Misfit& misfit) {
  return std::hypot(misfit.torque, misfit.deflection);
}

RecordSet::RecordSet(const std::vector<ServoData>& data, double cutoff, double feedback) {
  for (const ServoData& d : data) {
    records_.emplace_back(d, cutoff, feedback);
    const PreparedServo& record = records_.back();
    noises_.push_back(record_noise(d));
    spreads_.push_back({spread(signal::low_pass(d.torque, d.interval, cutoff), record.counts), 0});
    if (d.load.empty()) continue;
    std::vector<double> deflection(d.size());
    for (std::size_t k = 0; k < d.size(); ++k) deflection[k] = d.motor[k] - d.load[k];
    spreads_.back().deflection = spread(signal::low_pass(deflection, d.interval, cutoff), record.settled);
  }
  weights_.resize(data.size());
  for (std::size_t r = 0; r < records_.size(); ++r) {
    for (std::size_t k = 0; k < data[r].size(); k += stride(records_[r])) {
      layout_.push_back({r, false, k, double(k) * data[r].interval});
      layout_.push_back({r, true, k, double(k) * data[r].interval});
    }
  }
}

RecordSet RecordSet::of_others(const std::vector<ServoData>& data) const {
  RecordSet others(data, records_.front().cutoff, records_.front().feedback);
  others.weights_ = weights_;
  return others;
}

double RecordSet::row_interval() const {
  return double(stride(records_[0])) * records_[0].data().interval;
}

void RecordSet::weigh(const Machine& machine) {
  for (std::size_t i = 0; i < records_.size(); ++i) {
    const PreparedServo& record = records_[i];
    const ServoResiduals r = record.residuals(machine.rig, machine.calibrations[i]);
    const NoiseFloors floor =
        noise_floors(machine.rig, record.data(), noises_[i], r.load->load, record.cutoff, record.feedback);
    weights_[i] = {machine.deflection_only ? INFINITY : std::max(floor.torque, rms(r.torque, record.counts)),
                   std::max(floor.deflection, rms(r.deflection, record.settled))};
  }
}

double RecordSet::difference_of_weights(const RecordSet& other) const {
  double largest = 0;
  const auto compare = [&](double a, double b) {
    if (std::isfinite(a) && std::isfinite(b) && b > 0) largest = std::max(largest, std::fabs(a / b - 1));
  };
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    compare(weights_[i].torque, other.weights_[i].torque);
    compare(weights_[i].deflection, other.weights_[i].deflection);
  }
  return largest;
}

Misfit RecordSet::misfit(const Machine& machine) const {
  Misfit sum;
  for (std::size_t i = 0; i < records_.size(); ++i) {
    const PreparedServo& record = records_[i];
    const ServoResiduals r = record.residuals(machine.rig, machine.calibrations[i]);
    const NoiseFloors floor =
        noise_floors(machine.rig, record.data(), noises_[i], r.load->load, record.cutoff, record.feedback);
    const double torque = std::max(floor.torque, kNegligible * spreads_[i].torque);
    const double torque_left = rms(r.torque, record.counts);
    sum.torque += std::pow(torque_left / torque, 2);
    if (spreads_[i].torque > 0) sum.torque_share += std::pow(torque_left / spreads_[i].torque, 2);
    if (r.deflection.empty()) continue;
    const double deflection = std::max(floor.deflection, kNegligible * spreads_[i].deflection);
    const double deflection_left = rms(r.deflection, record.settled);
    sum.deflection += std::pow(deflection_left / deflection, 2);
    if (spreads_[i].deflection > 0)
      sum.deflection_share += std::pow(deflection_left / spreads_[i].deflection, 2);
  }
  for (double* of : {&sum.torque, &sum.deflection, &sum.torque_share, &sum.deflection_share})
    *of = std::sqrt(*of / double(records_.size()));
  return sum;
}

Eigen::VectorXd RecordSet::rows(const model::Rig& rig, const std::vector<Calibration>& calibrations) const {
  Eigen::VectorXd rows(layout_.size());
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < records_.size(); ++i) {
    const PreparedServo& record = records_[i];
    const ServoResiduals r = record.residuals(rig, calibrations[i]);
    for (std::size_t k = 0; k < record.data().size(); k += stride(record)) {
      rows[next++] = record.counts[k] ? r.torque[k] / weights_[i].torque : 0;
      rows[next++] =
          record.settled[k] && !r.deflection.empty() ? r.deflection[k] / weights_[i].deflection : 0;
    }
  }
  return rows;
}

Eigen::VectorXd RecordSet::rows_of_torque(const std::vector<std::vector<double>>& torque) const {
  std::vector<std::vector<double>> smooth = torque;
  for (std::size_t i = 0; i < records_.size(); ++i) {
    for (std::size_t k = 0; k < smooth[i].size(); ++k)
      if (records_[i].direction[k] == 0) smooth[i][k] = 0;
    smooth[i] = signal::low_pass(smooth[i], records_[i].data().interval, records_[i].cutoff);
  }
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(Eigen::Index(layout_.size()));
  for (std::size_t i = 0; i < layout_.size(); ++i)
    if (const Row& r = layout_[i]; !r.deflection && records_[r.record].counts[r.sample])
      rows[Eigen::Index(i)] = smooth[r.record][r.sample] / weights_[r.record].torque;
  return rows;
}

void RecordSet::prepare(const std::vector<Machine>& machines) const {
  for (std::size_t i = 0; i < records_.size(); ++i) {
    std::vector<LoadAsked> asked;
    for (const Machine& machine : machines)
      if (!machine.rig.coupled) asked.push_back({machine.rig, machine.calibrations[i]});
    records_[i].prepare(asked);
  }
}

Unknowns::Unknowns(const Machine& start) : start_(start) {
  const double gap = start.rig.mesh.backlash / start.rig.mesh.lever(), place = gap > 0 ? gap : kDefaultGap;
  if (start.largest_delay > 0)
    of_record_.push_back({&Calibration::torque_delay, 1, start.largest_delay, start.largest_delay});
  if (!start.rig.mesh.rigid && !start.encoders_known)
    of_record_.push_back({&Calibration::encoder_offset, place, kVague * place});
  if (start.torque_offset > 0)
    of_record_.push_back({&Calibration::torque_offset, start.torque_offset, start.torque_offset});
  if (start.encoder_drift > 0)
    of_record_.push_back({&Calibration::encoder_drift, start.encoder_drift, start.encoder_drift});
}

Eigen::VectorXd Unknowns::values() const {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(size());
  for (std::size_t i = 0; i < start_.parameters.size(); ++i)
    if (!start_.parameters[i].positive) p[Eigen::Index(i)] = start_.parameters[i].get(start_.rig);
  for (std::size_t r = 0; r < records(); ++r)
    for (std::size_t i = 0; i < of_record_.size(); ++i) {
      const double value = start_.calibrations[r].*of_record_[i].at, most = of_record_[i].most;
      p[first_of(r) + Eigen::Index(i)] =
          std::isinf(most) ? value : most * std::atanh(std::clamp(value / most, -0.99, 0.99));
    }
  return p;
}

Eigen::VectorXd Unknowns::scale() const {
  Eigen::VectorXd s = Eigen::VectorXd::Ones(size());
  for (std::size_t i = 0; i < start_.parameters.size(); ++i)
    if (!start_.parameters[i].positive) s[Eigen::Index(i)] = start_.parameters[i].scale;
  for (std::size_t r = 0; r < records(); ++r)
    for (std::size_t i = 0; i < of_record_.size(); ++i)
      s[first_of(r) + Eigen::Index(i)] = of_record_[i].scale;
  return s;
}

model::Rig Unknowns::rig(const Eigen::VectorXd& values) const {
  model::Rig rig = start_.rig;
  for (std::size_t i = 0; i < start_.parameters.size(); ++i) {
    const FitParameter& p = start_.parameters[i];
    const double value = values[Eigen::Index(i)];
    p.set(rig, p.positive ? p.get(start_.rig) * std::exp(limited(value)) : value);
  }
  return rig;
}

std::vector<Calibration> Unknowns::calibrations(const Eigen::VectorXd& values) const {
  std::vector<Calibration> all = start_.calibrations;
  for (std::size_t r = 0; r < records(); ++r)
    for (std::size_t i = 0; i < of_record_.size(); ++i) {
      const double value = values[first_of(r) + Eigen::Index(i)], most = of_record_[i].most;
      all[r].*of_record_[i].at = std::isinf(most) ? value : most * std::tanh(value / most);
    }
  return all;
}

Eigen::VectorXd Unknowns::prior(const Eigen::VectorXd& values) const {
  Eigen::VectorXd sigma = kVague * scale();
  for (std::size_t i = 0; i < start_.parameters.size(); ++i)
    if (start_.parameters[i].positive) sigma[Eigen::Index(i)] = std::log(kFarthest);
  for (std::size_t r = 0; r < records(); ++r)
    for (std::size_t i = 0; i < of_record_.size(); ++i)
      sigma[first_of(r) + Eigen::Index(i)] = of_record_[i].deviation;
  return (values - this->values()).cwiseQuotient(sigma);
}

Machine Unknowns::machine(const Eigen::VectorXd& values) const {
  Machine m = start_;
  m.rig = rig(values);
  m.calibrations = calibrations(values);
  return m;
}

signal::Measured Unknowns::parameter(const MachineFit& fit, std::size_t i) const {
  signal::Measured m = fit.fit.parameter(Eigen::Index(i));
  const FitParameter& p = start_.parameters[i];
  if (!p.positive) return m;
  const double slope = 1 - std::pow(limited(m.value) / std::log(kFarthest), 2);
  m.value = p.get(start_.rig) * std::exp(limited(m.value));
  m.standard_error *= m.value * slope;
  if (fit.reach.size() > 0) m.standard_error = std::max(m.standard_error, fit.reach[Eigen::Index(i)]);
  return m;
}

std::optional<Eigen::Index> Unknowns::delay(std::size_t record) const {
  if (!(start_.largest_delay > 0)) return std::nullopt;
  return first_of(record);
}

signal::Measured Unknowns::torque_offset(const MachineFit& fit, std::size_t record) const {
  for (std::size_t i = 0; i < of_record_.size(); ++i)
    if (of_record_[i].at == &Calibration::torque_offset)
      return fit.fit.parameter(first_of(record) + Eigen::Index(i));
  return {fit.machine.calibrations[record].torque_offset, 0};
}

std::map<std::string, signal::Measured> Unknowns::parameters(const MachineFit& fit) const {
  std::map<std::string, signal::Measured> all;
  for (std::size_t i = 0; i < start_.parameters.size(); ++i)
    all[start_.parameters[i].name] = parameter(fit, i);
  return all;
}

MachineFit fit_machine(const Machine& start, const RecordSet& records, fit::NonlinearOptions options) {
  const Unknowns unknowns(start);
  options.ahead = ahead(unknowns, records);
  MachineFit out;
  out.fit = fit::fit_nonlinear([&](const Eigen::VectorXd& p) { return all_rows(unknowns, records, p); },
                               unknowns.values(), unknowns.scale(), options);
  out.machine = unknowns.machine(out.fit.values);
  return out;
}

void judge_errors(MachineFit& fit, const Machine& start, const RecordSet& records) {
  const Unknowns unknowns(start);
  const Eigen::Index known = unknowns.size() + Eigen::Index(start.priors.size()),
                     rows = fit.fit.residuals.size() - known;
  double longest = 0;  // s
  for (const PreparedServo& record : records.records())
    longest = std::max(longest, time_between_reversals(record.data()));
  const Eigen::Index wanted = std::max(1L, 2 * std::lround(longest / records.row_interval()));
  const Eigen::Index block = std::clamp<Eigen::Index>(rows / (kFewestBlocks * unknowns.size()), 1, wanted);
  const Eigen::VectorXd independent = fit.fit.covariance.diagonal();
  take_larger(fit.fit.covariance, signal::block_covariance(fit.fit, block, known));
  fit.reach = reach_of_values(
      fit, start, [&](const Eigen::VectorXd& p) { return all_rows(unknowns, records, p); }, rows,
      median_growth(fit.fit.covariance.diagonal(), independent));
  const double free = double(rows) / double(block) - double(unknowns.size());  // degrees of freedom
  fit.fit.covariance *=
      std::pow(signal::student_t_quantile(0.975, std::max(1.0, free)) / signal::kNormalQuantile975, 2);
  add_timing(fit, start, records.records().front().data().interval);
  add_equations(fit, start);
  const Eigen::VectorXd edge = shift_of_contact_edge(fit, records);
  fit.fit.covariance += edge * edge.transpose();
  const auto [bias, rounding] = sampling_effect(fit, records);
  fit.fit.values -= bias;
  fit.machine = unknowns.machine(fit.fit.values);
  fit.fit.covariance += std::pow(kUnsureOfSampling, 2) * bias * bias.transpose() + rounding;
  if (start.rig.coupled)
    allow_for_left(
        fit.fit, rows,
        fit.fit.residuals.head(rows).norm() * share_beyond_noise(records.misfit(fit.machine).deflection));
}

void allow_for_misfit(MachineFit& fit, const RecordSet& records) {
  const Misfit misfit = records.misfit(fit.machine);
  if (fit.machine.rig.coupled || std::max(misfit.torque, misfit.deflection) <= kShowsMissingEffect) return;
  const std::vector<RecordSet::Row>& layout = records.layout();
  const Eigen::Index n = fit.fit.values.size(), rows = Eigen::Index(layout.size());
  // Rows of the records and of priors for values that these do not determine; what procedures found in the
  // same records is no more certain.
  const Eigen::MatrixXd j = fit.fit.jacobian.topRows(rows + n);
  const Eigen::MatrixXd gain = signal::symmetric_inverse(j.transpose() * j) * j.topRows(rows).transpose();
  Eigen::VectorXd drawn = Eigen::VectorXd::Zero(n);
  double all_left = 0;
  for (const bool deflection : {false, true}) {
    const double in_floors = deflection ? misfit.deflection : misfit.torque;
    if (in_floors <= kShowsMissingEffect) continue;
    double squares = 0;
    Eigen::VectorXd gains = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (layout[std::size_t(i)].deflection != deflection) continue;
      squares += std::pow(fit.fit.residuals[i], 2);
      gains += gain.col(i).cwiseAbs2();
    }
    const double left = share_beyond_noise(in_floors) * std::sqrt(squares);
    drawn += kDrawn * left * gains.cwiseSqrt();
    all_left = std::hypot(all_left, left);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const double alone = j.col(i).head(rows).norm(), vague = j.col(i).tail(n).norm();
    if (all_left > 0) drawn[i] = std::max(drawn[i], 1 / std::hypot(alone / all_left, vague));
  }
  const Eigen::VectorXd growth = drawn.cwiseQuotient(fit.fit.covariance.diagonal().cwiseSqrt()).cwiseMax(1);
  fit.fit.covariance = growth.asDiagonal() * fit.fit.covariance * growth.asDiagonal();
}

}  // namespace backlash::identification
