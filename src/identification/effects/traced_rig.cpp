// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/effects/traced_rig.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/term_text.h"
#include "backlash_diagnosis/rig_file/rig_document.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::identification {
namespace {

/// An entry of `terms:` whose comments have the units of a linear axis.
std::string linear_entry(const std::string& entry) {
  std::istringstream in(entry);
  std::string out;
  for (std::string line; std::getline(in, line);) {
    const std::size_t comment = std::min(line.find("  # "), line.size());
    out += line.substr(0, comment) + model::axis_unit(line.substr(comment), true) + "\n";
  }
  return out;
}

/// The entries of all terms that the declared rig has not.
std::vector<std::string> new_entries(const model::Rig& declared, const model::Rig& augmented) {
  std::vector<std::string> entries;
  for (std::size_t i = declared.terms.size(); i < augmented.terms.size(); ++i) {
    const std::string entry = model::term_text(*augmented.terms[i]);
    entries.push_back(declared.linear ? linear_entry(entry) : entry);
  }
  return entries;
}

}  // namespace

std::string traced_rig_text(const rig_file::RigFile& declared, const Trace& trace) {
  std::map<std::string, std::string> units;
  for (const auto& [name, unit] : trace.units) units[name] = model::axis_unit(unit, declared.rig.linear);
  rig_file::RigDocument document(declared);
  const model::ContactSpec& contact = trace.augmented.mesh.contact_spec();
  if (!declared.rig.mesh.rigid && contact.law != declared.rig.mesh.contact_spec().law) {
    document.set_contact_law(contact);
    units[rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::stiffness).name] +=
        "^1.5";
  }
  const model::Coupling& shaft = trace.augmented.output_coupling;
  if (shaft.rigid != declared.rig.output_coupling.rigid) {
    document.set("gear_train.output_coupling",
                 fmt::format("{{stiffness: {:.6g}, damping: 0, bearing: gear}}", shaft.stiffness));
    if (!(declared.rig.gear.inertia > 0))
      document.set("gear_train.gear", fmt::format("{{inertia: {:.6g}}}", trace.augmented.gear.inertia));
  }
  document.set_fitted({trace.augmented, declared.rig.motor_axis_ratio(), trace.parameters, units});
  document.set_whole_path_of_test_runs();
  document.append_terms(new_entries(declared.rig, trace.augmented), "found by trace_residual");
  document.read();  // what is written can be read
  return document.text();
}

void check_traced_rig_text(const rig_file::RigFile& declared) {
  rig_file::RigDocument(declared).check_changes(declared.rig);
}

}  // namespace backlash::identification
