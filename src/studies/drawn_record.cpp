// SPDX-License-Identifier: BSD-3-Clause
#include "drawn_record.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"

namespace backlash::studies {
namespace {

constexpr int kPhases = 16;  // starts of a record between two samples

/// Every kPhases-th sample of a record from `start` [s] on, as a recorder that begins there gives them.
record::Record thinned(const record::Record& fine, double start, double rate, std::size_t count) {
  record::Record record;
  record.name = "study";
  const auto first = static_cast<std::size_t>(start * rate * kPhases);
  for (std::size_t k = 0; k < count && first + k * kPhases < fine.size(); ++k) {
    record.time.push_back(static_cast<double>(k) / rate);
    for (const record::Channel channel : record::kChannels)
      if (fine.has(channel)) record.column(channel).push_back(fine.column(channel)[first + k * kPhases]);
  }
  return record;
}

void add_noise(record::Record& record, record::Channel signal, double relative, double limit,
               std::uint64_t seed) {
  std::vector<double>& values = record.column(signal);
  double square = 0;
  for (const double v : values) square += v * v / static_cast<double>(values.size());
  Random random(seed);
  const double deviation = relative * std::sqrt(square);
  for (double& v : values) v = std::clamp(v + deviation * random.normal(), -limit, limit);
  if (signal == record::Channel::motor_torque) return;
  for (double& v : record.column(record::Channel::motor_torque)) v += deviation * random.normal();
}

/// Length of a record [s].
double duration_of(const rig_file::RigFile& file, const Draw& d) {
  const diagnosis::ApdSettings& apd = *file.diagnosis.apd;
  return (apd.settling_periods + d.periods) * apd.period;
}

}  // namespace

record::Record simulate_fine(rig_file::RigFile file, Machine machine, double backlash, double duration) {
  machine.rig.mesh.backlash = backlash;
  simulation::SensorsSettings& sensors = file.simulation.sensors;
  sensors.sampling_rate *= kPhases;
  for (const record::Channel channel : {file.diagnosis.apd->signal, record::Channel::motor_torque}) {
    const bool declared = sensors.of(channel).declared;
    sensors.of(channel) = {};
    sensors.of(channel).declared = declared;
  }
  record::Record record = simulation::simulate_record(machine.rig, file.simulation, duration);
  machine.sensor.apply(record.column(record::Channel::sensor_torque), 1 / sensors.sampling_rate);
  return record;
}

record::Record recorded(const record::Record& fine, const rig_file::RigFile& file, const Draw& d) {
  const record::Channel signal = file.diagnosis.apd->signal;
  const double rate = file.simulation.sensors.sampling_rate;
  const auto count = static_cast<std::size_t>(std::lround(duration_of(file, d) * rate));
  record::Record record = thinned(fine, d.start, rate, count);
  add_noise(record, signal, d.noise, file.simulation.sensors.of(signal).limit, d.seed);
  return record;
}

record::Record simulate_draw(const rig_file::RigFile& file, const Draw& d) {
  const double rate = file.simulation.sensors.sampling_rate;
  const double duration = duration_of(file, d) + d.start + 2 / rate;
  return recorded(simulate_fine(file, draw_machine(file, d.seed), d.backlash, duration), file, d);
}

diagnosis::Estimate estimate_of_verdict(const diagnosis::Verdict& verdict) {
  diagnosis::Estimate estimate;
  estimate.method = "combined";
  estimate.backlash = verdict.backlash;
  estimate.lower = verdict.lower;
  estimate.upper = verdict.upper;
  estimate.message = verdict.message;
  const bool sound = verdict.grade != diagnosis::Grade::cannot_tell && std::isfinite(verdict.backlash);
  estimate.status = sound ? diagnosis::Status::ok : diagnosis::Status::ambiguous;
  return estimate;
}

}  // namespace backlash::studies
