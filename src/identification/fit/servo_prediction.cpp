// SPDX-License-Identifier: BSD-3-Clause
// Torque and deflection that a rig predicts for a record, and the residuals.
#include "servo_prediction.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/presliding.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kEnds = 3;  // theory: periods of the cutoff at either end, where the filter has not settled
constexpr double kStarts =
    12;  // theory: time constants of the feedback: of the load's start exp(-12) is left
constexpr double kSureSpeed = 5;   // choice: standard deviations of the motor speed, from which it has a sign
constexpr double kMemory = 0.5;    // theory: periods of its cutoff that a low-pass mixes
constexpr double kSureJump = 4;    // theory: standard deviations of noise, which hardly any of 10^4 passes
constexpr double kBridged = 0.05;  // theory: of a period, over which a cubic is off by 2e-4

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
  const double slowest = kSureSpeed * data.rate_noise;
  const long n = static_cast<long>(data.size());
  std::vector<int> direction(n), sure(n);
  for (long k = 0; k < n; ++k)
    direction[k] = (data.motor_rate[k] > slowest) - (data.motor_rate[k] < -slowest);
  for (long k = 0; k < n; ++k) {
    sure[k] = direction[k];
    for (long j = std::max(0L, k - data.rate_reach); j <= std::min(n - 1, k + data.rate_reach); ++j)
      if (direction[j] != direction[k]) sure[k] = 0;
  }
  return sure;
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> out(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) out[k] = a[k] - b[k];
  return out;
}

/// Over the samples that count.
ChannelError relative(const std::vector<double>& measured, const std::vector<double>& predicted,
                      const std::vector<char>& counts, double floor) {
  double n = 0, sum = 0, square = 0, residual = 0;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (!counts[k]) continue;
    ++n;
    sum += measured[k];
    square += measured[k] * measured[k];
    residual += std::pow(measured[k] - predicted[k], 2);
  }
  const double spread = std::sqrt(square - sum * sum / n);
  return {std::sqrt(residual) / spread, floor * std::sqrt(n) / spread};
}

}  // namespace

/// How a rig's load is driven by a record.
struct Drive {
  simulation::RecordedMotion motion;
  double gain = 1;               // of the load encoder
  double skew = 0;               // samples, by which it is late
  double offset = 0, drift = 0;  // rad, rad/s, of the encoders
  std::vector<double> changed;   // column that is not as recorded

  Drive(const ServoData& data, const model::Rig& rig, const Calibration& calibration)
      : offset(calibration.encoder_offset), drift(calibration.encoder_drift) {
    motion.interval = data.interval;
    motion.start = data.start;
    motion.motor = &data.motor;
    motion.motor_rate = &data.motor_rate;
    if (!data.smooth_acceleration.empty()) motion.acceleration = &data.smooth_acceleration;
    if (simulation::load_moves_freely(rig)) {
      gain = model::sensing(rig.terms).load_position_gain;
      skew = rig.encoder_skew / data.interval;
      motion.load_rate = &data.load_rate;
      motion.first_load = (data.first_load + rig.encoder_skew * data.first_load_rate - offset) / gain;
      motion.first_load_rate = data.first_load_rate / gain;
    } else if (offset != 0 || drift != 0) {  // of teeth that press, which a low-pass would round off
      changed = data.teeth_recorded ? data.recorded_motor : data.motor;
      const double middle = 0.5 * double(changed.size());
      for (std::size_t k = 0; k < changed.size(); ++k)
        changed[k] += offset - drift * data.interval * (double(k) - middle);
      motion.motor = &changed;
    }
  }
  Drive(const Drive&) = delete;  // points into itself

  /// The load's speed as an encoder without error would show it, which only a simulation needs.
  void correct_load_rate() {
    if (!motion.load_rate || (gain == 1 && skew == 0)) return;
    changed = signal::delayed(*motion.load_rate, -skew);
    for (double& rate : changed) rate /= gain;
    motion.load_rate = &changed;
  }
};

struct SimulatedLoad {
  model::Rig acting;  // of the rig what acts on its load
  double gain, skew, offset, drift;
  simulation::DrivenLoad motion;
  std::vector<double> deflection;  // simulated load as shown minus recorded, without offset, low-passed
};

/// Loads that are simulated together: encoders with the same error, so that the same speed draws them.
struct LoadGroup {
  double gain, skew;
  std::vector<model::Rig> rigs;
  std::vector<Calibration> calibrations;
  std::vector<double> first_loads;
};

