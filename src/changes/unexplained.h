// SPDX-License-Identifier: BSD-3-Clause
// A stretch of a record that is louder than the healthy machine is: whatever happens there, no
// effect that was tried explains it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "backlash_diagnosis/changes/change_settings.h"

namespace backlash::changes {

struct LoudStretch {
  double from = 0, to = 0;  // s
  bool from_beginning = false, to_end = false;
  double times = 0;   // -, mean square inside over that of the healthy machine
  double excess = 0;  // sum of squares that are too many
  double gain = 0;    // twice the log likelihood ratio of another variance inside
};

/// `times`: s, of rows; `squares`: of what is left there over what the healthy machine leaves, mean 1. The
/// likeliest stretch of at least ChangeSettings::least_windows windows that is ChangeSettings::unknown_louder
/// times as loud as a healthy machine, and as the rest of the record.
std::optional<LoudStretch> loud_stretch(const std::vector<double>& times, const std::vector<double>& squares,
                                        const ChangeSettings& settings);

/// A stretch of at least ChangeSettings::louder_windows windows that is ChangeSettings::louder times as loud
/// as a healthy machine and as the rest of the record, while the means of `motion`, a row of values each
/// time, do not differ between the two. Weaker than loud_stretch(), so that it needs the record itself to
/// compare with.
std::optional<LoudStretch> louder_stretch(const std::vector<double>& times,
                                          const std::vector<double>& squares, const Eigen::MatrixXd& motion,
                                          const ChangeSettings& settings);

}  // namespace backlash::changes
