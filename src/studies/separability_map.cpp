// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/separability_map.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "drawn_record.h"

namespace backlash::studies {
namespace {

void check(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
           const std::vector<Disturbance>& disturbances, const SeparabilityRequest& request) {
  if (!file.diagnosis.apd) throw InvalidParameter("diagnosis.apd", "absent", "the map needs its signal");
  if (!(file.diagnosis.apd->period > 0))
    throw InvalidParameter("diagnosis.apd.period", "absent", "the map counts in periods");
  if (curve.conditions.signal != record::channel_name(file.diagnosis.apd->signal))
    throw InvalidParameter("curve.signal", curve.conditions.signal, "must be that of the rig file");
  if (!(curve.conditions.apd == file.diagnosis.apd->layout))
    throw InvalidParameter("curve.apd", "other classes", "must be those of the rig file");
  for (const auto& [name, value, least] :
       {std::tuple{"backlash_values", request.backlash_values, 2}, std::tuple{"records", request.records, 1},
        std::tuple{"periods", request.periods, 1}})
    if (value < least) throw InvalidParameter(name, value, "must be >= " + std::to_string(least));
  if (!(request.noise >= 0 && std::isfinite(request.noise)))
    throw InvalidParameter("noise", request.noise, "must be >= 0 and finite");
  for (const Disturbance& d : disturbances)
    if (std::find(d.levels.begin(), d.levels.end(), d.none) == d.levels.end())
      throw InvalidParameter("levels", d.name, "must contain the one without disturbance");
}

/// What changes from record to record, the same in every cell: levels then differ by the disturbance alone.
Draw draw(const SeparabilityRequest& request, double period, int record) {
  Random random(request.seed, static_cast<std::uint32_t>(record));
  Draw d{};
  d.periods = request.periods;
  d.start = period * random.uniform();
  d.seed = random.bits();
  return d;
}

/// The motion of a disturbed machine as its sensors see it, before any noise.
record::Record simulate_disturbed(DisturbedMachine machine, double amplitude, double backlash, int periods) {
  const diagnosis::ApdSettings& apd = *machine.file.diagnosis.apd;
  const double rate = machine.file.simulation.sensors.sampling_rate;
  const double load = machine.load * amplitude;
  machine.file.simulation.excitation.bias += load;
  // Only the disturbance is unknown.
  record::Record fine =
      simulate_fine(machine.file, {machine.file.rig, {machine.sensor_gain, machine.sensor_delay, 0}},
                    backlash, (apd.settling_periods + periods + 1) * apd.period + 2 / rate);
  for (double& torque : fine.column(record::Channel::motor_torque)) torque -= load;
  for (double& current : fine.column(record::Channel::motor_current))
    current -= load / machine.file.rig.torque_constant;
  return fine;
}

/// A claim that can be right or wrong: a value, or that there is more than the curve covers.
bool claims(const diagnosis::Estimate& e, double truth) {
  return e.status == diagnosis::Status::ok || (e.status == diagnosis::Status::above_range && e.lower > truth);
}

SeparabilityAnswer summarise(const std::vector<diagnosis::Estimate>& estimates, double truth) {
  SeparabilityAnswer answer;
  std::vector<double> errors;
  std::map<diagnosis::Status, int> statuses;
  for (const diagnosis::Estimate& e : estimates) {
    ++statuses[e.status];
    const bool holds = e.lower <= truth && truth <= e.upper;
    ++(!claims(e, truth) ? answer.refused : holds ? answer.right : answer.wrong);
    if (claims(e, truth))
      errors.push_back((e.status == diagnosis::Status::ok ? e.backlash : e.lower) - truth);
  }
  if (!errors.empty()) answer.error = signal::median(errors);
  answer.status = std::max_element(statuses.begin(), statuses.end(), [](const auto& a, const auto& b) {
                    return a.second < b.second;
                  })->first;
  if (answer.status == diagnosis::Status::ok) return answer;
  answer.reason = std::find_if(estimates.begin(), estimates.end(), [&](const diagnosis::Estimate& e) {
                    return e.status == answer.status;
                  })->message;
  return answer;
}

SeparabilityCell make_cell(const DisturbedMachine& machine, const diagnosis::DiagnosisSettings& believed,
                           const diagnosis::MonitoringCurve& curve, const SeparabilityRequest& request,
                           const std::vector<std::string>& methods, double backlash) {
  const record::Record fine =
      simulate_disturbed(machine, curve.conditions.amplitude, backlash, request.periods);
  std::vector<std::vector<diagnosis::Estimate>> estimates(methods.size());
  SeparabilityCell cell;
  cell.skewness = 0;
  for (int r = 0; r < request.records; ++r) {
    Draw d = draw(request, believed.apd->period, r);
    d.noise = machine.noise;
    const diagnosis::Diagnosis diagnosis =
        diagnosis::diagnose(recorded(fine, machine.file, d), believed, &curve);
    std::vector<diagnosis::Estimate> all = diagnosis.estimates;
    all.push_back(estimate_of_verdict(diagnosis.verdict));
    for (const diagnosis::Estimate& e : all)
      for (std::size_t m = 0; m < methods.size(); ++m)
        if (e.method == methods[m]) estimates[m].push_back(e);
    cell.skewness += (diagnosis.apd ? diagnosis.apd->skewness : kNaN) / request.records;
  }
  for (const auto& of_method : estimates) cell.answers.push_back(summarise(of_method, backlash));
  return cell;
}

/// Slope of the curve [1/m] at the declared noise, by least squares over all of it; NaN where it does not
/// fall.
double slope_of(const diagnosis::MonitoringCurve& curve) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const diagnosis::CurvePoint& point : curve.points) {
    const double b = point.backlash, s = curve.nominal(point).mean;
    n += 1, x += b, y += s, xx += b * b, xy += b * s;
  }
  const double slope = (n * xy - x * y) / (n * xx - x * x);
  return slope < 0 ? slope : kNaN;
}

