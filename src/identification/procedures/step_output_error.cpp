// SPDX-License-Identifier: BSD-3-Clause
// The last step of an identification: everything together, on the raw records.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "../effects/contact_shape.h"
#include "../fit/joint_fit.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

// Errors fall with the root of the time, while another motion separates what one motion mixes. So the time
// that a fit may take goes in equal parts to the few records in which the teeth change flanks most.
constexpr double kVariationCutoff = 5;   // Hz, choice: of the deflection, far below any mesh resonance
constexpr double kHighestCutoff = 0.2;   // choice: of the sampling rate
constexpr double kMostSeconds = 60;      // s, choice (time): of all records
constexpr std::size_t kMostRecords = 3;  // choice (time)
constexpr double kWorthwhileShare =
    0.3;  // choice: of the record that varies most, from which another is worth its time
constexpr double kSecant =
    1.0 / 3;  // theory: of the slope, by which force over penetration is less where it grows by the power 1.5
constexpr double kFewestSeconds = 2;  // s, choice: of a record

struct Stretch {
  const CaseRecord* record;
  std::size_t from, to;  // samples
  double variation;      // rad/s, how much the deflection varies
};

/// The stretch of a record, at most so long, whose deflection varies most: the teeth change flanks there.
Stretch most_varied(const CaseRecord& r, double seconds) {
  const double interval = r.record.sampling_interval();
  const auto &motor = r.record.column(record::Channel::motor_position),
             &load = r.record.column(record::Channel::load_position);
  std::vector<double> deflection(motor.size());
  for (std::size_t k = 0; k < motor.size(); ++k) deflection[k] = motor[k] - load[k];
  const double cutoff = std::min(kVariationCutoff, kHighestCutoff / interval);
  deflection = signal::low_pass(deflection, interval, cutoff);
  std::vector<double> sum(motor.size(), 0);
  for (std::size_t k = 1; k < sum.size(); ++k)
    sum[k] = sum[k - 1] + std::fabs(deflection[k] - deflection[k - 1]);
  const std::size_t length = std::min<std::size_t>(motor.size(), std::lround(seconds / interval));
  std::size_t best = 0;
  for (std::size_t from = 0; from + length <= motor.size(); ++from)
    if (sum[from + length - 1] - sum[from] > sum[best + length - 1] - sum[best]) best = from;
  return {&r, best, best + length, (sum[best + length - 1] - sum[best]) / (double(length) * interval)};
}

record::EvenGrid cut(const Stretch& s) {
  const std::vector<double>& t = s.record->record.time;
  const double end = s.to < t.size() ? t[s.to] : INFINITY;
  const auto lost = s.record->lost.begin();
  return {s.record->record.slice(t[s.from], end), {lost + long(s.from), lost + long(s.to)}};
}

std::vector<Stretch> varied_stretches(const IdentificationCase& c) {
  std::vector<Stretch> all;
  for (const CaseRecord& r : c.records)
    if (r.drive() && r.has_load && r.record.time.back() - r.record.time.front() >= kFewestSeconds)
      all.push_back(most_varied(r, kMostSeconds / double(kMostRecords)));
  std::sort(all.begin(), all.end(),
            [](const Stretch& a, const Stretch& b) { return a.variation > b.variation; });
  while (!all.empty() &&
         (all.size() > kMostRecords || all.back().variation < kWorthwhileShare * all.front().variation))
    all.pop_back();
  for (Stretch& s : all) s = most_varied(*s.record, kMostSeconds / double(all.size()));
  return all;
}

/// Over all records: norms add up.
ChannelError total(const std::vector<ServoPrediction>& predictions, ChannelError ServoPrediction::*of,
                   const std::vector<double>& weights) {
  ChannelError sum;
  double all = 0;
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    sum.error += std::pow(weights[i] * (predictions[i].*of).error, 2);
    sum.floor += std::pow(weights[i] * (predictions[i].*of).floor, 2);
    all += weights[i] * weights[i];
  }
  return {std::sqrt(sum.error / all), std::sqrt(sum.floor / all)};
}

double spread(const std::vector<double>& y) {
  const double mean = std::accumulate(y.begin(), y.end(), 0.0) / double(y.size());
  double square = 0;
  for (const double v : y) square += (v - mean) * (v - mean);
  return std::sqrt(square);
}

bool lacks_something(const ChannelError& channel) {
  return channel.error > kShowsMissingEffect * channel.floor;
}

/// Times the noise, of the channel of which more is left.
double most_left(const std::map<std::string, ChannelError>& channels) {
  double most = 0;
  for (const auto& [name, channel] : channels) most = std::max(most, channel.error / channel.floor);
  return most;
}

/// Whether each record alone is met, with other values; `settings` without what other records found.
std::optional<SeveralMachines> contradicting(const IdentificationCase& c, const std::vector<ServoData>& data,
                                             const std::vector<std::string>& names, double together,
                                             OutputErrorSettings settings) {
  if (data.size() < 2) return std::nullopt;
  settings.findings.clear();
  std::vector<RecordAlone> alone;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const OutputError fit = fit_output_error(c.declared, {data[i]}, settings);
    const ServoPrediction& p = fit.predictions.front();
    alone.push_back({names[i], fit.parameters,
                     most_left({{"torque", p.torque_error}, {"deflection", p.deflection_error}})});
    if (!is_met(alone.back().left, together)) return std::nullopt;
  }
  return several_machines(std::move(alone), together);
}

double most_left(const OutputError& fit) {
  double most = 0;
  for (const ServoPrediction& p : fit.predictions)
    most = std::max(most, most_left({{"torque", p.torque_error}, {"deflection", p.deflection_error}}));
  return most;
}

