// SPDX-License-Identifier: BSD-3-Clause
// Since when a machine differs from what it was when it was commissioned, and by which effect. Generalised
// likelihood ratio over effect and onset (Basseville and Nikiforov 1993, "Detection of Abrupt Changes", 2.4
// and 4.2) of the residual of the equation of motion
//   u = J a + c w + F sign(w) + b + g_c cos q + g_s sin q + warm-up + what else the healthy machine shows.
// Values of the healthy machine are nuisances with a spread from record to record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/changes/change_settings.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::changes {

struct ChangeSize {
  std::string name, unit;
  signal::Measured measured;  // what was added at the onset, sign as in the effect's equation
};

struct Change {
  std::string effect;                   // id of an effect, name of a declared value, or "unknown"
  std::string joint, link;              // of an arm
  double since = 0;                     // s, in the record's time
  double since_from = 0, since_to = 0;  // s
  std::optional<double> until;          // s; absent: to the end of the record
  std::vector<ChangeSize> size;         // empty where unknown
  std::vector<std::string> alike;       // other effects that explain the record as well
  double gain = 0;                      // twice the log likelihood ratio
  double error_before = 0,
         error_after = 0;  // N m, rms of the residual after the onset; of the chain: all joints
};

/// A joint of an arm that this record does not judge.
struct Unjudged {
  std::string joint, why;
};

struct Changes {
  std::vector<Change> changes;             // by onset
  std::size_t windows = 0;                 // of ChangeSettings::window that could be judged
  double threshold = kNaN;                 // of the gain, for an effect with one value
  double noise = 0;                        // N m, rms of the residual of the healthy records
  double deflection_noise = kNaN;          // rad, the same of the deflection; NaN: not looked at
  std::vector<std::string> healthy_terms;  // what the healthy machine shows beside friction and gravity
  std::vector<std::string> different;      // effects that the record has from its beginning: no change in it
  std::string
      cannot_tell;  // what no effect explains while nothing says that the machine has changed; or empty
  std::vector<Unjudged> unjudged;
  std::vector<std::string> warnings;
};

/// Throws CannotIdentify where the machine is not of one inertia or the records move too little, BadData for
/// a record without motor_torque or motor_position or with stamps that make no sense, Cancelled.
Changes detect_changes(const model::Rig& rig, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings = {},
                       const Progress& progress = {});

}  // namespace backlash::changes
