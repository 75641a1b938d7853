// SPDX-License-Identifier: BSD-3-Clause
#include "trace_chain.h"

#include <algorithm>
#include <cmath>

#include "joint_effects.h"

namespace backlash::arm {

bool of_joint(const Candidate& c) {
  return !c.freedom.effects.empty();
}

std::vector<Candidate> chain_candidates(const ArmRig& rig) {
  std::vector<Candidate> all;
  for (std::size_t i = rig.chain.size(); i-- > 0;)
    for (const double sign : {1.0, -1.0}) {
      Candidate c;
      c.effect = "payload";
      c.freedom.payload = i;
      c.freedom.payload_sign = sign;
      all.push_back(c);
    }
  Candidate tilt;
  tilt.effect = "gravity_direction";
  tilt.freedom.tilt = true;
  all.push_back(tilt);
  for (std::size_t j = 0; j < rig.joints.size(); ++j) {
    Candidate gain;
    gain.effect = gain_of_drive().id;
    gain.joint = j;
    gain.freedom.effects.push_back({j, gain_of_drive(), 0, false});
    all.push_back(gain);
  }
  return all;
}

const Candidate* rival_of(const std::vector<Candidate>& all, std::size_t chosen,
                          const ArmTraceSettings& settings) {
  if (chosen > 1) return nullptr;
  const Candidate& other = all[1 - chosen];
  const bool alike =
      other.reason.empty() && std::fabs(all[chosen].all - other.all) < -std::log(1 - settings.same_link);
  return alike ? &other : nullptr;
}

std::size_t best_of(const std::vector<Candidate>& all, const ArmTraceSettings& settings) {
  std::size_t best = all.size(), last = all.size();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].reason.empty()) continue;
    if (best == all.size() || all[i].all > all[best].all) best = i;
    if (i < 2 && (last == all.size() || all[i].all > all[last].all)) last = i;
  }
  const bool same = best < all.size() && last < all.size() && all[best].freedom.payload &&
                    all[best].all - all[last].all < -std::log(1 - settings.same_link);
  std::size_t chosen = same ? last : best;
  for (std::size_t i = 0; i < all.size(); ++i)  // one value where a body has ten
    if (chosen < all.size() && !of_joint(all[chosen]) && all[i].reason.empty() && of_joint(all[i]) &&
        all[chosen].all - all[i].all < -std::log(1 - settings.clearly))
      chosen = i;
  return chosen < 2 && rival_of(all, chosen, settings) ? 0 : chosen;
}

std::vector<std::string> as_good_as(const std::vector<Candidate>& all, std::size_t chosen,
                                    const ArmTraceSettings& settings) {
  std::vector<std::string> names;
  for (const Candidate& c : all)
    if (c.reason.empty() && c.effect != all[chosen].effect &&
        all[chosen].all - c.all < -std::log(1 - settings.same_link) &&
        std::find(names.begin(), names.end(), c.effect) == names.end())
      names.push_back(c.effect);
  return names;
}

}  // namespace backlash::arm
