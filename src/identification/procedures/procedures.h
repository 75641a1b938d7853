// SPDX-License-Identifier: BSD-3-Clause
// The procedures of Yumrukcal (2013, Chapter 5) as steps that read the records of a case and add findings to
// it.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/identify.h"

namespace backlash::identification {

/// A record with what can be seen of it at once.
struct CaseRecord {
  record::Record record;  // load side
  bool has_load = false;
  bool motor_moves = true, load_moves = true;
  std::vector<bool> lost = {};  // of each sample: it was not recorded
  bool any() const { return true; }
  bool drive() const { return motor_moves && load_moves; }  // motor and load together
  bool motor_alone() const { return has_load && motor_moves && !load_moves; }
};

struct IdentificationCase {
  std::vector<CaseRecord> records;
  std::vector<std::string> names;  // of the parameters to be found
  signal::Measured skew{0, 0};     // s, of the load encoder, that has been taken out of the records
  model::Rig declared;
  Identification result;  // result.rig: what is known by now
};

IdentificationCase identification_case(const model::Rig& declared,
                                       const std::vector<record::Record>& records);

struct Procedure {
  std::string name;
  /// Adds findings, details and warnings; returns its report. Throws CannotIdentify.
  ProcedureReport (*run)(IdentificationCase&);
};

/// In the order in which they build on each other.
const std::vector<Procedure>& servo_procedures();

/// Sets result.rig and result.parameters to what all findings say together.
void update_from_findings(IdentificationCase& c);

/// The steps, one file each in this folder.
ProcedureReport run_encoder_skew(IdentificationCase& c);
ProcedureReport run_friction_lines(IdentificationCase& c);
ProcedureReport run_line_inertia(IdentificationCase& c);
ProcedureReport run_frequency_response(IdentificationCase& c);
ProcedureReport run_decay(IdentificationCase& c);
ProcedureReport run_clearance(IdentificationCase& c);
ProcedureReport run_gap_map(IdentificationCase& c);
ProcedureReport run_output_error(IdentificationCase& c);
ProcedureReport run_one_inertia(IdentificationCase& c);
ProcedureReport run_locked_output(IdentificationCase& c);

/// Throws CannotIdentify where run_locked_output() cannot serve this rig, with the reason.
void require_locked_output(const model::Rig& rig);

// What the steps share.

std::string plus_minus(const signal::Measured& m, const std::string& unit);

/// With what the procedure's model leaves out, as a share of the value.
signal::Measured with_model_error(signal::Measured m, double share);

void add_finding(IdentificationCase& c, const std::string& procedure,
                 std::map<std::string, double> combination, const signal::Measured& measured);

/// A parameter as it is known by now.
signal::Measured known(const IdentificationCase& c, const std::string& name);

/// A missing effect draws a friction or a damping to zero, where a logarithm has no error to speak of: what
/// was declared is no less likely.
void allow_for_declared(double declared, signal::Measured& fitted);

/// Calls `body` on every record that `wanted` accepts and keeps the names of those that it can use; the
/// reasons of the others make the message of the CannotIdentify where there is none.
std::vector<std::string> on_each(const IdentificationCase& c, bool (CaseRecord::*wanted)() const,
                                 const std::function<void(const CaseRecord&)>& body);

}  // namespace backlash::identification
