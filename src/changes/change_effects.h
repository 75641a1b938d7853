// SPDX-License-Identifier: BSD-3-Clause
// The effects that a record can show, as columns: the motor torque, or the deflection, that one unit of each
// value takes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/changes/changes.h"
#include "sampled_motion.h"

namespace backlash::changes {

/// factor * cos(shape * position), factor * sin(shape * position)
struct Wave {
  double sign = 1;
  bool rubbed = false;  // against the motion

  double factor(const Moment& m) const { return rubbed ? sign * m.direction : sign; }
};

struct ChangeEffect {
  std::string id;    // of the registry of terms, or the name of a declared value
  double shape = 0;  // order [1/rad], speed [rad/s], place or slip [rad], where the effect has one
  /// Columns of one moment. Two: cosine and sine of a wave; of a ramp something and that times time.
  std::vector<std::function<double(const Moment&, double shape)>> columns;
  bool ramp = false;         // the second column grows from the onset on
  double width = 0;          // rad, of what is at a place; 0: it is not
  std::optional<Wave> wave;  // of those whose columns are waves along the position

  bool at_place() const { return width > 0; }
  /// Values that are fitted, order, place and width among them.
  Eigen::Index freedom() const;

  bool of_load() const;  // whether its columns need what the healthy machine is taken to bear
  bool rubs() const;     // whether it is a part of friction
  bool is_slip()
      const;  // of a joint by itself: `shape` is the slip [rad] whose size the columns are right for
  bool has_order() const;
  bool has_scale() const;                             // `shape` is a speed or a way that is fitted by factors
  std::pair<const char*, const char*> scale() const;  // name and unit of that
  double least_order() const;                         // that is tried, of one that has one
  std::string name() const;                           // with its shape
};

/// Whether somebody who leans on a moving machine looks like this effect.
bool may_be_external_torque(const std::string& effect);

/// What is carried has weight and inertia: gravity gets a third column. None for other effects.
std::optional<ChangeEffect> with_inertia(const ChangeEffect& effect);

/// Simple ones first. Orders whose wave the filter would take away leave columns of nothing.
std::vector<ChangeEffect> change_effects(const MotionSampling& sampling);

/// Filtered, for the rows that count. Kept with the motion as long as there is room.
std::shared_ptr<const Eigen::MatrixXd> effect_columns(const SampledMotion& motion,
                                                      const ChangeEffect& effect);

/// The same for many effects, faster together; those that are not kept are left out.
void prepare_columns(const SampledMotion& motion, const std::vector<ChangeEffect>& effects);

/// The values of an effect as its equation has them, from those of its columns and their covariance.
std::vector<ChangeSize> change_size(const ChangeEffect& effect, const Eigen::VectorXd& values,
                                    const Eigen::MatrixXd& covariance, bool linear);

}  // namespace backlash::changes
