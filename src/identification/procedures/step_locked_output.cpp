// SPDX-License-Identifier: BSD-3-Clause
// The one procedure for a machine with a locked output and no torque sensor: the fit of output_error.h to
// each record, from the values of the rig file, and the mean of the records.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "../fit/servo_prediction.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/fit/output_error.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/weighted_mean.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kClearErrors = 2;      // choice: standard errors, from which a value is reported
constexpr double kAgree = 0.01;         // choice: chance below which records contradict each other
constexpr double kGearAbove = 5;        // choice: times the band of the fit: then its inertia counts 4 %
constexpr double kLinear = 1e-6;        // theory: relative, of a law whose force doubles with the depth
constexpr double kLeastOnFlank = 0.03;  // choice: of the sliding samples, beyond either edge
constexpr double kMostLeft = 0.5;       // choice: relative error, beyond which the model says too little
constexpr double kStart = 0.1;          // choice: of the largest that a record could show
constexpr double kLeastShare = 0.02;    // choice: of the samples, that slide in each direction
constexpr int kFewestRows = 64;         // choice
constexpr double kDepth = 1e-4;         // rad or m, choice: at which the power of a law is taken

/// The law's force doubles so many times where the depth does.
double power_of(const model::ContactLaw& law) {
  return std::log2(law.force(2 * kDepth, 0, 0) / law.force(kDepth, 0, 0));
}

/// The same machine with the coupling taken for a part of the teeth. The stiffness of both is fitted; each
/// damps its share of the motion, as the file has it. Of a law that needs the speed of a touch the elastic
/// part counts.
model::Rig without_coupling(const model::Rig& rig) {
  model::Rig out = rig;
  out.output_coupling = {};
  model::ContactSpec spec = rig.mesh.contact_spec();
  if (rig.mesh.contact->needs_impact_speed())
    out.mesh.contact = model::make_contact_law(
        "power_law", {{"stiffness", spec.values.at("stiffness")},
                      {"exponent", std::clamp(power_of(*rig.mesh.contact), 1.0, 1.5)}});
  if (rig.output_coupling.rigid || !spec.values.has("damping")) return out;
  const double square = rig.mesh.lever() * rig.mesh.lever(),
               teeth = rig.output_coupling.stiffness /
                       (rig.output_coupling.stiffness + square * spec.values.at("stiffness"));
  spec.values["damping"] = teeth * teeth * spec.values.at("damping") +
                           std::pow(1 - teeth, 2) * rig.output_coupling.damping / square;
  out.mesh.contact = model::make_contact_law(spec.law, spec.values);
  return out;
}

const char* const kOffsetName = "offset";  // of a record: the rig file has no place for it
const char* const kNames[] = {"motor_inertia", "motor_viscous", "motor_coulomb", "mesh_stiffness",
                              "backlash_angle"};

/// What one record says.
struct OfRecord {
  std::map<std::string, signal::Measured> values;
  ChannelError error;
  ChannelTrace trace;
  double delay;  // s
};

/// A value that the file has as 0 starts from a part of what the record could show of it.
model::Rig with_starts(model::Rig rig, const ServoData& data) {
  const double travel = signal::extent(data.motor).size(), torque = model::usual_torque(data.torque);
  const auto start = [&](const char* name, double value) {
    const rig_file::RigParameter& p = rig_file::servo_parameter(name);
    if (!(p.get(rig) > 0)) p.set(rig, kStart * value);
  };
  start("backlash_angle", travel);
  start("motor_coulomb", torque);
  start("motor_viscous", torque / model::usual_torque(data.motor_rate));
  return rig;
}

/// Of the samples in which the motor slides, beyond the flank that holds positive or negative torque.
double share_beyond(const OutputError& fit, const ServoData& data, bool plus) {
  const Calibration& c = fit.calibrations.front();
  const double half = 0.5 * fit.rig.mesh.backlash / fit.rig.mesh.lever();
  const std::vector<char>& counts = fit.predictions.front().counts;
  double beyond = 0, all = 0;
  for (std::size_t k = 0; k < data.size(); ++k) {
    if (!counts[k]) continue;
    const double t = (double(k) - 0.5 * double(data.size())) * data.interval,
                 x = data.motor[k] + c.encoder_offset - c.encoder_drift * t;
    beyond += plus ? x > half : x < -half;
    ++all;
  }
  return beyond / all;
}

