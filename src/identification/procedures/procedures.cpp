// SPDX-License-Identifier: BSD-3-Clause
#include "procedures.h"

#include <fmt/core.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::identification {
std::string plus_minus(const signal::Measured& m, const std::string& unit) {
  return fmt::format("{:.5g} +- {:.2g} {}", m.value, m.standard_error, unit);
}

signal::Measured with_model_error(signal::Measured m, double share) {
  m.standard_error = std::hypot(m.standard_error, share * m.value);
  return m;
}

void add_finding(IdentificationCase& c, const std::string& procedure,
                 std::map<std::string, double> combination, const signal::Measured& measured) {
  if (std::isfinite(measured.value) && measured.standard_error > 0)
    c.result.findings.push_back({procedure, std::move(combination), measured});
}

signal::Measured known(const IdentificationCase& c, const std::string& name) {
  const double value = rig_file::servo_parameter(name).get(c.result.rig);
  const auto found = c.result.parameters.find(name);
  return {value,
          found == c.result.parameters.end() ? kDeclaredUncertainty * value : found->second.standard_error};
}

void allow_for_declared(double declared, signal::Measured& fitted) {
  if (fitted.standard_error > std::fabs(fitted.value))
    fitted.standard_error = std::hypot(fitted.standard_error, declared - fitted.value);
}

std::vector<std::string> on_each(const IdentificationCase& c, bool (CaseRecord::*wanted)() const,
                                 const std::function<void(const CaseRecord&)>& body) {
  std::vector<std::string> used, reasons;
  for (const CaseRecord& record : c.records) {
    if (!(record.*wanted)()) continue;
    try {
      body(record);
      used.push_back(record.record.name);
    } catch (const CannotIdentify& error) {
      const std::string reason = error.what();
      const bool named = reason.compare(0, record.record.name.size(), record.record.name) == 0;
      reasons.push_back(named ? reason : record.record.name + ": " + reason);
    }
  }
  if (used.empty()) throw CannotIdentify(reasons.empty() ? "no such record" : joined(reasons));
  return used;
}

const std::vector<Procedure>& servo_procedures() {
  static const std::vector<Procedure> procedures = {{"encoder_skew", run_encoder_skew},
                                                    {"friction_lines", run_friction_lines},
                                                    {"line_inertia", run_line_inertia},
                                                    {"frequency_response", run_frequency_response},
                                                    {"decay", run_decay},
                                                    {"clearance", run_clearance},
                                                    {"gap_map", run_gap_map},
                                                    {"output_error", run_output_error}};
  return procedures;
}

void update_from_findings(IdentificationCase& c) {
  c.result.parameters = combine_findings(c.result.findings, c.declared, c.names);
  c.result.rig = c.declared;
  for (const auto& [name, m] : c.result.parameters) {
    const rig_file::RigParameter& parameter = rig_file::servo_parameter(name);
    if (!parameter.positive() || m.value > 0) parameter.set(c.result.rig, m.value);
  }
}

}  // namespace backlash::identification
