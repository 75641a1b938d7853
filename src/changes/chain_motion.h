// SPDX-License-Identifier: BSD-3-Clause
// A record of an arm as its healthy chain explains it: what is left at each joint is that joint's own, and
// what an effect of the chain would add at all of them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/fit.h"
#include "change_effects.h"
#include "sampled_motion.h"

namespace backlash::changes {

/// A change that several joints show at once.
struct ChainEffect {
  std::string id;         // payload, encoder_slip
  std::size_t joint = 0;  // that slips, or turns the link which carries
  int values = 1;

  /// Of the effect at one joint, in SampledMotion::known_columns.
  ChangeEffect at_joint() const { return {id, double(joint + 1)}; }
};

/// A payload at each link, the last first; each encoder.
std::vector<ChainEffect> chain_effects(std::size_t joints);

struct ChainMotion {
  /// motor_position, load_position where it is measured; motor_torque [N m] less chain and the friction that
  /// is not linear; output_torque: the chain.
  std::vector<record::Record> joints;
  std::vector<double> time;                 // s, of the rows of the following, few
  std::vector<Eigen::MatrixXd> body, slip;  // per joint: 10 columns per link, one per encoder [N m per unit]
};

/// By what the chain differs for a while.
struct ChainDifference {
  std::size_t joint = 0;
  double from = 0, to = 0;                                 // s of the record
  arm::BodyParameters body = arm::BodyParameters::Zero();  // that its link carries
  double slip = 0;                                         // rad, that its encoder shows more
};

/// Throws BadData.
ChainMotion chain_motion(const arm::ArmFit& healthy, const arm::ArmRecord& record,
                         const std::vector<ChainDifference>& differences, double most_rate,
                         std::vector<std::string>& warnings);

/// Puts the columns of all chain effects at a joint where effect_columns() finds them.
void set_chain_columns(const ChainMotion& chain, std::size_t joint, SampledMotion& motion);

}  // namespace backlash::changes
