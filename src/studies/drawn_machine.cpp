// SPDX-License-Identifier: BSD-3-Clause
#include "drawn_machine.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"

namespace backlash::studies {
namespace {

constexpr double kFarthest = 3;  // spreads, of a drawn value: choice

double drawn(Random& random) {
  return std::clamp(random.normal(), -kFarthest, kFarthest);
}

Machine machine_of(const rig_file::RigFile& file, const diagnosis::WaveformSettings& values) {
  return {rig_file::with_machine(file.rig, values),
          {values.sensor_gain, values.sensor_delay, values.sensor_time_constant}};
}

/// Moves a value by `spreads`, and by the share `scale` of the factor that all values have in common.
void move(const rig_file::RigFile& file, const diagnosis::WaveformQuantity& q, double spreads, double scale,
          diagnosis::WaveformSettings& values) {
  using Spread = diagnosis::WaveformSpread;
  double spread = values.spread.*q.spread;
  if (std::isnan(spread)) spread = Spread::kDryFriction * file.simulation.excitation.amplitude;
  double& value = values.*q.at;
  value = q.factor ? value * std::exp(spreads * spread + scale_power(q, values) * scale)
                   : std::max(0.0, value + spreads * spread);
}

}  // namespace

void SensorPath::apply(std::vector<double>& torque, double interval) const {
  if (gain == 1 && delay == 0 && time_constant == 0) return;
  const double late = delay / interval, whole = std::floor(late), part = late - whole;
  const auto back = static_cast<std::size_t>(whole);
  const double share = time_constant > 0 ? -std::expm1(-interval / time_constant) : 1;
  const std::vector<double> exact = torque;
  const auto at = [&](std::size_t k, std::size_t ago) { return k >= ago ? exact[k - ago] : 0; };
  double filtered = 0;
  for (std::size_t k = 0; k < torque.size(); ++k) {
    const double delayed = (1 - part) * at(k, back) + part * at(k, back + 1);
    filtered += share * (gain * delayed - filtered);
    torque[k] = filtered;
  }
}

Machine declared_machine(const rig_file::RigFile& file) {
  Machine machine{file.rig, {}};
  if (const auto& values = file.diagnosis.waveform)
    machine.sensor = {values->sensor_gain, values->sensor_delay, values->sensor_time_constant};
  return machine;
}

Machine draw_machine(const rig_file::RigFile& file, std::uint64_t seed) {
  if (!file.diagnosis.waveform) return draw_stiffness(file, seed);
  diagnosis::WaveformSettings values = *file.diagnosis.waveform;
  Random random(seed);
  const double scale = values.common_scale * drawn(random);
  for (const diagnosis::WaveformQuantity& q : diagnosis::waveform_quantities())
    if (q.in(values)) move(file, q, drawn(random), scale, values);
  return machine_of(file, values);
}

Machine draw_stiffness(const rig_file::RigFile& file, std::uint64_t seed) {
  Machine machine = declared_machine(file);
  Random random(seed);
  for (model::Coupling* coupling : {&machine.rig.input_coupling, &machine.rig.output_coupling})
    coupling->stiffness *= 1 + file.diagnosis.stiffness_uncertainty * drawn(random);
  return machine;
}

Machine machine_off(const rig_file::RigFile& file, std::size_t quantity, double spreads) {
  diagnosis::WaveformSettings values = *file.diagnosis.waveform;
  const auto& all = diagnosis::waveform_quantities();
  if (quantity < all.size())
    move(file, all[quantity], spreads, 0, values);
  else
    for (const diagnosis::WaveformQuantity& q : all)
      if (q.in(values)) move(file, q, 0, spreads * values.common_scale, values);
  return machine_of(file, values);
}

}  // namespace backlash::studies