namespace {

std::shared_ptr<const SimulatedLoad> simulated_load(const PreparedServo& record, const Drive& drive,
                                                    const model::Rig& rig, double offset,
                                                    simulation::DrivenLoad motion) {
  auto made = std::make_shared<SimulatedLoad>(SimulatedLoad{
      simulation::acting_on_load(rig), drive.gain, drive.skew, offset, drive.drift, std::move(motion), {}});
  if (!simulation::load_moves_freely(rig)) return made;
  const ServoData& data = record.data();
  std::vector<double> difference = signal::delayed(made->motion.load, drive.skew);
  for (std::size_t k = 0; k < data.size(); ++k) difference[k] = drive.gain * difference[k] - data.load[k];
  made->deflection = signal::low_pass(difference, data.interval, record.cutoff);
  return made;
}

std::vector<std::shared_ptr<const SimulatedLoad>> simulated_loads(const PreparedServo& record,
                                                                  const LoadGroup& group) {
  Drive drive(record.data(), group.rigs.front(), group.calibrations.front());
  drive.correct_load_rate();
  std::vector<simulation::DrivenLoad> motions =
      simulation::simulate_driven_loads(group.rigs, group.first_loads, drive.motion, record.feedback);
  std::vector<std::shared_ptr<const SimulatedLoad>> made;
  for (std::size_t i = 0; i < motions.size(); ++i)
    made.push_back(simulated_load(record, drive, group.rigs[i], group.calibrations[i].encoder_offset,
                                  std::move(motions[i])));
  return made;
}

}  // namespace

/// The last loads that were simulated, the last that was asked for first.
class SimulatedLoads {
 public:
  std::shared_ptr<const SimulatedLoad> get(const PreparedServo& record, Drive& drive, const model::Rig& rig) {
    if (auto known = find(simulation::acting_on_load(rig), drive)) return known;
    drive.correct_load_rate();
    const auto made = simulated_load(record, drive, rig, drive.offset,
                                     simulation::simulate_driven_load(rig, drive.motion, record.feedback));
    keep(made);
    return made;
  }

  /// Those that are not known yet; what cannot be simulated is left to whoever asks for it.
  void prepare(const PreparedServo& record, const std::vector<LoadAsked>& asked) {
    std::vector<LoadGroup> groups;
    std::vector<std::pair<model::Rig, double>> seen;  // with the offset of the encoders
    for (const auto& [rig, calibration] : asked) {
      if (!simulation::load_moves_freely(rig)) continue;
      const Drive drive(record.data(), rig, calibration);
      std::pair<model::Rig, double> load = {simulation::acting_on_load(rig), drive.offset};
      if (find(load.first, drive) || std::find(seen.begin(), seen.end(), load) != seen.end()) continue;
      seen.push_back(std::move(load));
      const auto joins = [&](const LoadGroup& g) {
        return g.gain == drive.gain && g.skew == drive.skew && g.rigs.size() < simulation::loads_at_once();
      };
      auto group = std::find_if(groups.begin(), groups.end(), joins);
      if (group == groups.end()) group = groups.insert(group, LoadGroup{drive.gain, drive.skew, {}, {}, {}});
      group->rigs.push_back(rig);
      group->calibrations.push_back(calibration);
      group->first_loads.push_back(drive.motion.first_load);
    }
    for_each_in_parallel(int(groups.size()), [&](int i) {
      try {
        for (auto& load : simulated_loads(record, groups[std::size_t(i)])) keep(std::move(load));
      } catch (const Error&) {
      }
    });
  }

 private:
  // So that a Jacobian's columns find the load of its centre, and those that were prepared.
  static constexpr std::size_t kKept = fit::kPointsAtOnce + 2;

  std::shared_ptr<const SimulatedLoad> find(const model::Rig& acting, const Drive& drive) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto at = kept_.begin(); at != kept_.end(); ++at) {
      const SimulatedLoad& known = **at;
      if (known.gain != drive.gain || known.skew != drive.skew || known.offset != drive.offset ||
          known.drift != drive.drift || !(known.acting == acting))
        continue;
      kept_.splice(kept_.begin(), kept_, at);
      return kept_.front();
    }
    return nullptr;
  }

  void keep(std::shared_ptr<const SimulatedLoad> made) {
    const std::lock_guard<std::mutex> lock(mutex_);
    kept_.push_front(std::move(made));
    if (kept_.size() > kKept) kept_.pop_back();
  }

  std::mutex mutex_;
  std::list<std::shared_ptr<const SimulatedLoad>> kept_;
};

