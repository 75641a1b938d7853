// SPDX-License-Identifier: BSD-3-Clause
// The effects that a record can show, as columns: the motor torque, or the deflection, that one unit of each
// value takes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/changes/changes.h"
#include "backlash_diagnosis/model/term_columns.h"
#include "sampled_motion.h"

namespace backlash::changes {

struct ChangeEffect {
  std::string id;    // of the dictionary of terms, or the name of a declared value
  double shape = 0;  // order [1/rad], speed [rad/s], place or slip [rad], where the effect has one
  /// Columns of one moment, with such a shape. Two: cosine and sine of a wave; of a ramp something and that
  /// times time. Null: they are given (chain_motion.h).
  std::function<std::vector<OfMoment>(double shape)> law = nullptr;
  std::size_t count = 0;                  // columns
  bool ramp = false;                      // the second column grows from the onset on
  double width = 0;                       // rad, of what is at a place; 0: it is not
  const model::TermType* type = nullptr;  // of the dictionary; null: no term's effect
  bool of_load = false;                   // its columns need what the healthy machine is taken to bear
  bool of_size = false;                   // `shape` is the size that its columns are right for
  bool rubs = false;                      // a part of friction, the same in both directions
  std::string variant = "";               // which law of several of one term
  double rotor_share = 0;                 // of one inertia, that loads no teeth

  std::vector<OfMoment> columns() const { return law(shape); }
  bool at_place() const { return width > 0; }
  /// Values that are fitted, order, place and width among them.
  Eigen::Index freedom() const;
  bool has_order() const { return type && model::has_order(*type); }
  bool has_scale() const;      // `shape` is a speed or a way that is fitted by factors
  double least_order() const;  // that is tried, of one that has one
  std::string name() const;    // with its shape
};

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
