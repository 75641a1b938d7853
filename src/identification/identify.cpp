// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/identification/procedures/gap_terms.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "fit/joint_fit.h"
#include "procedures/procedures.h"

namespace backlash::identification {
namespace {

void require_finite(const record::Record& record) {
  for (const record::Channel channel : record::kChannels)
    for (std::size_t k = 0; k < record.column(channel).size(); ++k)
      if (!std::isfinite(record.column(channel)[k]))
        throw BadData(record.name, record::channel_name(channel) +
                                       " has no value at t = " + record::time_text(record.time[k]) + " s");
}

/// A body stands where it moves less than a twentieth of what the other does.
CaseRecord case_record(const record::Record& record, const model::Rig& declared) {
  CaseRecord r;
  require_finite(record);
  record::EvenGrid even = record::evenly_sampled_grid(load_side(record, declared));
  r.record = std::move(even.record);
  r.lost = std::move(even.lost);
  r.has_load = r.record.has(record::Channel::load_position);
  if (!r.record.has(record::Channel::motor_position) || !r.has_load) return r;
  const double motor = signal::peak_to_peak(r.record.column(record::Channel::motor_position));
  const double load = signal::peak_to_peak(r.record.column(record::Channel::load_position));
  r.motor_moves = motor > 0.05 * load;
  r.load_moves = load > 0.05 * motor;
  return r;
}

/// A record that cannot be used is left out with a warning; it is an error only if no record is left.
void read_records(const std::vector<record::Record>& records, const model::Rig& declared,
                  IdentificationCase& c) {
  for (const record::Record& record : records) {
    try {
      c.records.push_back(case_record(record, declared));
    } catch (const BadData& error) {
      if (records.size() == 1) throw;
      c.result.warnings.push_back(std::string("not used: ") + error.what());
    }
  }
  if (c.records.empty())
    throw BadData(records.empty() ? "identify" : c.result.warnings.front(), "no record that could be used");
}

/// What can be fitted: all that the rig declares. Asymmetries only where it declares directions apart.
std::vector<std::string> parameter_names(const model::Rig& rig) {
  std::vector<std::string> names;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    if (p.kind == rig_file::ParameterKind::start_in_gap) continue;
    if (rig.coupled && !rig_file::shown_by_deflection(p)) continue;
    const bool skew = p.kind == rig_file::ParameterKind::encoder_skew && p.known_to(rig);
    if (p.get(rig) != 0 || skew) names.push_back(p.name);
  }
  return names;
}

/// All but the first and the last assume that the torque is this joint's alone, and that it has two bodies.
std::vector<Procedure> procedures_for(const model::Rig& rig) {
  if (rig.mesh.rigid) return {{"one_inertia", run_one_inertia}};
  if (rig.link_locked) return {{"locked_output", run_locked_output}};
  if (rig.coupled || !rig.output_coupling.rigid)
    return {servo_procedures().front(), servo_procedures().back()};
  return servo_procedures();
}

/// The skew of the encoders that was taken out of the records is part of what was found.
void put_skew_back(IdentificationCase& c) {
  const std::string& name =
      rig_file::servo_parameter(rig_file::RigPart::sensors, rig_file::ParameterKind::encoder_skew).name;
  if (c.skew.standard_error == 0) return;  // no record determines it
  c.result.rig.encoder_skew += c.skew.value;
  const auto fitted = c.result.parameters.find(name);
  if (fitted == c.result.parameters.end())
    c.result.parameters[name] = c.skew;
  else
    fitted->second.value += c.skew.value;
}

/// One mean gap: that of the fit, which the rig file gets. A rig that declares no variation keeps none.
void agree_on_gap(const model::Rig& declared, Identification& result) {
  const auto gap = result.parameters.find(
      rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::backlash).name);
  if (gap == result.parameters.end()) return;
  *result.gap_map = with_mean_gap(*result.gap_map, gap->second);
  gap->second = result.gap_map->mean_gap;
  if (gap_varies(declared))
    result.rig = with_gap_map(result.rig, *result.gap_map, GapUse::variation);
  else
    result.rig.terms = model::load_side(declared).terms;
}

/// Relative, in per cent; of a channel without a sample that counts, or that is constant, there is none.
std::string share_text(double relative) {
  return std::isfinite(relative) ? to_text(std::round(1e4 * relative) / 100) + " %"
                                 : "an undefined share of a channel that does not vary";
}

/// The rig declares equal friction in both directions, and the friction lines contradict it.
void warn_of_asymmetry(IdentificationCase& c) {
  for (const FrictionDetail& d : c.result.friction) {
    if (d.lines.size() != 2) continue;
    const signal::Measured &forward = d.lines[0].coulomb, &backward = d.lines[1].coulomb;
    const double difference = forward.value + backward.value;  // the backward one is negative
    const double error = std::hypot(forward.standard_error, backward.standard_error);
    const bool declared = c.declared.motor.coulomb_asymmetry != 0 || c.declared.link.coulomb_asymmetry != 0;
    if (!declared && std::fabs(difference) > 3 * error)
      c.result.warnings.push_back("Coulomb friction of the " + d.subject + " differs by " +
                                  to_text(difference) +
                                  " N m between the directions, which the rig file does not declare");
  }
}

/// Friction of one inertia builds up over a travel after each reversal, which the noise does not know of.
constexpr double kBuildUp = 0.005;  // simulation: of the torque