void require_sliding(const ServoData& data, const PreparedServo& prepared, const std::string& record) {
  double forward = 0, backward = 0;
  for (std::size_t k = 0; k < data.size(); ++k)
    if (prepared.counts[k]) (prepared.direction[k] > 0 ? forward : backward) += 1 / double(data.size());
  const double independent = 2 * prepared.cutoff * data.interval * double(data.size()) * (forward + backward);
  if (std::min(forward, backward) < kLeastShare || independent < kFewestRows)
    throw CannotIdentify(
        fmt::format("{}: the motor surely slides forward in {:.2g} % and backward in {:.2g} % of the samples "
                    "({:.0f} that are independent); needed are {:.2g} % each and {}",
                    record, 100 * forward, 100 * backward, independent, 100 * kLeastShare, kFewestRows));
}

/// A machine that such a record does not show.
void require_shown(const OutputError& fit, const ServoData& data, const std::string& record) {
  for (const bool plus : {true, false})
    if (const double share = share_beyond(fit, data, plus); share < kLeastOnFlank)
      throw CannotIdentify(
          fmt::format("{}: the flank that holds {} torque is touched in {:.2g} % of the samples in which the "
                      "motor slides",
                      record, plus ? "positive" : "negative", 100 * share));
  const signal::Measured& stiffness = fit.parameters.at("mesh_stiffness");
  const double left = fit.predictions.front().torque_error.error;
  if (!(stiffness.value > stiffness.standard_error) || left > kMostLeft)
    throw CannotIdentify(
        fmt::format("{}: torque hardly follows the position: stiffness {:.3g} +- {:.2g}, {:.3g} % of the "
                    "torque unexplained",
                    record, stiffness.value, stiffness.standard_error, 100 * left));
}

void require_still_gear(const model::Rig& rig, double cutoff, const std::string& record) {
  if (rig.output_coupling.rigid) return;
  const double inertia = rig.gear.inertia + 0.5 * rig.output_coupling.inertia;
  const double resonance = std::sqrt(rig.output_coupling.stiffness / inertia) / (2 * M_PI);
  if (resonance < kGearAbove * cutoff)
    throw CannotIdentify(fmt::format(
        "{}: moves in {:.3g} Hz, at which the gear swings on its coupling ({:.3g} Hz): teeth and coupling "
        "are in series only below a fifth of that; move more slowly",
        record, cutoff, resonance));
}

/// `declared` with its coupling, `rig` without.
OfRecord identify_record(const CaseRecord& r, const model::Rig& declared, const model::Rig& rig,
                         std::vector<std::string>& warnings) {
  const std::string& name = r.record.name;
  ServoData data = servo_data(record::EvenGrid{r.record, r.lost}, rig);
  data.load.clear();
  press_as_recorded(data);
  OutputErrorSettings settings;
  settings.fit = with_bands(settings.fit, rig, {data});
  settings.parameters.assign(std::begin(kNames), std::end(kNames));
  require_still_gear(declared, settings.fit.cutoff, name);
  require_sliding(data, {data, settings.fit.cutoff, 0}, name);
  OutputError fit = fit_output_error(with_starts(rig, data), {data}, settings);
  require_shown(fit, data, name);
  for (auto& [parameter, value] : fit.parameters)
    if (const auto& p = rig_file::servo_parameter(parameter); p.is_friction())
      allow_for_declared(p.get(rig), value);
  ServoPrediction& torque = fit.predictions.front();
  OfRecord out{std::move(fit.parameters),
               torque.torque_error,
               {name, data.interval, std::move(torque.measured_torque), std::move(torque.torque),
                std::move(torque.counts)},
               fit.calibrations.front().torque_delay * data.interval};
  out.values[kOffsetName] = fit.torque_offsets.front();
  if (!fit.lacking.empty())
    warnings.push_back(name + ": what is left looks like " + joined(fit.lacking) +
                       ", which the rig file lacks; the errors hold that");
  return out;
}

/// Mean by the errors, which grow where the records contradict each other.
signal::Measured combined(const std::vector<OfRecord>& found, const std::string& name,
                          std::vector<std::string>& contradicted) {
  std::vector<signal::Measured> values;
  for (const OfRecord& f : found) values.push_back(f.values.at(name));
  const signal::WeightedMean mean = signal::weighted_mean(values);
  if (name != kOffsetName && mean.chance < kAgree) contradicted.push_back(name);
  return mean;
}

/// Stiffness of the teeth from that of teeth and coupling in series.
signal::Measured less_coupling(const signal::Measured& sum, const model::Rig& rig) {
  if (rig.output_coupling.rigid) return sum;
  const double square = rig.mesh.lever() * rig.mesh.lever(),
               coupling = rig.output_coupling.stiffness / square;
  if (!(sum.value + kClearErrors * sum.standard_error < coupling))
    throw CannotIdentify(
        fmt::format("teeth and output coupling together are {:.4g} +- {:.2g} N m/rad stiff, the coupling "
                    "alone is declared "
                    "with {:.4g}: what the teeth have of it is unknown",
                    sum.value * square, sum.standard_error * square, rig.output_coupling.stiffness));
  const double teeth = 1 / (1 / sum.value - 1 / coupling);
  return {teeth, sum.standard_error * std::pow(teeth / sum.value, 2)};
}

