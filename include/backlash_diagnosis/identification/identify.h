// SPDX-License-Identifier: BSD-3-Clause
// From records to the parameters of the machine: chooses the procedures that the records allow, and puts
// together what they find.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/identification/finding.h"
#include "backlash_diagnosis/identification/fit/output_error.h"
#include "backlash_diagnosis/identification/procedures/clearance.h"
#include "backlash_diagnosis/identification/procedures/decay.h"
#include "backlash_diagnosis/identification/procedures/friction_lines.h"
#include "backlash_diagnosis/identification/procedures/gap_map.h"
#include "backlash_diagnosis/identification/procedures/line_inertia.h"
#include "backlash_diagnosis/identification/procedures/one_inertia.h"
#include "backlash_diagnosis/identification/procedures/two_mass.h"
#include "backlash_diagnosis/identification/several_machines.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/signal/robust_mean.h"

namespace backlash::identification {

/// What became of a procedure.
struct ProcedureReport {
  std::string name;
  std::vector<std::string> records;  // that it used; empty: none allows it
  std::string message;               // what it found, or why not
};

/// Friction lines of the motor alone or of the whole drive.
struct FrictionDetail {
  std::string subject;              // "motor", "drive"
  std::vector<FrictionLine> lines;  // forward, backward, as far as they are there
};

struct InertiaDetail {
  std::string subject;
  std::vector<LineInertia> runs;
  signal::RobustMean combined;
};

struct ResponseDetail {
  FrequencyResponse response;
  bool held = false;  // torque held between samples
  Resonances resonances;
  InertiaPlateaus plateaus;
  std::map<std::string, StiffnessSplit> alternatives;  // "a", "b", "c" of Table 5.1
  TwoMassFit fit;
};

/// Fit and record of one channel, for a plot.
struct ChannelTrace {
  std::string record;
  double interval = 0;  // s
  std::vector<double> measured, predicted;
  std::vector<char> counts;
};

/// All values are those of the load side of the reduction.
struct Identification {
  model::Rig rig;  // fitted
  std::map<std::string, signal::Measured> parameters;
  std::map<std::string, std::string> units;
  std::map<std::string, ChannelError> channels;  // torque, deflection; of all records of the last fit
  std::vector<ProcedureReport> procedures;
  std::vector<Finding> findings;
  std::vector<std::string> warnings;

  std::optional<SeveralMachines> several;  // where the records contradict each other; errors hold them all
  /// Why the machine is none of the rig file's kind: it explains less than half of what a channel does. The
  /// errors of the values that this channel determines are infinite then.
  std::optional<std::string> unexplained;
  std::vector<FrictionDetail> friction;
  std::vector<InertiaDetail> inertia;
  std::optional<ResponseDetail> response;
  std::optional<DecayIdentification> decay;
  std::optional<Clearance> clearance;
  std::optional<GapMap> gap_map;
  std::optional<signal::Measured> delay;  // s, of the torque, beyond the hold between samples
  std::optional<OneInertia> one_inertia;
  std::vector<ChannelTrace> torque, deflection;
  std::optional<diagnosis::WaveformCommissioning> commissioning;  // of a gear train, else none
};

/// For a gear train with a torque sensor and a locked output (diagnosis/waveform.h). Throws CannotIdentify,
/// BadData.
Identification commission(const rig_file::RigFile& file, const std::vector<record::Record>& records);

/// For a rig with two inertias or one (mesh: rigid). Starts from what the rig declares. Throws CannotIdentify
/// where no procedure can use any record, with all reasons; BadData; Cancelled.
Identification identify(const model::Rig& declared, const std::vector<record::Record>& records,
                        const Progress& progress = nullptr);

}  // namespace backlash::identification