/// A channel of which the machine leaves more than this share of the squares, beyond noise, is not explained
/// by it: its mean alone leaves 1.
constexpr double kMostLeft = 0.5;    // choice
constexpr double kMostNoise = 0.99;  // theory: of a square; a channel of noise alone shows nothing to explain

double left_beyond_noise(const ChannelError& c) {
  const double noise = std::min(c.floor * c.floor, kMostNoise);
  return (c.error * c.error - noise) / (1 - noise);
}

/// A machine of another kind than the rig file's has no such values: a fit would make them arbitrary.
void withhold_unexplained(Identification& result) {
  if (result.several) return;
  for (const auto& [name, channel] : result.channels) {
    if (left_beyond_noise(channel) <= kMostLeft) continue;  // none of NaN is
    const std::string reason =
        std::isfinite(channel.error)
            ? fmt::format(
                  "{}: the fitted machine leaves {} where noise alone would leave {}: it is no machine of "
                  "the rig file's kind, and no value is reported that this channel shows; "
                  "trace_residual looks for what the rig file lacks",
                  name, share_text(channel.error), share_text(channel.floor))
            : fmt::format(
                  "{}: no sample of it counts, as the motor never slides one way for long: it chatters "
                  "or rests; record a motion of moves that last, with a controller that does not swing",
                  name);
    result.unexplained = result.unexplained ? *result.unexplained + ". " + reason : reason;
    for (auto& [parameter, measured] : result.parameters) {
      const bool shown = name == "torque" || result.one_inertia ||
                         rig_file::shown_by_deflection(rig_file::servo_parameter(parameter));
      if (shown) measured.standard_error = std::numeric_limits<double>::infinity();
    }
  }
  if (result.unexplained) result.warnings.push_back(*result.unexplained);
}

void warn_of_misfit(Identification& result) {
  if (result.several) {
    result.warnings.push_back(description(*result.several, result.units, false) +
                              ". The values that follow are of none of them, and their errors hold them all");
    return;
  }
  const double build_up = result.one_inertia ? kBuildUp : 0;
  for (const auto& [name, channel] : result.channels)
    if (left_beyond_noise(channel) <= kMostLeft &&
        channel.error > std::max(kShowsMissingEffect * channel.floor, std::hypot(channel.floor, build_up)))
      result.warnings.push_back(
          fmt::format("{}: the fitted model leaves {} where noise alone would leave {}: the machine has an "
                      "effect that the "
                      "rig file lacks",
                      name, share_text(channel.error), share_text(channel.floor)));
  withhold_unexplained(result);
}

void require_served(const model::Rig& rig) {
  if (rig.input_coupling.rigid && rig.link_locked) return require_locked_output(rig);
  if (!model::has_two_inertias(rig) && !(rig.bearing_at_gear && rig.input_coupling.rigid))
    throw CannotIdentify(
        std::string(
            "identify knows one inertia (mesh: rigid), two (rigid couplings or a bearing at the gear, free "
            "link), a locked output (rigid input coupling), and a torque sensor (elastic input coupling; "
            "mesh linear, power law or Hunt-Crossley; damped; no terms); this rig has ") +
        (rig.input_coupling.rigid ? "a rigid" : "an elastic") + " input coupling, " +
        (rig.output_coupling.rigid ? "a rigid" : "an elastic") + " output coupling and a " +
        (rig.link_locked ? "locked" : "free") + " link");
  for (const char* name : {"stiffness", "damping"})
    if (!rig.mesh.contact_spec().values.has(name))
      throw CannotIdentify("identify needs a contact law with stiffness and damping, not '" +
                           rig.mesh.contact_spec().law + "'");
}

}  // namespace

IdentificationCase identification_case(const model::Rig& declared,
                                       const std::vector<record::Record>& records) {
  IdentificationCase c;
  c.declared = model::load_side(declared);
  c.result.rig = c.declared;
  read_records(records, declared, c);
  if (declared.mesh.rigid) return c;
  require_served(declared);
  if (declared.link_locked) return c;
  c.names = parameter_names(c.declared);
  for (const std::string& name : c.names) c.result.units[name] = rig_file::servo_parameter(name).unit;
  return c;
}

Identification identify(const model::Rig& declared, const std::vector<record::Record>& records,
                        const Progress& progress) {
  IdentificationCase c = identification_case(declared, records);
  const std::vector<Procedure> procedures = procedures_for(declared);
  double done = 0;
  for (const Procedure& procedure : procedures) {
    if (progress && !progress(done++ / double(procedures.size()), procedure.name)) throw Cancelled();
    try {
      c.result.procedures.push_back(procedure.run(c));
    } catch (const CannotIdentify& error) {
      c.result.procedures.push_back({procedure.name, {}, error.what()});
      continue;
    }
    if (declared.mesh.rigid || declared.link_locked || procedure.run == run_output_error) continue;
    if (c.result.gap_map && (c.result.gap_map->varies || gap_varies(declared)))
      c.declared = with_gap_map(c.declared, *c.result.gap_map);
    update_from_findings(c);
  }
  if (progress) progress(1, "done");
  if (c.result.parameters.empty()) {
    std::vector<std::string> reasons;
    for (const ProcedureReport& report : c.result.procedures)
      reasons.push_back(report.name + ": " + report.message);
    throw CannotIdentify("the records allow no procedure: " + joined(reasons));
  }
  if (c.result.gap_map && !declared.mesh.rigid) agree_on_gap(declared, c.result);
  if (!declared.mesh.rigid) put_skew_back(c);
  warn_of_asymmetry(c);
  warn_of_misfit(c.result);
  return c.result;
}

}  // namespace backlash::identification