PreparedServo::PreparedServo(const ServoData& servo, double low_pass_cutoff, double load_feedback)
    : cutoff(low_pass_cutoff),
      feedback(load_feedback),
      direction(sliding(servo)),
      data_(&servo),
      loads_(std::make_shared<SimulatedLoads>()) {
  torque_of_moment_ = over_second_difference(servo.torque);
  torque_held_ = held_over_second_difference(servo.torque);
  const long n = static_cast<long>(servo.size()), ends = std::lround(kEnds / (cutoff * servo.interval));
  const bool drawn = feedback > 0 && !servo.load.empty();
  const long begin = drawn ? std::max(ends, std::lround(kStarts / (feedback * servo.interval))) : ends;
  counts.assign(n, 0);
  settled.assign(n, 0);
  for (long k = begin; k < n - ends; ++k) {
    settled[k] = 1;
    counts[k] = direction[k] != 0;
  }
  leave_out_lost(drawn);
}

/// Between the ends of what was lost the positions go on by a cubic, and the torque on a line. Low-passed
/// that is off by less than the noise of the torque, unless it jumps there: by more than noise it changes
/// otherwise than beside.
bool PreparedServo::is_bridged(long begin, long end, double torque_noise) const {
  const std::vector<double>& torque = data_->torque;
  if (begin < 2 || end + 1 >= long(torque.size())) return false;
  const double *first = &torque[std::size_t(begin) - 1], *last = &torque[std::size_t(end)];
  const double steps = double(end - begin + 1), beside = 0.5 * (first[0] - first[-1] + last[1] - last[0]);
  const double noise = torque_noise * std::hypot(1 + 0.5 * steps, 0.5 * steps) * std::sqrt(2);
  const double jump = std::max(0.0, std::fabs(*last - *first - steps * beside) - kSureJump * noise);
  const double period = cutoff * data_->interval;  // of a sample
  return steps * period <= kBridged && jump * steps * period <= torque_noise * std::sqrt(2 * period);
}

/// Left out: what was not recorded, and what a low-pass makes of it. Where teeth drive a load every sample
/// moves it, and after more than one that was lost its motion is left out too; else short gaps are bridged.
void PreparedServo::leave_out_lost(bool drawn) {
  const std::vector<bool>& lost = data_->lost;
  if (std::find(lost.begin(), lost.end(), true) == lost.end()) return;
  const double noise = signal::noise_from_differences(data_->torque, 4);
  const long n = static_cast<long>(lost.size());
  const long memory = data_->rate_reach + std::lround(kMemory / (cutoff * data_->interval));
  for (long begin = 0, end = 0; begin < n; begin = end) {
    end = begin + 1;
    if (!lost[std::size_t(begin)]) continue;
    while (end < n && lost[std::size_t(end)]) ++end;
    const long before = !drawn && is_bridged(begin, end, noise) ? 0 : memory,
               behind =
                   drawn && end - begin > 1 ? std::lround(kStarts / (feedback * data_->interval)) : before;
    for (long k = std::max(0L, begin - before); k < std::min(n, end + behind); ++k)
      settled[std::size_t(k)] = counts[std::size_t(k)] = 0;
  }
}

void PreparedServo::prepare(const std::vector<LoadAsked>& asked) const {
  loads_->prepare(*this, asked);
}

std::vector<double> PreparedServo::acting_torque(const model::Rig& rig,
                                                 const Calibration& calibration) const {
  const double delay = calibration.torque_delay + model::sensing(rig.terms).torque_delay / data().interval;
  return signal::delayed(calibration.held ? torque_held_ : torque_of_moment_, delay);
}

/// Of a machine whose torque holds the coupling of other axes. That torque, less what the motor takes, goes
/// through the teeth all the same:
///   q_L = q_M - e(tau - J_M a_M - friction)
/// so that the load's position follows, and the torque itself cannot be predicted.
ServoResiduals PreparedServo::coupled_residuals(const model::Rig& rig, const Calibration& calibration) const {
  const ServoData& d = data();
  const model::GearTrain train(rig);
  const double inertia = train.motor_inertia(), slowest = kSureSpeed * d.rate_noise;
  simulation::DrivenLoad load;
  load.load = d.motor;
  load.load_rate = d.load_rate;
  load.mesh_torque = signal::low_pass(acting_torque(rig, calibration), d.interval, cutoff);
  const std::vector<double> acceleration = signal::low_pass(d.motor_acceleration, d.interval, cutoff);
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double rate = d.motor_rate[k], sign = std::fabs(rate) > slowest ? (rate > 0 ? 1 : -1) : 0;
    load.mesh_torque[k] -=
        inertia * acceleration[k] + rig.motor.viscous_damping * rate + rig.motor.coulomb_friction * sign;
    load.load[k] -= train.elastic_deflection(load.mesh_torque[k]);
  }
  load.mesh_on_motor = load.mesh_torque;
  ServoResiduals r;
  r.deflection = signal::delayed(load.load, rig.encoder_skew / d.interval);
  for (std::size_t k = 0; k < d.size(); ++k) r.deflection[k] -= d.load[k];
  r.deflection = signal::low_pass(r.deflection, d.interval, cutoff);
  for (double& value : r.deflection) value += calibration.encoder_offset;
  r.torque.assign(d.size(), 0.0);
  r.predicted_torque = r.torque;
  r.mesh_torque = load.mesh_torque;
  r.load = std::make_shared<const simulation::DrivenLoad>(std::move(load));
  return r;
}

