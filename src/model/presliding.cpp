// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/presliding.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

FrictionLimits between(const FrictionLimits& a, const FrictionLimits& b, double part) {
  return {a.forward + part * (b.forward - a.forward), a.backward + part * (b.backward - a.backward),
          a.presliding, a.presliding_damping};
}

double friction_of(const Presliding& memory, int direction, const FrictionLimits& limits, double position,
                   double rate = 0) {
  if (limits.presliding > 0) return memory.friction(direction, limits, position, rate);
  return direction > 0 ? limits.forward : direction < 0 ? -limits.backward : 0;
}

}  // namespace

// A solver that looks beyond the next reversal may come back behind the last one; there it goes on straight.
double Presliding::friction(int direction, const FrictionLimits& limits, double position) const {
  const double path = direction * (position - position_) / limits.presliding;
  const double built_up = path < 0 ? path : -std::expm1(-path);
  const double end = direction > 0 ? limits.forward : -limits.backward;
  return friction_ + (end - friction_) * built_up;
}

double Presliding::friction(int direction, const FrictionLimits& limits, double position, double rate) const {
  const double built_up = friction(direction, limits, position);
  const double end = direction > 0 ? limits.forward : -limits.backward;
  if (direction * rate <= 0 || end == 0) return built_up;
  return built_up + limits.presliding_damping * rate * (1 - built_up / end);
}

std::vector<double> presliding_friction(const std::vector<double>& positions,
                                        const std::vector<FrictionLimits>& limits,
                                        const std::vector<double>& rates, double interval) {
  if (limits.size() != positions.size() || rates.size() != positions.size())
    throw InvalidParameter("samples", double(positions.size()), "limits and rates need as many");
  std::vector<double> friction(positions.size());
  Presliding memory(positions.empty() ? 0 : positions.front());
  int direction = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const int moves = (rates[k] > 0) - (rates[k] < 0);
    if (direction * moves < 0) {                                     // it has moved before, so k > 0
      const double part = rates[k - 1] / (rates[k - 1] - rates[k]);  // of the interval, until it turns
      const double turn = positions[k - 1] + 0.5 * part * interval * rates[k - 1];
      memory =
          Presliding(turn, friction_of(memory, direction, between(limits[k - 1], limits[k], part), turn));
    }
    if (moves != 0) direction = moves;
    friction[k] = friction_of(memory, direction, limits[k], positions[k], rates[k]);
  }
  return friction;
}

}  // namespace backlash::model
