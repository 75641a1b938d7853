// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine_folder.h"

namespace backlash::test {
namespace {

/// Joints, whose current is held against Newton's law, written down here anew, where they slide.
class MakeJoint : public MachineFolder {
 protected:
  struct Sliding {
    double time, position, speed, acceleration, current;
  };
  double own(const char* name) const { return truth_["joint"][name].get<double>(); }

  std::vector<Sliding> slides(const std::string& effects) {
    done("make_machine --machine joint --seed 12 --rate 500 --duration 40 --effects " + effects +
         " --out joint");
    truth_ = nlohmann::json::parse(read("joint/truth.json"));
    const Values time = column("joint/train.csv", 0), current = column("joint/train.csv", 1);
    const Values q = column("joint/train.csv", 2);
    // Over 2 n samples of whatever distance a parabola through three points: its slope and curvature.
    const std::size_t n = 20;
    std::vector<Sliding> all;
    for (std::size_t k = n; k + n < q.size(); ++k) {
      const double before = time[k] - time[k - n], after = time[k + n] - time[k];
      const double first = (q[k] - q[k - n]) / before, second = (q[k + n] - q[k]) / after;
      const double speed = (first * after + second * before) / (before + after);
      const double acceleration = 2 * (second - first) / (before + after);
      if (std::abs(speed) >= 0.3) all.push_back({time[k], q[k], speed, acceleration, current[k]});
    }
    return all;
  }
  double friction(const Sliding& s, double more = 0) const {
    return own("viscous") * s.speed + std::copysign(own("coulomb") + more, s.speed);
  }
  /// Noise of the current and, of similar size, what 40 ms of curvature hide of the loop's answer to it.
  double noise() const { return 2 * own("noise") + 0.02; }
};

TEST_F(MakeJoint, KeepsNewtonsLaw) {
  Values current, wrong;
  for (const Sliding& s : slides("gravity,load_dependent_friction")) {
    const double load =
        own("inertia") * s.acceleration + of("gravity", "A") * std::sin(s.position + of("gravity", "p"));
    current.push_back(s.current);
    wrong.push_back(s.current - load - friction(s, of("load_dependent_friction", "A") * std::abs(load)));
  }
  ASSERT_GT(current.size(), 3000u);
  EXPECT_LT(rms(wrong), noise());
  EXPECT_GT(rms(current), 1);
  EXPECT_TRUE(truth_["outside_dictionary"].empty());
}

TEST_F(MakeJoint, ALoadIsTakenUpOnTheWay) {
  Values before, after, without;
  for (const Sliding& s : slides("payload_step")) {
    const double left = s.current - own("inertia") * s.acceleration - friction(s);
    const double load = of("payload_step", "A") * std::sin(s.position);
    if (s.time < of("payload_step", "t"))
      before.push_back(left);
    else
      after.push_back(left - load), without.push_back(left);
  }
  ASSERT_GT(std::min(before.size(), after.size()), 1000u);
  EXPECT_LT(rms(before), noise());
  EXPECT_LT(rms(after), noise());
  EXPECT_GT(rms(without), 4 * noise());
  EXPECT_EQ(truth_["outside_dictionary"], nlohmann::json({"payload_step"}));
}

// A sine over time has its amplitude over the root of 2; that over the samples which slide is within a fifth.
TEST_F(MakeJoint, ATorqueFromOutsideSwingsInTime) {
  Values left;
  for (const Sliding& s : slides("outside_torque"))
    left.push_back(s.current - own("inertia") * s.acceleration - friction(s));
  const double amplitude = of("outside_torque", "A");
  EXPECT_NEAR(rms(left), amplitude / std::sqrt(2), 0.2 * amplitude);
  EXPECT_NEAR(*std::max_element(left.begin(), left.end()), amplitude, 0.1 * amplitude + 3 * noise());
}

}  // namespace
}  // namespace backlash::test
