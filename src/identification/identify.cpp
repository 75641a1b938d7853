#include "backlash_diagnosis/identification/identify.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/rig_parameters.h"
#include "procedures.h"

namespace backlash {
namespace {

constexpr double kMisfit = 1.5;  // times the noise floor, beyond which the model lacks something

double travel(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

/// A body stands where it moves less than a twentieth of what the other does.
CaseRecord case_record(const Record& record, const Rig& declared) {
  CaseRecord r;
  r.record = load_side(record, declared);
  r.has_load = r.record.has(Channel::load_position);
  if (!r.record.has(Channel::motor_position) || !r.has_load) return r;
  const double motor = travel(r.record.column(Channel::motor_position));
  const double load = travel(r.record.column(Channel::load_position));
  r.motor_moves = motor > 0.05 * load;
  r.load_moves = load > 0.05 * motor;
  return r;
}

/// What can be fitted: all that the rig declares. Asymmetries only where it declares directions apart.
std::vector<std::string> parameter_names(const Rig& rig) {
  std::vector<std::string> names;
  for (const RigParameter& p : servo_parameters()) {
    if (p.name == "start_in_gap") continue;
    if (p.get(rig) != 0) names.push_back(p.name);
  }
  return names;
}

/// Both directions declared alike, and the friction lines say otherwise.
void warn_of_asymmetry(IdentificationCase& c) {
  for (const FrictionDetail& d : c.result.friction) {
    if (d.lines.size() != 2) continue;
    const Measured &forward = d.lines[0].coulomb, &backward = d.lines[1].coulomb;
    const double difference = forward.value + backward.value;  // the backward one is negative
    const double error = std::hypot(forward.standard_error, backward.standard_error);
    const bool declared = c.declared.motor.coulomb_asymmetry != 0 || c.declared.link.coulomb_asymmetry != 0;
    if (!declared && std::fabs(difference) > 3 * error)
      c.result.warnings.push_back("Coulomb friction of the " + d.subject + " differs by " +
                                  to_text(difference) +
                                  " N m between the directions, which the rig file does not declare");
  }
}

void warn_of_misfit(Identification& result) {
  for (const auto& [name, channel] : result.channels)
    if (channel.error > kMisfit * channel.floor)
      result.warnings.push_back(
          name + ": the fitted model leaves " + to_text(std::round(1e4 * channel.error) / 100) +
          " % where noise alone would leave " + to_text(std::round(1e4 * channel.floor) / 100) +
          " %; trace_residual tells what it lacks");
}

void require_servo(const Rig& rig) {
  if (!rig.input_coupling.rigid || !rig.output_coupling.rigid || rig.link_locked)
    throw CannotIdentify(
        "identify knows machines of one inertia (mesh: rigid) and of two (rigid couplings, free link); "
        "this rig is neither");
  for (const char* name : {"stiffness", "damping"})
    if (!rig.mesh.contact_spec.values.has(name))
      throw CannotIdentify("identify needs a contact law with stiffness and damping, not '" +
                           rig.mesh.contact_spec.law + "'");
}

}  // namespace

IdentificationCase identification_case(const Rig& declared, const std::vector<Record>& records) {
  IdentificationCase c;
  c.declared = load_side(declared);
  c.result.rig = c.declared;
  for (const Record& record : records) c.records.push_back(case_record(record, declared));
  if (declared.mesh.rigid) return c;
  c.names = parameter_names(c.declared);
  for (const std::string& name : c.names) c.result.units[name] = servo_parameter(name).unit;
  return c;
}

Identification identify(const Rig& declared, const std::vector<Record>& records, const Progress& progress) {
  IdentificationCase c = identification_case(declared, records);
  std::vector<Procedure> procedures = {{"one_inertia", run_one_inertia}};
  if (!declared.mesh.rigid) {
    require_servo(declared);
    procedures = servo_procedures();
  }
  double done = 0;
  for (const Procedure& procedure : procedures) {
    if (progress && !progress(done++ / double(procedures.size()), procedure.name)) throw Cancelled();
    try {
      c.result.procedures.push_back(procedure.run(c));
    } catch (const CannotIdentify& error) {
      c.result.procedures.push_back({procedure.name, {}, error.what()});
      continue;
    }
    if (!declared.mesh.rigid && procedure.run != run_output_error) update_from_findings(c);
  }
  if (progress) progress(1, "done");
  if (c.result.parameters.empty()) {
    std::vector<std::string> reasons;
    for (const ProcedureReport& report : c.result.procedures)
      reasons.push_back(report.name + ": " + report.message);
    throw CannotIdentify("the records allow no procedure: " + joined(reasons));
  }
  warn_of_asymmetry(c);
  warn_of_misfit(c.result);
  return c.result;
}

}  // namespace backlash
