// SPDX-License-Identifier: BSD-3-Clause
// The one procedure for a machine with a locked output and no torque sensor.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/procedures/locked_output.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/weighted_mean.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kClearErrors = 2;  // choice: standard errors, from which a value is reported
constexpr double kAgree = 0.01;     // choice: chance below which records contradict each other
constexpr double kGearAbove = 5;    // choice: times the band of the fit: then its inertia counts 4 %
constexpr double kLinear = 1e-6;    // theory: relative, of a law whose force doubles with the depth

/// The same machine with the coupling taken for a part of the teeth. The stiffness of both is fitted; each
/// damps its share of the motion, as the file has it.
model::Rig without_coupling(const model::Rig& rig) {
  model::Rig out = rig;
  out.output_coupling = {};
  model::ContactSpec spec = rig.mesh.contact_spec();
  if (rig.output_coupling.rigid || !spec.values.has("damping")) return out;
  const double square = rig.mesh.lever() * rig.mesh.lever(),
               teeth = rig.output_coupling.stiffness /
                       (rig.output_coupling.stiffness + square * spec.values.at("stiffness"));
  spec.values["damping"] = teeth * teeth * spec.values.at("damping") +
                           std::pow(1 - teeth, 2) * rig.output_coupling.damping / square;
  out.mesh.contact = model::make_contact_law(spec.law, spec.values);
  return out;
}

using Member = signal::Measured LockedOutput::*;
struct Quantity {
  const char* name;
  Member at;
  bool common;  // of all records; else of each
};
const char* const kOffsetName = "offset";  // of a record: the rig file has no place for it
const Quantity kQuantities[] = {{"motor_inertia", &LockedOutput::inertia, true},
                                {"motor_viscous", &LockedOutput::viscous, true},
                                {"motor_coulomb", &LockedOutput::coulomb, true},
                                {"mesh_stiffness", &LockedOutput::stiffness, true},
                                {"backlash_angle", &LockedOutput::backlash_angle, true},
                                {kOffsetName, &LockedOutput::offset, false}};

/// Mean by the errors, which grow where the records contradict each other.
signal::Measured combined(const std::vector<LockedOutput>& found, const Quantity& q,
                          std::vector<std::string>& contradicted) {
  std::vector<signal::Measured> values;
  for (const LockedOutput& f : found) values.push_back(f.*q.at);
  const signal::WeightedMean mean = signal::weighted_mean(values);
  if (q.common && mean.chance < kAgree) contradicted.emplace_back(q.name);
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

void require_still_gear(const model::Rig& rig, const LockedOutput& found, const std::string& record) {
  if (rig.output_coupling.rigid) return;
  const double inertia = rig.gear.inertia + 0.5 * rig.output_coupling.inertia;
  const double resonance = std::sqrt(rig.output_coupling.stiffness / inertia) / (2 * M_PI);
  if (resonance < kGearAbove * found.cutoff)
    throw CannotIdentify(fmt::format(
        "{}: moves in {:.3g} Hz, at which the gear swings on its coupling ({:.3g} Hz): teeth and coupling "
        "are in series only below a fifth of that; move more slowly",
        record, found.cutoff, resonance));
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
  const double one = rig.mesh.contact->force(1e-4, 0, 0), two = rig.mesh.contact->force(2e-4, 0, 0);
  if (std::fabs(two / one - 2) > kLinear)
    refuse("an elastic output coupling is counted in series with teeth of a linear law, not with '" +
           contact.law + "'");
}

ProcedureReport run_locked_output(IdentificationCase& c) {
  ProcedureReport report{"locked_output", {}, ""};
  const model::Rig rig = without_coupling(c.declared);
  std::vector<LockedOutput> found;
  report.records = on_each(c, &CaseRecord::any, [&](const CaseRecord& r) {
    LockedOutput one = identify_locked_output(r.record, rig);
    require_still_gear(c.declared, one, r.record.name);
    c.result.torque.push_back({r.record.name, one.interval, one.measured, one.predicted, one.counts});
    c.result.warnings.insert(c.result.warnings.end(), one.warnings.begin(), one.warnings.end());
    found.push_back(std::move(one));
  });
  std::vector<std::string> contradicted, undetermined;
  double error = 0, floor = 0;
  for (const LockedOutput& f : found) {
    error += f.relative_error * f.relative_error / double(found.size());
    floor += f.floor * f.floor / double(found.size());
  }
  c.result.channels["torque"] = {std::sqrt(error), std::sqrt(floor)};
  std::map<std::string, signal::Measured> values;  // all of them, or none where one is not determined
  for (const Quantity& q : kQuantities) {
    signal::Measured& m = values[q.name] = combined(found, q, contradicted);
    if (q.at == &LockedOutput::inertia) m.value -= model::GearTrain(rig).motor_inertia() - rig.motor.inertia;
    if (q.at == &LockedOutput::stiffness) m = less_coupling(m, c.declared);
  }
  for (const auto& [name, value] : values)
    if (name != kOffsetName) take(c, name, value, undetermined);
  c.result.parameters[kOffsetName] = values.at(kOffsetName);
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
