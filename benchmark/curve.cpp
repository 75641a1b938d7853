// SPDX-License-Identifier: BSD-3-Clause
// A monitoring curve of 41 points, 10 periods and 8 noise seeds, against what Boost.odeint alone needs to
// simulate the same machines for the same time at an error of about 1e-6, without noise, statistics or
// calibration.
#include <benchmark/benchmark.h>

#include <atomic>
#include <thread>
#include <vector>

#include "backlash_diagnosis/studies/curve_builder.h"
#include "peer.h"

namespace {

using namespace backlash;

constexpr int kPoints = 41, kPeriods = 10, kSeeds = 8, kSettling = 2;
constexpr double kLargestBacklash = 2e-4;
constexpr int kMachines = kPoints + (kPoints - 1) + (kPoints - 1) / 2;  // points, between them, beyond them

void curve(benchmark::State& state) {
  const rig_file::RigFile file = rig_file::default_rig_file();
  studies::CurveRequest request;
  request.points = kPoints;
  request.periods = kPeriods;
  request.seeds = kSeeds;
  request.max_backlash = kLargestBacklash;
  for (auto _ : state) benchmark::DoNotOptimize(studies::build_curve(file, request));
}

void machines_by_boost(benchmark::State& state) {
  const double period = 1 / rig_file::default_rig_file().simulation.excitation.frequency;
  for (auto _ : state) {
    std::atomic<int> next{0};
    const auto work = [&] {
      for (int i = next++; i < kMachines; i = next++) {
        rig_file::RigFile file = rig_file::default_rig_file();
        file.rig.mesh.backlash = kLargestBacklash * 1.5 * i / (kMachines - 1);
        benchmark::DoNotOptimize(
            peer::sensor_torque(file, 1e-6, 1e-8, (kSettling + kPeriods) * period, 16'000));
      }
    };
    std::thread other(work);
    work();
    other.join();
  }
}

BENCHMARK(curve)
    ->Name("curve/build_curve")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(machines_by_boost)
    ->Name("curve/boost_dopri5")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
