// SPDX-License-Identifier: BSD-3-Clause
#include "sampling.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "backlash_diagnosis/simulation/plant.h"

namespace backlash::identification {
namespace {

constexpr double kControl = 0.25;     // choice: of the feedback: slow next to the mesh, fast next to a drift
constexpr int kPieces = 4;            // choice: per sample, of a torque that is not held
constexpr double kTolerance = 1e-10;  // simulation: 1e-6 makes the damping of the teeth 0.07 % too large

/// The torque of each sample: as recorded and what keeps the machine on its way, decided when it first acts.
class Command {
 public:
  Command(const ServoData& data, double delay, bool held) : torque(data.torque), delay_(delay), held_(held) {}

  /// N m, `at` [samples] in the middle of a piece.
  double acting(double at, double correction) {
    const double stamp = at - delay_, before = std::floor(stamp);
    const double first = of(long(before), correction);
    return held_ ? first : first + (stamp - before) * (of(long(before) + 1, correction) - first);
  }
  /// Ends of the pieces of a sample, 0 to 1, in which the torque is taken for constant.
  std::vector<double> pieces() const {
    std::vector<double> ends;
    if (held_) {
      ends = {delay_ - std::floor(delay_), 1};
      if (ends.front() == 0) ends.erase(ends.begin());
    } else {
      for (int i = 1; i <= kPieces; ++i) ends.push_back(double(i) / kPieces);
    }
    return ends;
  }

  std::vector<double> torque;

 private:
  double of(long sample, double correction) {
    const long at = std::clamp(sample, 0L, long(torque.size()) - 1);
    for (; decided_ <= at; ++decided_) torque[decided_] += correction;
    return torque[at];
  }

  double delay_;
  bool held_;
  long decided_ = 0;
};

simulation::SolverSettings solver(const model::Rig& rig, const ServoData& data) {
  double largest = 0;
  for (std::size_t k = 0; k < data.size(); ++k)
    largest = std::max(largest, std::fabs(data.motor[k] - data.load[k] - data.motor[0] + data.load[0]));
  simulation::SolverSettings settings;
  settings.relative_tolerance = kTolerance;
  settings.position_tolerance = kTolerance * largest;
  settings.velocity_tolerance =
      settings.position_tolerance * 2 * M_PI * mesh_resonance(rig, model::usual_torque(data.torque));
  return settings;
}

}  // namespace

ServoData sampled_machine(const model::Rig& fitted, const ServoData& data, const Calibration& calibration,
                          double feedback) {
  const model::Rig rig = model::load_side(fitted);
  const model::Sensing sensing = model::sensing(rig.terms);
  simulation::ExcitationSettings by_command;
  by_command.type = "topic";
  simulation::Plant plant(rig, by_command, solver(rig, data));
  const double h = data.interval, skew = rig.encoder_skew / h;
  plant.set_state({data.motor[0],
                   (data.first_load + rig.encoder_skew * data.first_load_rate - calibration.encoder_offset) /
                       sensing.load_position_gain,
                   data.motor_rate[0], data.first_load_rate / sensing.load_position_gain});
  Command command(data, calibration.torque_delay + sensing.torque_delay / h, calibration.held);
  const double inertia = plant.gear_train().motor_inertia() + plant.gear_train().load_inertia(),
               frequency = kControl * feedback;  // rad/s
  std::vector<double> motor, load;
  for (std::size_t k = 0; k < data.size(); ++k) {
    const simulation::Plant::State& now = plant.state();
    motor.push_back(now[0]);
    load.push_back(now[1]);
    const double correction =
        inertia * frequency * (frequency * (data.motor[k] - now[0]) + 2 * (data.motor_rate[k] - now[2]));
    double start = 0;
    for (const double end : command.pieces()) {
      const double until = (double(k) + end) * h;
      plant.set_torque(command.acting(double(k) + 0.5 * (start + end), correction), until);
      plant.advance_to(until);
      start = end;
    }
  }
  load = signal::delayed(load, skew);
  for (double& q : load) q = sensing.load_position_gain * q + calibration.encoder_offset;
  return with_columns(data, std::move(command.torque), std::move(motor), std::move(load));
}

namespace {

constexpr int kPhases = 4;  // choice (time): of the grid of an encoder

/// Of an encoder: rad, 0 where its white noise is more than what rounding leaves, and dithers it.
double grid_of(const std::vector<double>& position) {
  const double step = signal::resolution(position);
  return signal::position_noise(position) < 2 * step / std::sqrt(12.0) ? step : 0;
}

std::vector<double> rounded(std::vector<double> position, double step, double phase) {
  if (step > 0)
    for (double& q : position) q = step * (std::round(q / step + phase) - phase);
  return position;
}

/// Values that the fit finds in records of its own machine, minus the true ones.
Eigen::VectorXd moved_by(const std::vector<ServoData>& data, const MachineFit& fit,
                         const RecordSet& records) {
  const Eigen::VectorXd rows = records.of_others(data).rows(fit.machine.rig, fit.machine.calibrations);
  const Eigen::MatrixXd& jacobian = fit.fit.jacobian;
  const Eigen::VectorXd unit = jacobian.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = jacobian * unit.asDiagonal();
  return -unit.cwiseProduct(
      signal::solve_symmetric(signal::gram(scaled), scaled.topRows(rows.size()).transpose() * rows));
}

}  // namespace

SamplingEffect sampling_effect(const MachineFit& fit, const RecordSet& records) {
  const Machine& machine = fit.machine;
  const Eigen::Index n = fit.fit.values.size();
  SamplingEffect effect = {Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  if (!simulation::load_moves_freely(machine.rig) || !machine.rig.output_coupling.rigid ||
      machine.rig.coupled || machine.deflection_only)
    return effect;
  std::vector<ServoData> sampled;
  std::vector<double> motor_steps, load_steps;
  try {
    for (std::size_t i = 0; i < records.records().size(); ++i) {
      const PreparedServo& record = records.records()[i];
      sampled.push_back(
          sampled_machine(machine.rig, record.data(), machine.calibrations[i], record.feedback));
      motor_steps.push_back(grid_of(record.data().motor));
      load_steps.push_back(grid_of(record.data().load));
    }
  } catch (const IntegrationError&) {
    return effect;
  }
  effect.bias = moved_by(sampled, fit, records);
  for (int i = 0; i < kPhases; ++i) {
    const double phase = (i + 0.5) / kPhases - 0.5;
    std::vector<ServoData> read;
    for (std::size_t r = 0; r < sampled.size(); ++r)
      read.push_back(with_columns(sampled[r], sampled[r].torque,
                                  rounded(sampled[r].motor, motor_steps[r], -phase),
                                  rounded(sampled[r].load, load_steps[r], phase)));
    const Eigen::VectorXd moved = moved_by(read, fit, records) - effect.bias;
    effect.rounding += moved * moved.transpose() / kPhases;
  }
  return effect;
}

}  // namespace backlash::identification
