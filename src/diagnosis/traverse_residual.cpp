// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "traverse_motion.h"

namespace backlash::diagnosis {

Eigen::VectorXd traverse_residual(const TraverseData& data, const TraverseRun& run,
                                  const Eigen::Ref<const Eigen::VectorXd>& teeth) {
  const TraverseMachine& m = run.machine;
  Eigen::VectorXd left = Eigen::VectorXd::Zero(teeth.size());
  for (Eigen::Index k = 1; k + 1 < left.size(); ++k) {
    const std::size_t i = run.window->first + static_cast<std::size_t>(k);
    if (!data.counts[i]) continue;
    const double at = std::clamp(double(i) - m[kTraverseLate], 0.0, double(data.torque.size() - 2));
    const auto before = static_cast<std::size_t>(at);
    const double drive =
        data.torque[before] + (at - double(before)) * (data.torque[before + 1] - data.torque[before]);
    double waves = 0;
    for (int n = 0; n < kTorqueWaves; ++n)
      if (!data.waves[n].empty()) waves += m[std::size_t(kTraverseWave + n)] * data.waves[n][i];
    left[k] =
        drive - waves -
        (teeth[k] + run.own[kOwnMotorTorque] + m[kTraverseMotorInertia] * data.acceleration[i] +
         m[kTraverseMotorDamping] * data.rate[i] + std::copysign(m[kTraverseMotorFriction], data.rate[i]));
  }
  return left;
}

Eigen::VectorXd load_residual(const TraverseData& data, const TraverseRun& run,
                              const Eigen::Ref<const Eigen::VectorXd>& position,
                              const Eigen::Ref<const Eigen::VectorXd>& rate) {
  Eigen::VectorXd left(position.size());
  for (Eigen::Index k = 0; k < left.size(); ++k) {
    const std::size_t i = run.window->first + static_cast<std::size_t>(k);
    left[k] =
        data.load[i] - (position[k] - run.machine[kTraverseSkew] * rate[k] + shown_too_much(data, run, i));
  }
  return left;
}

}  // namespace backlash::diagnosis