/// The machine with the same values and Hertzian teeth that leave least, fitted; nothing where they leave
/// more, or where that fails, which is said.
std::optional<OutputError> with_hertzian_fit(const OutputError& fit, const std::vector<ServoData>& data,
                                             OutputErrorSettings settings,
                                             std::vector<std::string>& warnings) {
  double torque = 0;  // N m, standard deviation
  for (const ServoData& d : data) torque = std::max(torque, spread(d.torque) / std::sqrt(double(d.size())));
  std::optional<OutputError> best;
  settings.findings.clear();
  for (const model::Rig& teeth : with_hertzian_teeth(fit.rig, torque)) {
    settings.parameters.clear();
    for (const rig_file::RigParameter& p : rig_file::servo_parameters())
      if (p.known_to(teeth) && (!p.contact.empty() || fit.parameters.count(p.name) > 0))
        settings.parameters.push_back(p.name);
    try {
      OutputError other = fit_output_error(teeth, data, settings);
      if (most_left(other) < most_left(best ? *best : fit)) best = std::move(other);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {  // values that no machine has, or with which the load runs away
      warnings.push_back(
          fmt::format("teeth of Hertz ({}) cannot be fitted, so that the errors do not hold them: {}",
                      teeth.mesh.contact_spec().law, error.what()));
    }
  }
  return best;
}

/// Where teeth of another law leave less, no value is known better than by the difference between the laws.
void allow_for_other_teeth(const OutputError& fit, const OutputError& other, Identification& result) {
  for (auto& [name, measured] : result.parameters) {
    const rig_file::RigParameter& parameter = rig_file::servo_parameter(name);
    double difference = 0;
    if (parameter.contact.empty() && other.parameters.count(name) > 0)
      difference = other.parameters.at(name).value - measured.value;
    else if (parameter.kind == rig_file::ParameterKind::stiffness)
      difference = kSecant * measured.value;
    measured.standard_error = std::hypot(measured.standard_error, difference);
  }
  std::string warning = fmt::format(
      "Hertzian teeth leave less than linear ones, {:.3g} times the noise instead of {:.3g}: the errors hold "
      "the values of both, trace_residual says which",
      most_left(other), most_left(fit));
  if (const auto play = other.parameters.find("backlash_angle"); play != other.parameters.end())
    warning += fmt::format("; backlash_angle by them {:.4g}", play->second.value);
  result.warnings.push_back(std::move(warning));
}

/// Two flanks that the zero of both encoders lies between.
double start_in_gap(const model::Rig& rig, double encoder_offset) {
  const double half = 0.5 * rig.mesh.backlash / rig.mesh.lever();
  return half > 0 ? std::clamp(rig.mesh.start_in_gap + encoder_offset / half, -1.0, 1.0) : 0;
}

}  // namespace

ProcedureReport run_output_error(IdentificationCase& c) {
  ProcedureReport report{"output_error", {}, ""};
  const std::vector<Stretch> stretches = varied_stretches(c);
  if (stretches.empty()) throw CannotIdentify("no record in which motor and load move, with both positions");
  std::vector<ServoData> data;
  for (const Stretch& s : stretches) {
    data.push_back(servo_data(cut(s), c.declared));
    report.records.push_back(s.record->record.name);
  }
  OutputErrorSettings settings;
  settings.fit = with_bands(settings.fit, c.declared, data);
  settings.parameters = c.names;
  settings.findings = c.result.findings;
  const OutputError fit = fit_output_error(c.result.rig, data, settings);
  c.result.rig = fit.rig;
  c.result.parameters = fit.parameters;
  c.result.rig.mesh.start_in_gap = start_in_gap(fit.rig, fit.calibrations.front().encoder_offset);
  c.result.delay =
      signal::Measured{fit.calibrations.front().torque_delay * data.front().interval, std::nan("")};
  std::vector<double> torque, deflection;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const ServoPrediction& p = fit.predictions[i];
    torque.push_back(spread(p.measured_torque));
    deflection.push_back(spread(p.measured_deflection));
    c.result.torque.push_back({report.records[i], data[i].interval, p.measured_torque, p.torque, p.counts});
    c.result.deflection.push_back(
        {report.records[i], data[i].interval, p.measured_deflection, p.deflection, {}});
  }
  c.result.channels["torque"] = total(fit.predictions, &ServoPrediction::torque_error, torque);
  c.result.channels["deflection"] = total(fit.predictions, &ServoPrediction::deflection_error, deflection);
  if (fit.rig.coupled) {
    c.result.channels.erase("torque");
    c.result.torque.clear();
    c.result.warnings.emplace_back(
        "other axes move (gear_train.coupled): the torque is not predicted, and what it would show stays "
        "unknown");
  }
  const ChannelError d = c.result.channels["deflection"];
  report.message =
      fmt::format("deflection error {:.2g} % (noise alone {:.2g} %)", 100 * d.error, 100 * d.floor);
  if (fit.rig.coupled) return report;
  const ChannelError t = c.result.channels["torque"];
  if (lacks_something(d) || lacks_something(t)) {
    for (auto& [name, value] : c.result.parameters)
      allow_for_declared(rig_file::servo_parameter(name).get(c.declared), value);
    if (const auto other = with_hertzian_fit(fit, data, settings, c.result.warnings))
      allow_for_other_teeth(fit, *other, c.result);
    c.result.several = contradicting(c, data, report.records, most_left(c.result.channels), settings);
    if (c.result.several) allow_for_several(*c.result.several, c.result.parameters);
  }
  report.message = fmt::format("torque error {:.2g} % (noise alone {:.2g} %), deflection {:.2g} % ({:.2g} %)",
                               100 * t.error, 100 * t.floor, 100 * d.error, 100 * d.floor);
  return report;
}

}  // namespace backlash::identification
