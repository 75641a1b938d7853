// SPDX-License-Identifier: BSD-3-Clause
// A record on an even grid, as columns for a regression: all pass the same filter without delay.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "backlash_diagnosis/identification/changes/change_settings.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::identification {

/// Common to all records of a machine.
struct MotionSampling {
  double interval = 0;         // s
  double cutoff = 0;           // Hz
  double position_cutoff = 0;  // Hz
  double speed = 1;            // rad/s, rms of the healthy machine
  double fastest = 0;          // rad/s, beyond which nothing is judged; 0: no limit
};

struct Moment {
  double time;          // s, since the record began
  double position;      // rad
  double speed;         // rad/s
  double acceleration;  // rad/s^2
  double direction;     // -1..1
  double load;          // N m, that the healthy machine's load takes
  double fluctuation;   // N m s/rad, by which that may fluctuate per speed, faster than the record shows
};

struct SampledMotion {
  MotionSampling sampling;
  double start = 0;  // s, the record's first stamp
  std::vector<Moment> moments;
  std::vector<std::size_t> rows;  // that count, few enough for the cutoff
  Eigen::VectorXd torque;         // N m, filtered, of the rows
  double row_interval = 0;        // s

  double time(Eigen::Index row) const { return moments[rows[static_cast<std::size_t>(row)]].time; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows.size()); }
};

/// Of the slowest record, so that all see the same.
MotionSampling sampling_of(const std::vector<const record::Record*>& records, const ChangeSettings& settings);

/// Throws BadData, CannotIdentify.
SampledMotion sampled_motion(const record::Record& record, const MotionSampling& sampling,
                             const ChangeSettings& settings);

/// f of each moment, filtered, of the rows that count.
Eigen::VectorXd column(const SampledMotion& motion, const std::function<double(const Moment&)>& f);

}  // namespace backlash::identification
