// SPDX-License-Identifier: BSD-3-Clause
// A record on an even grid, as columns for a regression: all pass the same filter without delay.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/changes/change_settings.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::changes {

/// What is predicted: the motor's torque, or by how much its position is ahead of the load's.
enum class ChangeChannel { torque, deflection };

/// What loads the teeth between two inertias, all by the link: J a + c w + F sign(w) + g_c cos q + g_s sin q;
/// of an arm what the chain takes, and nothing of these.
struct MeshLoad {
  double inertia = 0, viscous = 0, coulomb = 0, cosine = 0, sine = 0;
  double least = 0;  // N m: less presses no flank for certain
};

/// Common to all records of a machine.
struct MotionSampling {
  ChangeChannel channel = ChangeChannel::torque;
  double behind = 0;             // - of the inertia that moves with the load's encoder; 0: there is none
  std::optional<MeshLoad> mesh;  // none: one inertia, or not known yet
  bool chain = false;            // records state as output_torque what the rest of an arm takes
  double interval = 0;           // s, of what is looked at
  std::size_t thinned = 1;       // samples of the record in one of these
  double cutoff = 0;             // Hz
  double position_cutoff = 0;    // Hz
  double speed = 1;              // rad/s, rms of the healthy machine
  double fastest = 0;            // rad/s, beyond which nothing is judged; 0: no limit
  double hardest = 0;            // rad/s^2, the same of accelerations
};

struct Moment {
  double time;          // s, since the record began
  double position;      // rad
  double speed;         // rad/s
  double acceleration;  // rad/s^2, the mean of both inertias by their weight
  double jerk;          // rad/s^3
  double direction;     // -1..1
  double way;           // rad, since the last reversal
  double load;          // N m, that the healthy machine's load takes
  double weight;        // N m, the part of that by gravity
  double load_slope;    // N m/rad, of its gravity
  double fluctuation;   // N m s/rad, by which that may fluctuate per speed, faster than the record shows
  double mesh;          // N m, that the teeth bear; 0: one inertia
  double chain;         // N m, that the rest of an arm takes; 0: there is none
  double torque;        // N m, that the healthy machine takes in all; 0: not known yet
  std::array<double, 3> torque_rates;  // N m/s, N m/s^2, N m/s^3, derivatives of that

  double side() const { return mesh < 0 ? -1 : 1; }  // flank that bears it
};

using OfMoment = std::function<double(const Moment&)>;

struct SampledMotion {
  MotionSampling sampling;
  double start = 0;  // s, the record's first stamp
  std::vector<Moment> moments;
  std::vector<std::size_t> rows;  // that count, few enough for the cutoff
  Eigen::VectorXd target;         // N m or rad, of the channel, filtered, of the rows
  double row_interval = 0;        // s
  double unsure_time = 0;         // s, standard deviation of when each sample was taken
  mutable std::map<std::string, std::shared_ptr<const Eigen::MatrixXd>>
      known_columns;  // of effect_columns(), so far as there is room

  const Moment& moment(Eigen::Index row) const { return moments[rows[static_cast<std::size_t>(row)]]; }
  double time(Eigen::Index row) const { return moment(row).time; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows.size()); }
};

/// Of the slowest record, so that all see the same.
MotionSampling sampling_of(const std::vector<const record::Record*>& records, const ChangeSettings& settings);

/// Throws BadData, CannotIdentify.
SampledMotion sampled_motion(const record::Record& record, const MotionSampling& sampling,
                             const ChangeSettings& settings);

/// Values of the moments, one column each, filtered, of the rows that count.
Eigen::MatrixXd filtered(const SampledMotion& motion, Eigen::MatrixXd columns);

/// The same of each f of each moment.
Eigen::MatrixXd columns(const SampledMotion& motion,
                        const std::vector<std::function<double(const Moment&)>>& f);
Eigen::VectorXd column(const SampledMotion& motion, const std::function<double(const Moment&)>& f);

}  // namespace backlash::changes