void add_equivalents(SeparabilityMap& map, double slope) {
  const Disturbance& d = map.disturbance;
  const auto none = std::find(d.levels.begin(), d.levels.end(), d.none) - d.levels.begin();
  for (auto& row : map.cells)
    for (std::size_t b = 0; b < row.size(); ++b)
      row[b].equivalent = (row[b].skewness - map.cells[none][b].skewness) / slope;
}

void add_of_machine(const rig_file::RigFile& file, std::vector<Disturbance>& all) {
  const double amplitude = file.simulation.excitation.amplitude;
  all.push_back({"motor_dry_friction",
                 "dry friction of the motor more than declared / excitation amplitude",
                 0,
                 {0, 0.02, 0.05, 0.1, 0.15, 0.2},
                 [amplitude](DisturbedMachine& m, double level) {
                   m.file.rig.motor.coulomb_friction += level * amplitude;
                 }});
  all.push_back({"motor_inertia",
                 "inertia of the motor / declared",
                 1,
                 {0.7, 0.85, 0.95, 1, 1.05, 1.15, 1.3},
                 [](DisturbedMachine& m, double level) { m.file.rig.motor.inertia *= level; }});
  if (!file.rig.input_coupling.rigid || !file.rig.output_coupling.rigid)
    all.push_back({"coupling_stiffness",
                   "change of the couplings' stiffness / declared",
                   0,
                   {-0.2, -0.15, -0.1, -0.05, 0, 0.05, 0.1, 0.15, 0.2},
                   [](DisturbedMachine& m, double level) {
                     for (model::Coupling* c : {&m.file.rig.input_coupling, &m.file.rig.output_coupling})
                       c->stiffness *= 1 + level;
                   }});
  if (!file.rig.mesh.rigid && file.rig.mesh.contact_spec().values.has("stiffness"))
    all.push_back({"contact_stiffness",
                   "stiffness of the contact / declared",
                   1,
                   {0.4, 0.63, 1, 1.6, 2.5},
                   [](DisturbedMachine& m, double level) {
                     model::ContactSpec contact = m.file.rig.mesh.contact_spec();
                     contact.values["stiffness"] *= level;
                     m.file.rig.mesh.contact = model::make_contact_law(contact.law, contact.values);
                   }});
}

