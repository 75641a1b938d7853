// SPDX-License-Identifier: BSD-3-Clause
// The one procedure for a machine of one inertia.
#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/model/weight_term.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "declared_terms.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kByMissing = 1;  // theory: the same where the error holds effects that the model lacks
constexpr double kByNoise = 5;    // choice: standard errors below zero, that an explained torque may have

/// The samples that were used, in their places.
ChannelTrace trace_of(const OneInertia& found, const record::Record& record) {
  ChannelTrace trace;
  trace.record = record.name;
  trace.interval = record.sampling_interval();
  const std::size_t n = std::lround((record.time.back() - record.time.front()) / trace.interval) + 1;
  trace.measured.assign(n, 0);
  trace.predicted.assign(n, 0);
  trace.counts.assign(n, 0);
  for (std::size_t i = 0; i < found.time.size(); ++i) {
    const std::size_t k = std::lround((found.time[i] - record.time.front()) / trace.interval);
    if (k >= n) continue;
    trace.measured[k] = found.measured[i];
    trace.predicted[k] = found.predicted[i];
    trace.counts[k] = 1;
  }
  return trace;
}

constexpr double kFastest = 0.99;  // quantile: choice

/// rad/s, in the band of the fit.
double fastest(const record::Record& record, double cutoff) {
  const double interval = record.sampling_interval();
  std::vector<double> speed =
      signal::derivative(signal::low_pass(record.column(record::Channel::motor_position), interval,
                                          std::min(cutoff, 0.4 / interval)),
                         interval);
  for (double& v : speed) v = std::fabs(v);
  return signal::quantile(std::move(speed), kFastest);
}

/// A load that the model lacks can leave it with an inertia or a friction that no machine has. Friction may
/// fall with the speed, as long as it does not drive.
void require_possible(const OneInertia& found, const record::Record& measured) {
  const std::string& record = measured.name;
  const auto refuse = [&](const char* name, const signal::Measured& m) {
    throw CannotIdentify(fmt::format(
        "{}: {} comes out as {:.3g} +- {:.2g}, and {:.3g} % of the torque is left where noise alone would "
        "leave {:.3g} %: the machine has effects that one inertia with friction lacks{}; "
        "trace_residual looks for them",
        record, name, m.value, m.standard_error, 100 * found.relative_error, 100 * found.floor,
        found.gravity ? "" : ", as gravity"));
  };
  if (found.inertia.value <= 0) refuse("inertia", found.inertia);
  // A friction that is nearly nothing may come out below zero by noise, or by what its error holds.
  const double by_noise = found.relative_error <= kShowsMissingEffect * found.floor ? kByNoise : kByMissing;
  const signal::Measured least = {found.coulomb.value - std::fabs(found.offset.value),
                                  std::hypot(found.coulomb.standard_error, found.offset.standard_error)};
  const bool drives = least.value + found.viscous.value * fastest(measured, found.cutoff) < 0;
  if (drives && found.viscous.value < -by_noise * found.viscous.standard_error)
    refuse("viscous", found.viscous);
  if (least.value < -by_noise * least.standard_error) refuse("coulomb friction of the one direction", least);
}

/// What the rig file declares beside inertia and friction is no part of either.
void take_off_terms(IdentificationCase& c) {
  for (CaseRecord& r : c.records) {
    if (!r.record.has(record::Channel::motor_torque) || !r.record.has(record::Channel::motor_position))
      continue;
    const std::vector<double> taken = torque_of_terms(r.record, c.declared);
    std::vector<double>& torque = r.record.column(record::Channel::motor_torque);
    for (std::size_t k = 0; k < taken.size(); ++k) torque[k] -= taken[k];
  }
}

/// The weight that the rig declares, in sine and cosine; none where it declares no gravity.
std::optional<std::pair<double, double>> declared_weight(const model::Rig& rig) {
  std::optional<std::pair<double, double>> weight;
  for (const auto& term : rig.terms) {
    if (term->id != model::weight_term()) continue;
    if (!weight) weight.emplace(0, 0);
    const double amplitude = term->values.at("amplitude"), phase = term->values.at("phase");
    weight->first += amplitude * std::cos(phase);
    weight->second += amplitude * std::sin(phase);
  }
  return weight;
}

/// A record, and the machine that is identified from it alone.
struct MachineAlone {
  const record::Record* record;
  OneInertia machine;
  const std::vector<bool>* lost;
};

/// What was found is what the declared weight, which was taken off, lacks.
void add_weight(OneInertia& machine, const std::pair<double, double>& declared) {
  machine.gravity_sine.value += declared.first;
  machine.gravity_cosine.value += declared.second;
}

/// All records that identify one; what is left out is a warning. Throws CannotIdentify where none does.
std::vector<MachineAlone> machines_alone(IdentificationCase& c) {
  std::vector<MachineAlone> all;
  std::vector<std::string> reasons;
  const auto weight = declared_weight(c.declared);
  for (const CaseRecord& r : c.records) {
    try {
      OneInertiaOptions options;
      options.lost = r.lost;
      options.gravity = weight.has_value();
      all.push_back({&r.record, identify_one_inertia(r.record, options), &r.lost});
      if (weight) add_weight(all.back().machine, *weight);
      require_possible(all.back().machine, r.record);
    } catch (const CannotIdentify& error) {
      if (!all.empty() && all.back().record == &r.record) all.pop_back();
      reasons.emplace_back(error.what());
    }
  }
  if (all.empty()) throw CannotIdentify(joined(reasons));
  for (const std::string& reason : reasons) c.result.warnings.push_back("not used: " + reason);
  for (const MachineAlone& t : all)
    for (const std::string& warning : t.machine.warnings)
      c.result.warnings.push_back(all.size() == 1 ? warning : t.record->name + ": " + warning);
  return all;
}

