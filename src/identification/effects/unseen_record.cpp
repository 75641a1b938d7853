// SPDX-License-Identifier: BSD-3-Clause
#include "unseen_record.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../fit/calibration.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "independence.h"

namespace backlash::identification {
namespace {

constexpr int kLags = 25;  // choice: to either side, of the test for independence
constexpr double kIndependent =
    0.4;  // theory: of a period of the cutoff, between independent values of a residual

}  // namespace

// The encoders are calibrated by the deflection alone and the delay of the torque moves what was measured, so
// that the prediction holds nothing of the record's torque.
Calibration calibrated(Machine machine, const ServoData& record, const FitSettings& settings) {
  const std::vector<ServoData> data = {record};
  const Calibration like = machine.calibrations.front();
  machine.parameters.clear();
  machine.priors.clear();
  machine.has_map = false;
  machine.calibrations = {like};
  const auto calibrate = [&] {
    for (const double band : {settings.rough_cutoff, settings.cutoff}) {
      if (Unknowns(machine).size() == 0) break;
      machine = fit_in_band(data, machine, band, settings.tolerance, settings).fit.machine;
    }
  };
  if (simulation::load_moves_freely(machine.rig)) {  // else the torque alone shows where the gap is
    machine.calibrations.front().encoder_offset = middle_offset(record);
    const double delay = std::exchange(machine.largest_delay, 0);
    machine.deflection_only = true;
    calibrate();
    machine.deflection_only = false;
    machine.encoders_known = true;
    machine.largest_delay = delay;
  }
  calibrate();
  return machine.calibrations.front();
}

ServoPrediction predicted(const Machine& machine, const ServoData& record, const FitSettings& settings) {
  return predict_servo(machine.rig, record, settings, calibrated(machine, record, settings));
}

std::vector<ServoPrediction> predicted_by_all(const Hypothesis& h, const ServoData& record,
                                              const FitSettings& settings) {
  std::vector<ServoPrediction> all = {predicted(h.base->fit.machine, record, settings)};
  for (const Effect& effect : h.effects) all.push_back(predicted(*effect.after, record, settings));
  if (h.effects.empty() && h.fitted != h.base)
    all.push_back(predicted(h.fitted->fit.machine, record, settings));
  return all;
}

double train_error(const Machine& machine, const std::vector<ServoData>& data, const FitSettings& settings,
                   ChannelError ServoPrediction::*channel) {
  double square = 0;
  for (std::size_t i = 0; i < data.size(); ++i)
    square +=
        std::pow((predict_servo(machine.rig, data[i], settings, machine.calibrations[i]).*channel).error, 2);
  return std::sqrt(square / double(data.size()));
}

TraceSeries trace_series(const ServoData& data, const ServoPrediction& before, const ServoPrediction& after) {
  TraceSeries s;
  for (std::size_t k = 0; k < data.size(); ++k) s.time.push_back(data.start + double(k) * data.interval);
  s.motor_position = data.motor;
  s.motor_velocity = data.motor_rate;
  s.motor_torque = data.torque;
  s.load_position = after.load.load;
  s.load_velocity = after.load.load_rate;
  s.mesh_torque = after.load.mesh_torque;
  s.torque_counts = after.counts;
  s.deflection_counts = after.settled;
  s.torque = after.measured_torque;
  s.torque_before = before.torque;
  s.torque_after = after.torque;
  s.deflection = after.measured_deflection;
  s.deflection_before = before.deflection;
  s.deflection_after = after.deflection;
  return s;
}

std::vector<Independence> independence(const TraceSeries& s, const ServoData& data, double cutoff) {
  const auto stride = std::size_t(std::max(1L, std::lround(kIndependent / (cutoff * data.interval))));
  const auto thinned = [&](const std::vector<double>& x) {
    std::vector<double> out;
    for (std::size_t k = 0; k < x.size(); k += stride) out.push_back(x[k]);
    return out;
  };
  const auto residual = [&](const std::vector<double>& y, const std::vector<double>& p,
                            const std::vector<char>& counts) {
    std::vector<double> r(y.size());
    for (std::size_t k = 0; k < y.size(); ++k) r[k] = counts[k] ? y[k] - p[k] : 0;
    return thinned(r);
  };
  std::vector<Independence> all;
  const std::pair<const char*, std::vector<double>> inputs[] = {{"motor_torque", thinned(s.torque)},
                                                                {"motor_velocity", thinned(data.motor_rate)}};
  for (const auto& [name, values] : inputs) {
    const std::vector<double>& input = values;  // a lambda of C++17 captures no name of a binding
    const auto share = [&](const std::vector<double>& r) { return share_outside_band(r, input, kLags); };
    all.push_back({"torque", name, share(residual(s.torque, s.torque_before, s.torque_counts)),
                   share(residual(s.torque, s.torque_after, s.torque_counts))});
    if (!s.deflection.empty())
      all.push_back({"deflection", name,
                     share(residual(s.deflection, s.deflection_before, s.deflection_counts)),
                     share(residual(s.deflection, s.deflection_after, s.deflection_counts))});
  }
  return all;
}

}  // namespace backlash::identification