void add_of_sensors(const rig_file::RigFile& file, std::vector<Disturbance>& all) {
  if (!file.rig.input_coupling.rigid) {
    all.push_back({"sensor_gain",
                   "gain of the torque sensor / declared",
                   1,
                   {0.9, 0.95, 0.98, 1, 1.02, 1.05, 1.1},
                   [](DisturbedMachine& m, double level) { m.sensor_gain = level; }});
    all.push_back({"sensor_delay",
                   "delay of the torque sensor [s]",
                   0,
                   {0, 1e-4, 3e-4, 6e-4, 1e-3},
                   [](DisturbedMachine& m, double level) { m.sensor_delay = level; }});
  }
  if (!file.rig.link_locked)
    all.push_back({"encoder_skew",
                   "load encoder later than declared [s]",
                   0,
                   {0, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2},
                   [](DisturbedMachine& m, double level) { m.file.rig.encoder_skew += level; }});
}

}  // namespace

std::vector<Disturbance> disturbances_of(const rig_file::RigFile& file) {
  std::vector<Disturbance> all;
  all.push_back({"sensor_noise",
                 "sensor noise / rms of the signal",
                 0,
                 {0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3},
                 [](DisturbedMachine& m, double level) { m.noise = level; }});
  if (file.rig.motor.viscous_damping > 0)
    all.push_back({"motor_viscous_damping",
                   "viscous friction of the motor / declared",
                   1,
                   {0.25, 0.35, 0.5, 0.7, 1, 1.4, 2, 2.8, 4},
                   [](DisturbedMachine& m, double level) { m.file.rig.motor.viscous_damping *= level; }});
  all.push_back({"load_torque",
                 "constant load on the motor / excitation amplitude",
                 0,
                 {0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6},
                 [](DisturbedMachine& m, double level) { m.load = level; }});
  add_of_machine(file, all);
  add_of_sensors(file, all);
  return all;
}

Separability map_separability(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
                              const std::vector<Disturbance>& disturbances,
                              const SeparabilityRequest& request, const Progress& progress) {
  check(file, curve, disturbances, request);
  diagnosis::DiagnosisSettings believed = file.diagnosis;
  if (!request.waveform) believed.leave_out_waveform();
  Separability all;
  all.slope = slope_of(curve);
  const double first = curve.points.front().backlash, last = curve.points.back().backlash;
  for (int b = 0; b < request.backlash_values; ++b) {
    const double backlash = first + (last - first) * b / (request.backlash_values - 1);
    const diagnosis::SkewnessCell skewness = curve.at(backlash, curve.conditions.noise);
    const double deviation = diagnosis::MonitoringCurve::deviation(skewness, request.periods);
    all.backlash.push_back(backlash);
    all.resolution.push_back(curve.coverage_factor * deviation / -all.slope);
  }
  struct Job {
    std::size_t map, level, backlash;
  };
  std::vector<Job> jobs;
  for (std::size_t m = 0; m < disturbances.size(); ++m) {
    const std::size_t levels = disturbances[m].levels.size(), values = all.backlash.size();
    all.maps.push_back({disturbances[m], std::vector(levels, std::vector<SeparabilityCell>(values))});
    for (std::size_t i = 0; i < levels * values; ++i) jobs.push_back({m, i / values, i % values});
  }
  Ticker ticker(progress, static_cast<long>(jobs.size()), "mapping");
  for_each_in_parallel(static_cast<int>(jobs.size()), ticker, [&](int i) {
    const Job& job = jobs[i];
    DisturbedMachine machine{file, request.noise};
    machine.file.simulation.sensors.sampling_rate = curve.conditions.sampling_rate;
    disturbances[job.map].apply(machine, disturbances[job.map].levels[job.level]);
    all.maps[job.map].cells[job.level][job.backlash] =
        make_cell(machine, believed, curve, request, all.methods, all.backlash[job.backlash]);
    ticker.tick();
  });
  for (SeparabilityMap& map : all.maps) add_equivalents(map, all.slope);
  return all;
}

}  // namespace backlash::studies