/// Amplitude and phase of s sin(q) + c cos(q); their errors as of independent s and c.
std::pair<signal::Measured, signal::Measured> weight_of(const OneInertia& m) {
  const double s = m.gravity_sine.value, c = m.gravity_cosine.value, a = std::hypot(s, c);
  const double es = m.gravity_sine.standard_error, ec = m.gravity_cosine.standard_error;
  if (!(a > 0)) return {{0, std::hypot(es, ec)}, {0, std::numeric_limits<double>::infinity()}};
  return {{a, std::hypot(s * es, c * ec) / a}, {std::atan2(c, s), std::hypot(c * es, s * ec) / (a * a)}};
}

std::map<std::string, signal::Measured> parameters_of(const OneInertia& machine) {
  std::map<std::string, signal::Measured> all = {{"inertia", machine.inertia},
                                                 {"viscous", machine.viscous},
                                                 {"coulomb", machine.coulomb},
                                                 {"offset", machine.offset}};
  if (machine.gravity) std::tie(all["gravity_amplitude"], all["gravity_phase"]) = weight_of(machine);
  return all;
}

/// Relative, over all records: norms add up.
ChannelError error_of(const std::vector<OneInertia>& applied) {
  double left = 0, noise = 0, all = 0;
  for (const OneInertia& m : applied) {
    const Eigen::Map<const Eigen::ArrayXd> torque(m.measured.data(), Eigen::Index(m.measured.size()));
    const double square = (torque - torque.mean()).square().sum();
    left += m.relative_error * m.relative_error * square;
    noise += m.floor * m.floor * square;
    all += square;
  }
  return {std::sqrt(left / all), std::sqrt(noise / all)};
}

/// Whether each record alone is met, with other values.
std::optional<SeveralMachines> contradicting(const std::vector<MachineAlone>& machines,
                                             const ChannelError& together) {
  std::vector<RecordAlone> alone;
  for (const MachineAlone& t : machines)
    alone.push_back({t.record->name, parameters_of(t.machine), t.machine.relative_error / t.machine.floor});
  return several_machines(std::move(alone), together.error / together.floor);
}

/// One weight in place of those that were declared.
void take_weight(const OneInertia& found, IdentificationCase& c) {
  if (!found.gravity) return;
  auto& terms = c.result.rig.terms;
  terms.erase(std::remove_if(terms.begin(), terms.end(),
                             [](const auto& term) { return term->id == model::weight_term(); }),
              terms.end());
  const auto [amplitude, phase] = weight_of(found);
  terms.push_back(
      model::make_term(model::weight_term(), {{"amplitude", amplitude.value}, {"phase", phase.value}}));
}

/// The values of the rig that one inertia has.
void take_machine(const OneInertia& found, IdentificationCase& c) {
  model::Body& body = c.result.rig.motor;
  body.inertia =
      found.inertia.value - c.declared.pinion.inertia - c.declared.gear.inertia - c.declared.link.inertia;
  body.viscous_damping = std::max(0.0, found.viscous.value);
  body.viscous_asymmetry = 0;
  body.coulomb_friction = std::max(0.0, found.coulomb.value);
  body.coulomb_asymmetry = std::clamp(found.offset.value, -body.coulomb_friction, body.coulomb_friction);
}

}  // namespace

ProcedureReport run_one_inertia(IdentificationCase& c) {
  ProcedureReport report{"one_inertia", {}, ""};
  take_off_terms(c);
  const std::vector<MachineAlone> machines = machines_alone(c);
  const auto weight = declared_weight(c.declared);
  std::vector<OneInertia> alone, together;
  for (const MachineAlone& t : machines) alone.push_back(t.machine);
  const OneInertia found = combined(alone);
  for (const MachineAlone& t : machines) {
    OneInertia machine = found;
    machine.cutoff = t.machine.cutoff;
    machine.smoothed = t.machine.smoothed;
    machine.delay = t.machine.delay;
    if (weight) add_weight(machine, {-weight->first, -weight->second});  // the records are without it
    together.push_back(applied(machine, *t.record, *t.lost));
    report.records.push_back(t.record->name);
    c.result.torque.push_back(trace_of(together.back(), *t.record));
  }
  c.result.one_inertia = found;
  c.result.parameters = parameters_of(found);
  for (const rig_file::RigParameter& p : rig_file::servo_parameters())
    if (!p.one_inertia.empty()) c.result.units[p.one_inertia] = model::axis_unit(p.unit, c.declared.linear);
  if (weight) c.result.units["gravity_amplitude"] = "N m", c.result.units["gravity_phase"] = "rad";
  const ChannelError error = c.result.channels["torque"] = error_of(together);
  c.result.delay = found.delay;
  c.result.several = contradicting(machines, error);
  if (c.result.several) allow_for_several(*c.result.several, c.result.parameters);
  take_machine(found, c);
  take_weight(found, c);
  report.message = fmt::format("torque error {:.3g} %, low-pass {:.3g} Hz, torque acts {:.3g} ms late",
                               100 * error.error, found.cutoff, 1e3 * found.delay.value);
  return report;
}

}  // namespace backlash::identification
