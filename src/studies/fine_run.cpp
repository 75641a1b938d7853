// SPDX-License-Identifier: BSD-3-Clause
#include "fine_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/simulation/ensemble.h"

namespace backlash::studies {
namespace {

constexpr double kRelativeNoise[] = {0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3};  // of the signal's scale
constexpr double kFinestSampling = 1e5;                                           // Hz
constexpr int kMostPhases = 16;
constexpr double kFewestPerPeriod = 16;  // samples
constexpr double kMostSamples = 5e7;     // of one run, about 1 GB

double signal_of(const model::Observation& o, record::Channel channel) {
  switch (channel) {
    case record::Channel::motor_torque:
      return o.motor_torque;
    case record::Channel::motor_position:
      return o.motor_position;
    case record::Channel::motor_velocity:
      return o.motor_velocity;
    case record::Channel::load_position:
      return o.load_position;
    case record::Channel::load_velocity:
      return o.load_velocity;
    case record::Channel::sensor_torque:
      return o.sensor_torque;
    case record::Channel::output_torque:
      return o.output_torque;
    case record::Channel::motor_current:
      return o.motor_current;
    case record::Channel::acceleration:
      return o.acceleration;
    case record::Channel::reference_position:
      break;
  }
  return kNaN;
}

void append(const CurvePlan& plan, const model::Observation& o, FineRun& run) {
  run.signal.push_back(signal_of(o, plan.apd.signal));
  run.torque.push_back(o.motor_torque);
  run.position.push_back(o.motor_position);
}

double fine_samples(const CurvePlan& plan) {
  return static_cast<double>(plan.run_periods()) * plan.apd.period * plan.request.sampling_rate *
             plan.phases +
         plan.phases;
}

/// Moves `machines` from sample to sample and calls `take` at each, `period` after each period.
template <typename Machines, typename Take, typename Period>
void sample_finely(const CurvePlan& plan, Machines& machines, const Take& take, const Period& period) {
  const double rate = plan.request.sampling_rate * plan.phases;
  const long count = std::lround(fine_samples(plan)), periods = plan.run_periods();
  for (long k = 0; k < count; ++k) {
    machines.advance_to(double(k) / rate);
    take();
    if ((k + 1) * periods / count > k * periods / count) period();
  }
}

void check(const CurveRequest& request) {
  if (request.points < 2) throw InvalidParameter("points", request.points, "must be >= 2");
  if (!(request.max_backlash > 0 && std::isfinite(request.max_backlash)))
    throw InvalidParameter("max_backlash", request.max_backlash, "must be > 0 and finite");
  if (request.periods < 1) throw InvalidParameter("periods", request.periods, "must be >= 1");
  if (request.machines < 0) throw InvalidParameter("machines", request.machines, "must be >= 0");
  if (request.seeds < 1) throw InvalidParameter("seeds", request.seeds, "must be >= 1");
  if (!(request.sampling_rate > 0 && std::isfinite(request.sampling_rate)))
    throw InvalidParameter("sample_rate", request.sampling_rate, "must be > 0 Hz and finite");
}

double largest_torque(const simulation::ExcitationSettings& excitation) {
  double largest = excitation.amplitude;
  for (const simulation::SineLine& line : excitation.lines) largest += line.amplitude;
  return largest;
}

void check_signal(const rig_file::RigFile& file, record::Channel signal) {
  if (file.rig.input_coupling.rigid && signal == record::Channel::sensor_torque)
    throw InvalidParameter("diagnosis.apd.signal", "sensor_torque",
                           "the rig's input coupling is rigid: no sensor");
  if (std::isnan(file.rig.torque_constant) && signal == record::Channel::motor_current)
    throw InvalidParameter("diagnosis.apd.signal", "motor_current",
                           "needs gear_train.motor.torque_constant (N m/A)");
}

/// What noise is counted by, in the unit of the signal: for a torque the largest that the motor applies, for
/// another signal its own rms value at the largest backlash.
double signal_scale(CurvePlan plan) {
  if (std::string(record::channel_unit(plan.apd.signal)) ==
      record::channel_unit(record::Channel::motor_torque))
    return largest_torque(plan.file.simulation.excitation);
  plan.request.periods = 1;
  const Progress nobody;
  Ticker quiet(nobody, 1, "");
  double squares = 0;
  const FineRun run = std::move(
      run_fine(plan, {with_backlash(declared_machine(plan.file), plan.request.max_backlash)}, quiet).front());
  for (const double value : run.signal) squares += value * value;
  return std::sqrt(squares / static_cast<double>(run.signal.size()));
}

}  // namespace

CurvePlan plan_curve(const rig_file::RigFile& file, CurveRequest request) {
  if (!file.diagnosis.apd)
    throw InvalidParameter("diagnosis.apd", "absent", "a curve needs the layout of its APD");
  if (request.sampling_rate == 0) request.sampling_rate = file.simulation.sensors.sampling_rate;
  check(request);
  CurvePlan plan{file, request, *file.diagnosis.apd, 1, {}};
  const double period = file.simulation.excitation.create()->period();
  if (!(period > 0))
    throw InvalidParameter("excitation.type", file.simulation.excitation.type,
                           "a curve needs a periodic excitation");
  if (!(plan.apd.period > 0)) plan.apd.period = period;
  check_signal(file, plan.apd.signal);
  if (!(request.sampling_rate * plan.apd.period >= kFewestPerPeriod))
    throw InvalidParameter("sample_rate", request.sampling_rate,
                           "must give at least 16 samples per period of " + to_text(plan.apd.period) + " s");
  plan.phases = std::clamp(static_cast<int>(kFinestSampling / request.sampling_rate), 1, kMostPhases);
  if (!(fine_samples(plan) <= kMostSamples))
    throw InvalidParameter("periods", request.periods, "too many samples at this sampling rate");
  const double declared = file.simulation.sensors.of(plan.apd.signal).noise;
  const double scale = signal_scale(plan);
  for (const double share : kRelativeNoise) plan.noise_levels.push_back(share * scale);
  plan.noise_levels.push_back(declared);
  std::sort(plan.noise_levels.begin(), plan.noise_levels.end());
  plan.noise_levels.erase(std::unique(plan.noise_levels.begin(), plan.noise_levels.end()),
                          plan.noise_levels.end());
  return plan;
}

Machine with_backlash(Machine machine, double backlash) {
  machine.rig.mesh.backlash = backlash;
  return machine;
}

std::vector<FineRun> run_fine(const CurvePlan& plan, const std::vector<Machine>& machines, Ticker& ticker) {
  const simulation::SimulationSettings& how = plan.file.simulation;
  std::vector<FineRun> runs(machines.size());
  std::vector<model::Rig> rigs;
  for (const Machine& machine : machines) rigs.push_back(machine.rig);
  if (simulation::Ensemble::takes(rigs, how.excitation)) {
    simulation::Ensemble ensemble(rigs, how.excitation, how.solver);
    sample_finely(
        plan, ensemble,
        [&] {
          for (std::size_t i = 0; i < runs.size(); ++i) append(plan, ensemble.observe(i), runs[i]);
        },
        [&] {
          for (std::size_t i = 0; i < runs.size(); ++i) ticker.tick();
        });
  } else {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      simulation::Plant plant(rigs[i], how.excitation, how.solver);
      sample_finely(
          plan, plant, [&] { append(plan, plant.observe(), runs[i]); }, [&] { ticker.tick(); });
    }
  }
  if (plan.apd.signal == record::Channel::sensor_torque)
    for (std::size_t i = 0; i < runs.size(); ++i)
      machines[i].sensor.apply(runs[i].signal, 1 / (plan.request.sampling_rate * plan.phases));
  return runs;
}

std::vector<double> sample(const CurvePlan& plan, const FineRun& run, int phase, int seed, double noise) {
  simulation::SensorsSettings sensors = plan.file.simulation.sensors;
  sensors.seed += static_cast<std::uint64_t>(seed);
  sensors.of(plan.apd.signal).noise = noise;
  simulation::SensorModel sensor(sensors);
  std::vector<double> values;
  for (std::size_t i = phase; i < run.signal.size(); i += plan.phases)
    values.push_back(sensor.measure(plan.apd.signal, run.signal[i]));
  return values;
}

}  // namespace backlash::studies