/// Whether a value that may be 0 is less than what the file says of it, with what that is uncertain by.
bool is_small(const signal::Measured& m, double declared) {
  return kClearErrors * m.standard_error < kDeclaredUncertainty * declared;
}

/// The table's units are those of a mesh without base radius.
std::string unit_of(const rig_file::RigParameter& p, const model::Rig& rig) {
  const std::string& law = rig.mesh.contact_spec().law;
  if (!p.contact.empty() && !rig.mesh.angular())
    for (const model::ContactLawType& type : model::contact_laws())
      for (const ParameterSpec& spec : type.parameters)
        if (type.name == law && spec.name == p.contact) return spec.unit;
  return model::axis_unit(p.unit, rig.linear);
}

void take(IdentificationCase& c, const std::string& name, signal::Measured m,
          std::vector<std::string>& undetermined) {
  const rig_file::RigParameter& p = rig_file::servo_parameter(name);
  const bool clear = m.value > kClearErrors * m.standard_error,
             gap = p.kind == rig_file::ParameterKind::backlash,
             friction = p.is_friction();  // may be 0, unlike an inertia or a stiffness
  if (!clear && !gap && !(friction && is_small(m, p.get(c.declared)))) {
    undetermined.push_back(name);
    return;
  }
  m.value = std::max(0.0, m.value);
  p.set(c.result.rig, m.value);
  c.result.parameters[name] = m;
  c.result.units[name] = unit_of(p, c.declared);
}

}  // namespace

void require_locked_output(const model::Rig& rig) {
  const model::ContactSpec& contact = rig.mesh.contact_spec();
  const auto refuse = [](const std::string& reason) {
    throw CannotIdentify("a locked output without a torque sensor: " + reason);
  };
  if (rig.coupled) refuse("its torque must be that of this joint alone (gear_train.coupled)");
  if (!contact.values.has("stiffness"))
    refuse("identify needs a contact law with stiffness, not '" + contact.law + "'");
  if (rig.mesh.variation || rig.mesh.pairs)
    refuse("stiffness_variation and tooth_pairs cannot be distinguished from one mean stiffness");
  const bool touches = rig.mesh.contact->needs_impact_speed();
  if (!rig.terms.empty() && (touches || !rig.output_coupling.rigid))
    refuse(
        "terms are counted with rigid couplings and a contact law that does not need the speed of a touch");
  if (rig.output_coupling.rigid) return;
  if (std::fabs(power_of(*rig.mesh.contact) - 1) > kLinear)
    refuse("an elastic output coupling is counted in series with teeth of a linear law, not with '" +
           contact.law + "'");
}

ProcedureReport run_locked_output(IdentificationCase& c) {
  ProcedureReport report{"locked_output", {}, ""};
  const model::Rig rig = without_coupling(c.declared);
  std::vector<OfRecord> found;
  report.records = on_each(c, &CaseRecord::any, [&](const CaseRecord& r) {
    found.push_back(identify_record(r, c.declared, rig, c.result.warnings));
    c.result.torque.push_back(found.back().trace);
  });
  std::vector<std::string> contradicted, undetermined;
  double error = 0, floor = 0;
  for (const OfRecord& f : found) {
    error += std::pow(f.error.error, 2) / double(found.size());
    floor += std::pow(f.error.floor, 2) / double(found.size());
  }
  c.result.channels["torque"] = {std::sqrt(error), std::sqrt(floor)};
  c.result.delay = signal::Measured{found.front().delay, std::nan("")};
  std::map<std::string, signal::Measured> values;  // all of them, or none where one is not determined
  for (const char* name : kNames) {
    values[name] = combined(found, name, contradicted);
    if (name == std::string("mesh_stiffness")) values[name] = less_coupling(values[name], c.declared);
  }
  for (const auto& [name, value] : values) take(c, name, value, undetermined);
  c.result.parameters[kOffsetName] = combined(found, kOffsetName, contradicted);
  c.result.units[kOffsetName] = model::axis_unit("N m", c.declared.linear);
  if (!undetermined.empty())
    c.result.warnings.push_back("the records do not determine " + joined(undetermined) +
                                ": what the rig file says of it is kept");
  if (!contradicted.empty())
    c.result.warnings.push_back("the records contradict each other in " + joined(contradicted) +
                                ": the errors are widened by that; fit each record alone");
  return report;
}

}  // namespace backlash::identification
