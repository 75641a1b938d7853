// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "backlash_diagnosis/studies/separability_map.h"

namespace backlash::studies {
namespace {

/// Of the built-in rig at another sampling rate than its own: that of the curve counts.
const diagnosis::MonitoringCurve& curve() {
  static const diagnosis::MonitoringCurve built = [] {
    CurveRequest request;
    request.points = 9;
    request.sampling_rate = 5000;
    request.periods = 3;
    request.seeds = 3;
    request.machines = 0;  // what the maps show is the disturbance
    return build_curve(rig_file::default_rig_file(), request);
  }();
  return built;
}

SeparabilityRequest quick() {
  SeparabilityRequest request;
  request.backlash_values = 2;
  request.records = 2;
  request.periods = 3;
  return request;
}

/// One of the rig's disturbances with levels of the test.
Disturbance disturbance(const std::string& name, std::vector<double> levels) {
  for (Disturbance& d : disturbances_of(rig_file::default_rig_file()))
    if (d.name == name) {
      d.levels = std::move(levels);
      return d;
    }
  throw InvalidParameter("disturbance", name, "is not one of the rig's");
}

Separability mapped(const std::vector<Disturbance>& disturbances) {
  return map_separability(rig_file::default_rig_file(), curve(), disturbances, quick());
}

int answered(const SeparabilityAnswer& a) {
  return a.right + a.wrong;
}

TEST(SeparabilityMap, NoDisturbanceIsRightAndNoiseBeyondTheCurveIsRefused) {
  // The curve covers noise to 20 % of the excitation's amplitude, which is about the signal's rms.
  const Separability all = mapped({disturbance("sensor_noise", {0, 0.5})});
  ASSERT_EQ(all.maps.size(), 1u);
  ASSERT_EQ(all.methods.size(), 4u);
  EXPECT_EQ(all.backlash, (std::vector<double>{0, 2e-4}));
  const auto& cells = all.maps[0].cells;
  for (std::size_t m = 0; m < 2; ++m) {
    EXPECT_EQ(cells[0][0].answers[m].right, 2) << m;
    EXPECT_EQ(cells[0][0].answers[m].wrong, 0) << m;
    EXPECT_EQ(cells[0][1].answers[m].wrong, 0) << m;
    for (const SeparabilityCell& cell : cells[1]) {
      EXPECT_EQ(cell.answers[m].refused, 2) << m;
      EXPECT_EQ(cell.answers[m].status, diagnosis::Status::out_of_domain) << m;
      // The same noise is on motor_torque, whose median it moves beyond the 5 % allowed in some records.
      const std::string& reason = cell.answers[m].reason;
      EXPECT_TRUE(reason.find("noise") != std::string::npos ||
                  reason.find("excitation level") != std::string::npos)
          << reason;
      EXPECT_TRUE(std::isnan(cell.answers[m].error)) << m;
    }
  }
}

TEST(SeparabilityMap, EquivalentIsTheChangeOfSkewnessOverTheSlopeOfTheCurve) {
  const Separability all = mapped({disturbance("sensor_noise", {0, 0.2})});
  const auto& cells = all.maps[0].cells;
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(cells[0][b].equivalent, 0);
    EXPECT_DOUBLE_EQ(cells[1][b].equivalent, (cells[1][b].skewness - cells[0][b].skewness) / all.slope);
    // Noise fills the classes between the peaks as backlash does.
    EXPECT_GT(cells[1][b].equivalent, 0);
  }
  // Least squares on evenly spaced points, another way: sum of (i - mean) s over sum of (i - mean)^2.
  double up = 0, down = 0;
  for (int i = 0; i < 9; ++i) {
    up += (i - 4) * curve().nominal(curve().points[i]).mean;
    down += (i - 4) * (i - 4);
  }
  EXPECT_NEAR(all.slope, up / down / 2.5e-5, 1e-9 * std::fabs(all.slope));  // rounding
}

TEST(SeparabilityMap, ALoadIsHiddenFromMotorTorqueButNotFromTheSensor) {
  // A load of 60 % shifts the level at the sensor by as much, far beyond what the checks of the signal allow.
  const Separability all = mapped({disturbance("load_torque", {0, 0.6})});
  for (const SeparabilityCell& cell : all.maps[0].cells[1]) {
    EXPECT_EQ(answered(cell.answers[0]), 0);
    EXPECT_EQ(cell.answers[0].reason.find("excitation"), std::string::npos) << cell.answers[0].reason;
  }
}

TEST(SeparabilityMap, ACellDependsNeitherOnTheOthersNorOnTheNumberOfProcessors) {
  const auto friction = disturbance("motor_viscous_damping", {1, 2});
  const auto stiffness = disturbance("coupling_stiffness", {-0.1, 0});
  const Separability both = mapped({friction, stiffness});
  cpu_set_t allowed, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) CPU_SET(cpu, &one);
  const bool pinned = sched_setaffinity(0, sizeof one, &one) == 0;
  const Separability turned = mapped({stiffness, friction});
  if (pinned) sched_setaffinity(0, sizeof allowed, &allowed);
  for (std::size_t m = 0; m < 2; ++m)
    for (std::size_t level = 0; level < 2; ++level)
      for (std::size_t b = 0; b < 2; ++b) {
        const SeparabilityCell &x = both.maps[m].cells[level][b], &y = turned.maps[1 - m].cells[level][b];
        EXPECT_EQ(x.skewness, y.skewness);
        EXPECT_EQ(x.equivalent, y.equivalent);
        for (std::size_t k = 0; k < 2; ++k) {
          EXPECT_EQ(x.answers[k].right, y.answers[k].right);
          EXPECT_EQ(x.answers[k].refused, y.answers[k].refused);
          EXPECT_EQ(std::isnan(x.answers[k].error), std::isnan(y.answers[k].error));
          if (!std::isnan(x.answers[k].error)) {
            EXPECT_EQ(x.answers[k].error, y.answers[k].error);
          }
        }
      }
}

TEST(SeparabilityMap, RefusesWhatItCannotMap) {
  SeparabilityRequest request = quick();
  request.records = 0;
  EXPECT_THROW(map_separability(rig_file::default_rig_file(), curve(), {}, request), InvalidParameter);
  request = quick();
  request.noise = -0.1;
  EXPECT_THROW(map_separability(rig_file::default_rig_file(), curve(), {}, request), InvalidParameter);
  EXPECT_THROW(mapped({disturbance("sensor_noise", {0.1, 0.2})}), InvalidParameter);  // no level without
  rig_file::RigFile other = rig_file::default_rig_file();
  other.diagnosis.apd->layout.classes = 50;
  EXPECT_THROW(map_separability(other, curve(), {}, quick()), InvalidParameter);
}

}  // namespace
}  // namespace backlash::studies
