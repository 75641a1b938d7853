// SPDX-License-Identifier: BSD-3-Clause
// Cost of simulating a rig at a measured error: SUNDIALS through Plant, the ensemble (also of one rig alone),
// and Boost.odeint as their peer. Every run is the same work: sensor torque at 1 kHz of
// config/sarkar_1997.yaml, half gap 50 um, 0.5 s; for the ensemble 32 half gaps from 0 to 100 um, 0.1 s (some
// gaps are chaotic, longer runs would compare luck). The error is that of the torque, rms over rms, against
// Verner's pair at 1e-13; of 32 rigs the median.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/simulation/ensemble.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "peer.h"

namespace {

using backlash::model::Rig;
using backlash::rig_file::RigFile;
using backlash::simulation::Ensemble;
using backlash::simulation::Plant;
using backlash::simulation::SolverSettings;
using Signal = std::vector<double>;
using Signals = std::vector<Signal>;

constexpr double kRate = 1000, kDuration = 0.5, kShort = 0.1, kHalfGap = 50e-6, kLargestHalfGap = 100e-6;
constexpr int kRigs = 32;

RigFile file_with(double half_gap) {
  RigFile file = backlash::rig_file::default_rig_file();
  file.rig.mesh.backlash = 2 * half_gap;
  return file;
}

double half_gap_of(int rig) {
  return kLargestHalfGap * rig / (kRigs - 1);
}

/// Absolute tolerances that get most out of SUNDIALS here: a hundredth of a radian and a radian per second
/// count as 1.
SolverSettings solver(const std::string& method, double tolerance) {
  SolverSettings s;
  s.method = method;
  s.relative_tolerance = tolerance;
  s.position_tolerance = 1e-2 * tolerance;
  s.velocity_tolerance = tolerance;
  return s;
}

Signal plant_torque(const RigFile& file, const SolverSettings& settings, double duration) {
  Plant plant(file.rig, file.simulation.excitation, settings);
  Signal values;
  for (long k = 0; k < std::lround(duration * kRate); ++k) {
    plant.advance_to(double(k) / kRate);
    const auto& state = plant.state();
    values.push_back(file.rig.input_coupling.stiffness * (state[0] - state[1]));
  }
  return values;
}

double error(const Signal& found, const Signal& right) {
  double square = 0, size = 0;
  for (std::size_t k = 0; k < right.size(); ++k) {
    square += std::pow(found[k] - right[k], 2);
    size += right[k] * right[k];
  }
  return std::sqrt(square / size);
}

double median_error(const Signals& found, const Signals& right) {
  std::vector<double> all;
  for (std::size_t i = 0; i < right.size(); ++i) all.push_back(error(found[i], right[i]));
  std::nth_element(all.begin(), all.begin() + all.size() / 2, all.end());
  return all[all.size() / 2];
}

SolverSettings converged() {
  SolverSettings s = solver("verner", 1e-13);
  s.position_tolerance = 1e-17, s.velocity_tolerance = 1e-14;
  return s;
}

const Signal& right_torque() {
  static const Signal right = plant_torque(file_with(kHalfGap), converged(), kDuration);
  return right;
}

const Signals& right_torques() {
  static const Signals right = [] {
    Signals all;
    for (int i = 0; i < kRigs; ++i)
      all.push_back(plant_torque(file_with(half_gap_of(i)), converged(), kShort));
    return all;
  }();
  return right;
}

void one_plant(benchmark::State& state, const std::string& method, double tolerance) {
  const RigFile file = file_with(kHalfGap);
  Signal found;
  for (auto _ : state) found = plant_torque(file, solver(method, tolerance), kDuration);
  state.counters["error"] = error(found, right_torque());
}

void one_lane(benchmark::State& state, double tolerance) {
  const RigFile file = file_with(kHalfGap);
  Signal found;
  for (auto _ : state) {
    found.clear();
    Ensemble alone({file.rig}, file.simulation.excitation, solver("", tolerance));
    for (long k = 0; k < std::lround(kDuration * kRate); ++k) {
      alone.advance_to(double(k) / kRate);
      const auto now = alone.state(0);
      found.push_back(file.rig.input_coupling.stiffness * (now[0] - now[1]));
    }
  }
  state.counters["error"] = error(found, right_torque());
}

void one_boost(benchmark::State& state, double tolerance) {
  const RigFile file = file_with(kHalfGap);
  Signal found;
  for (auto _ : state) found = peer::sensor_torque(file, tolerance, 1e-2 * tolerance, kDuration, kRate);
  state.counters["error"] = error(found, right_torque());
}

void ensemble(benchmark::State& state, double tolerance) {
  const RigFile file = file_with(0);
  std::vector<Rig> rigs(kRigs, file.rig);
  for (int i = 0; i < kRigs; ++i) rigs[i].mesh.backlash = 2 * half_gap_of(i);
  Signals found;
  for (auto _ : state) {
    found.assign(kRigs, {});
    Ensemble all(rigs, file.simulation.excitation, solver("", tolerance));
    for (long k = 0; k < std::lround(kShort * kRate); ++k) {
      all.advance_to(double(k) / kRate);
      for (int i = 0; i < kRigs; ++i) {
        const auto now = all.state(i);
        found[i].push_back(file.rig.input_coupling.stiffness * (now[0] - now[1]));
      }
    }
  }
  state.counters["error"] = median_error(found, right_torques());
}

void many_boost(benchmark::State& state, double tolerance) {
  std::vector<RigFile> files;
  for (int i = 0; i < kRigs; ++i) files.push_back(file_with(half_gap_of(i)));
  Signals found;
  for (auto _ : state) {
    found.clear();
    for (const RigFile& file : files)
      found.push_back(peer::sensor_torque(file, tolerance, 1e-2 * tolerance, kShort, kRate));
  }
  state.counters["error"] = median_error(found, right_torques());
}

template <typename... Arguments>
void add(const std::string& name, double tolerance, Arguments... arguments) {
  char text[16];
  std::snprintf(text, sizeof text, "%.0e", tolerance);
  benchmark::RegisterBenchmark((name + "/" + text).c_str(), arguments..., tolerance)
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

int main(int argc, char** argv) {
  for (int decade = 3; decade <= 11; ++decade) {
    const double tolerance = std::pow(10, -decade);
    add("one_rig/boost_dopri5", tolerance, one_boost);
    for (const char* method : {"dormand_prince", "cash_karp", "tsitouras"})
      add(std::string("one_rig/") + method, tolerance, one_plant, method);
    add("one_rig/ensemble", tolerance, one_lane);
    add("32_rigs/boost_dopri5", tolerance, many_boost);
    add("32_rigs/ensemble", tolerance, ensemble);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 64;
  benchmark::RunSpecifiedBenchmarks();
}
