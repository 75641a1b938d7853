// SPDX-License-Identifier: BSD-3-Clause
// Coherence on simulated rigs: the larger the gap, the less of the motion follows the torque linearly.
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>

#include "backlash_diagnosis/diagnosis/coherence.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::studies {
namespace {

TEST(RigCoherence, FallsWithTheGap) {
  const auto detected = [](double half_gap, std::uint64_t seed,
                           const std::optional<diagnosis::CoherenceBaseline>& baseline) {
    rig_file::RigFile file = rig_file::default_rig_file();
    file.rig.mesh.backlash = 2 * half_gap;
    simulation::ExcitationSettings& excitation = file.simulation.excitation;
    excitation.type = "random";
    excitation.start_frequency = 5;
    excitation.end_frequency = 100;
    excitation.line_count = 48;
    excitation.seed = seed;
    file.simulation.sensors.sampling_rate = 2000;
    file.simulation.sensors.of(record::Channel::motor_velocity).noise = 0.01;
    diagnosis::CoherenceSettings settings;
    settings.segment = 0.256;
    settings.baseline = baseline;
    return diagnosis::detect_nonlinearity(simulation::simulate_record(file.rig, file.simulation, 6),
                                          settings);
  };
  const diagnosis::CoherenceDetection healthy = detected(0, 1, std::nullopt);
  ASSERT_EQ(healthy.status, diagnosis::Status::ok) << healthy.message;
  const diagnosis::CoherenceBaseline baseline{healthy.loss, healthy.deviation, healthy.lower, healthy.upper};
  const diagnosis::CoherenceDetection again = detected(0, 2, baseline);
  EXPECT_FALSE(again.nonlinear.value_or(false)) << again.message;
  const diagnosis::CoherenceDetection small = detected(30e-6, 2, baseline),
                                      large = detected(80e-6, 3, baseline);
  EXPECT_TRUE(small.nonlinear.value_or(false)) << small.message;
  EXPECT_TRUE(large.nonlinear.value_or(false)) << large.message;
  EXPECT_GT(large.index_lower, small.index_upper);
  rig_file::RigFile square = rig_file::default_rig_file();
  diagnosis::CoherenceSettings settings;
  settings.segment = 0.256;
  EXPECT_EQ(
      diagnosis::detect_nonlinearity(simulation::simulate_record(square.rig, square.simulation, 6), settings)
          .status,
      diagnosis::Status::out_of_domain);
}

}  // namespace
}  // namespace backlash::studies
