// SPDX-License-Identifier: BSD-3-Clause
// All estimators on one record. The live node and the offline command call this and give the same numbers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/apd_skewness.h"
#include "backlash_diagnosis/diagnosis/coherence.h"
#include "backlash_diagnosis/diagnosis/gap_traverse.h"
#include "backlash_diagnosis/diagnosis/lost_motion.h"
#include "backlash_diagnosis/diagnosis/momentum_transfer.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "backlash_diagnosis/diagnosis/verdict.h"
#include "backlash_diagnosis/diagnosis/waveform.h"

namespace backlash::diagnosis {

/// What a rig file says under `diagnosis`, and what its estimators need of the rig (position_difference,
/// momentum_transfer, waveform). An absent part means that its estimator cannot be served.
struct DiagnosisSettings {
  /// How well the rig file knows the machine: relative standard deviation of the stiffness of its couplings.
  double stiffness_uncertainty = 0;
  std::optional<ApdSettings> apd;
  std::optional<LostMotionSettings> lost_motion;
  std::optional<PositionDifferenceSettings> position_difference;
  std::optional<MomentumTransferSettings> momentum_transfer;
  std::optional<WaveformSettings> waveform;
  std::string no_waveform =  // why not, where it is absent
      "the rig has no torque sensor before teeth that follow a power of their penetration, or has terms";

  /// Without the estimator that takes seconds.
  void leave_out_waveform(const std::string& why = "takes seconds: not run here, but by diagnose_record") {
    waveform.reset();
    no_waveform = why;
  }
  std::optional<GapTraverseSettings> gap_traverse;
  std::string no_gap_traverse =  // the same
      "the rig has no free load behind rigid couplings and damped teeth of one contact law";
  /// The same of gap_traverse.
  void leave_out_gap_traverse(
      const std::string& why = "takes a second: not run here, but by diagnose_record") {
    gap_traverse.reset();
    no_gap_traverse = why;
  }
  /// Whether the rig file declares what any estimator needs.
  bool serves_any() const {
    return apd || lost_motion || position_difference || momentum_transfer || waveform || gap_traverse;
  }
  std::optional<CoherenceSettings> coherence;  // a detector beside the estimators
  std::optional<Limits> limits;
};

DiagnosisSettings read_diagnosis_settings(const YamlReader& yaml);

struct Diagnosis {
  std::vector<Estimate>
      estimates;  // one per method of diagnosis_methods(), in that order, or the one asked for
  std::optional<ApdResult> apd;
  std::optional<Mismatch> mismatch;              // of the record and the conditions of the curve
  std::optional<CoherenceDetection> coherence;   // where the settings ask for it
  std::optional<std::string> lock_contradicted;  // why the output is not locked although the file says so
  Verdict verdict;
};

/// What an estimator may look at.
struct DiagnosisInput {
  const record::Record& record;
  const DiagnosisSettings& settings;
  const MonitoringCurve* curve;
  const std::optional<ApdResult>& apd;
  const CurveMatch& match;                       // of the record and the curve
  std::optional<std::string> lock_contradicted;  // why the output is not locked although the file says so
};

/// An estimator: its name in reports, the channels that it needs (one of each group) and what else, and
/// itself. All are in one table, in the order of reports; a new one is a file in this room and a line there.
struct DiagnosisMethod {
  std::string name;
  std::vector<std::vector<record::Channel>> channels;  // none: the signal of diagnosis.apd
  std::string more;                                    // in plain words
  bool by_curve;                                       // needs a monitoring curve
  Estimate (*estimate)(const DiagnosisInput&);
};
const std::vector<DiagnosisMethod>& diagnosis_method_table();

/// What a method needs, in plain words: "motor_position, and motor_torque or sensor_torque; output locked".
std::string needs_of(const DiagnosisMethod& method);

/// The first group of channels of which a record has none, in plain words; empty: it has all that the method
/// needs.
std::string lacking_channel(const DiagnosisMethod& method, const record::Record& record,
                            const std::optional<ApdSettings>& apd);

/// Names of all estimators.
const std::vector<std::string>& diagnosis_methods();

/// Whether an estimator needs a monitoring curve; false for an unknown name.
bool needs_curve(const std::string& method);

/// Runs the estimators (`method` empty: all) on what a SampleStream has cut. Throws InvalidParameter for an
/// unknown method; everything that the samples lack becomes a status with its reason.
Diagnosis diagnose(const PeriodWindow& window, const DiagnosisSettings& settings,
                   const MonitoringCurve* curve, const std::optional<Baseline>& baseline = std::nullopt,
                   const std::string& method = "");

/// The same for the whole excitation periods of a record after settling, or all of it where the rig declares
/// no APD or the excitation has no period: cut_periods().
Diagnosis diagnose(const record::Record& record, const DiagnosisSettings& settings,
                   const MonitoringCurve* curve, const std::optional<Baseline>& baseline = std::nullopt,
                   const std::string& method = "");

}  // namespace backlash::diagnosis