ServoResiduals PreparedServo::residuals(const model::Rig& rig, const Calibration& calibration) const {
  if (rig.coupled) return coupled_residuals(rig, calibration);
  Drive drive(data(), rig, calibration);
  const auto load = loads_->get(*this, drive, rig);
  simulation::MotorTorques motor = simulation::motor_torques(rig, drive.motion, load->motion);
  const double inertia = model::GearTrain(rig).motor_inertia();
  ServoResiduals r;
  r.load = {load, &load->motion};
  r.mesh_torque = std::move(motor.mesh_torque);
  r.torque = acting_torque(rig, calibration);
  const std::vector<double> friction =
      model::presliding_friction(data().motor, motor.friction, data().motor_rate, data().interval);
  r.predicted_torque.assign(data().size(), 0);
  for (std::size_t k = 0; k < data().size(); ++k) {
    if (direction[k] == 0) {
      r.torque[k] = 0;  // friction takes what balances
      continue;
    }
    r.predicted_torque[k] =
        inertia * data().motor_acceleration[k] - motor.mean[k] + friction[k] + calibration.torque_offset;
    r.torque[k] -= r.predicted_torque[k];
  }
  r.torque = signal::low_pass(r.torque, data().interval, cutoff);
  r.deflection = load->deflection;
  for (double& value : r.deflection) value += calibration.encoder_offset;
  return r;
}

namespace {

constexpr double kLeastCounts = 0.5;  // choice: of the low-pass's weight, on samples that count

/// Measured and predicted torque low-passed apart, by what each shows where the motor slides: the prediction
/// holds nothing of the record's torque.
void low_pass_torques(const PreparedServo& prepared, const std::vector<double>& acting,
                      const std::vector<double>& predicted, ServoPrediction& p) {
  const double interval = prepared.data().interval;
  const std::size_t n = acting.size();
  std::vector<double> slides(n), measured(n);
  for (std::size_t k = 0; k < n; ++k) {
    slides[k] = prepared.direction[k] != 0;
    measured[k] = slides[k] * acting[k];
  }
  const std::vector<double> weight = signal::low_pass(slides, interval, prepared.cutoff);
  p.measured_torque = signal::low_pass(measured, interval, prepared.cutoff);
  p.torque = signal::low_pass(predicted, interval, prepared.cutoff);
  for (std::size_t k = 0; k < n; ++k) {
    p.counts[k] = p.counts[k] && weight[k] >= kLeastCounts;
    if (!p.counts[k]) continue;
    p.measured_torque[k] /= weight[k];
    p.torque[k] /= weight[k];
  }
}

}  // namespace

ServoPrediction predict_servo(const model::Rig& rig, const ServoData& data, const FitSettings& settings,
                              const Calibration& calibration) {
  if (!(settings.cutoff > 0)) throw InvalidParameter("cutoff", settings.cutoff, "must be > 0 Hz");
  const PreparedServo prepared(data, settings.cutoff, settings.feedback);
  ServoResiduals r = prepared.residuals(rig, calibration);
  ServoPrediction p;
  p.counts = prepared.counts;
  p.settled = prepared.settled;
  const NoiseFloors floors =
      noise_floors(rig, data, record_noise(data), r.load->load, settings.cutoff, settings.feedback);
  p.torque_floor = floors.torque;
  low_pass_torques(prepared, prepared.acting_torque(rig, calibration), r.predicted_torque, p);
  p.torque_error = relative(p.measured_torque, p.torque, p.counts, p.torque_floor);
  if (!r.deflection.empty()) {
    p.deflection_floor = floors.deflection;
    p.measured_deflection =
        signal::low_pass(difference(data.motor, data.load), data.interval, settings.cutoff);
    p.deflection = difference(p.measured_deflection, r.deflection);
    p.deflection_error = relative(p.measured_deflection, p.deflection, p.settled, p.deflection_floor);
  }
  p.load = *r.load;
  p.load.mesh_torque = std::move(r.mesh_torque);
  return p;
}

}  // namespace backlash::identification
