// SPDX-License-Identifier: BSD-3-Clause
#include "impossible_friction.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>

#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash::identification {

MotionSize motion_size(const ServoData& record) {
  const auto deviation = [](const std::vector<double>& x) {
    const Eigen::Map<const Eigen::ArrayXd> values(x.data(), Eigen::Index(x.size()));
    return std::sqrt((values - values.mean()).square().mean());
  };
  return {deviation(record.motor_rate), deviation(record.torque)};
}

std::optional<Unexplained> impossible_friction(const std::map<std::string, signal::Measured>& fitted,
                                               const std::map<std::string, std::string>& units,
                                               const MotionSize& motion, const BeliefSettings& belief,
                                               const ExplainableSettings& settings) {
  std::optional<Unexplained> worst;
  double most = belief.least_z;
  for (const auto& [name, friction] : fitted) {
    const rig_file::RigParameter& p = rig_file::servo_parameter(name);
    if (!p.is_friction() || p.is_asymmetry() || !(friction.standard_error > 0)) continue;
    const double size = p.kind == rig_file::ParameterKind::viscous_friction ? motion.speed : 1;
    const double errors = -friction.value / friction.standard_error;
    if (!(errors >= most) || -friction.value * size < settings.worth_saying * motion.torque) continue;
    most = errors;
    worst = {"torque",
             fmt::format("without another effect the machine fits best with {} {:.3g} +- {:.2g} {}, and no "
                         "friction drives",
                         name, friction.value, friction.standard_error, units.at(name)),
             {}};
  }
  return worst;
}

}  // namespace backlash::identification
