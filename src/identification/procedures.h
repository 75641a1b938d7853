// The procedures of Yumrukcal (2013, Chapter 5) as steps that read the records of a case and add findings to
// it.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/identification/identify.h"

namespace backlash {

/// A record with what can be seen of it at once.
struct CaseRecord {
  Record record;  // load side
  bool has_load = false;
  bool motor_moves = true, load_moves = true;
  bool drive() const { return motor_moves && load_moves; }  // motor and load together
  bool motor_alone() const { return has_load && motor_moves && !load_moves; }
};

struct IdentificationCase {
  std::vector<CaseRecord> records;
  std::vector<std::string> names;  // of the parameters to be found
  Rig declared;
  Identification result;  // result.rig: what is known by now
};

IdentificationCase identification_case(const Rig& declared, const std::vector<Record>& records);

struct Procedure {
  std::string name;
  /// Adds findings, details and warnings; returns its report. Throws CannotIdentify.
  ProcedureReport (*run)(IdentificationCase&);
};

/// In the order in which they build on each other.
const std::vector<Procedure>& servo_procedures();

/// Sets result.rig and result.parameters to what all findings say together.
void update_from_findings(IdentificationCase& c);

ProcedureReport run_output_error(IdentificationCase& c);
ProcedureReport run_one_inertia(IdentificationCase& c);

}  // namespace backlash
