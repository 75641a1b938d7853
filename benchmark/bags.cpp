// SPDX-License-Identifier: BSD-3-Clause
// Reading and diagnosing a recorded run of a minute at 5 kHz, against a bare loop over the bag that
// instantiates its messages, by processor time of all threads. The bag is made here, by the simulator, and
// removed. Freed memory is kept as in the commands, which the bare loop has of it as well.
#include <benchmark/benchmark.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "backlash_diagnosis/base/memory.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace {

using namespace backlash;

constexpr double kRate = 5000, kDuration = 60;

class BagFile {
 public:
  BagFile() {
    path_ = (std::filesystem::temp_directory_path() / "benchmark_XXXXXX.bag").string();
    close(mkstemps(path_.data(), 4));
    rig_file::RigFile file = rig_file::default_rig_file();
    file.rig.mesh.backlash = 8e-5;
    file.simulation.sensors.sampling_rate = kRate;
    ros_bridge::write_bag(simulation::simulate_record(file.rig, file.simulation, kDuration), path_, "joint");
  }
  ~BagFile() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

const std::string& bag() {
  static const BagFile file;
  return file.path();
}

void rate(benchmark::State& state) {
  state.counters["messages_per_s"] =
      benchmark::Counter(double(state.iterations()) * kRate * kDuration, benchmark::Counter::kIsRate);
}

void bare_view(benchmark::State& state) {
  const std::string path = bag();
  double sum = 0;
  for (auto _ : state) {
    rosbag::Bag opened(path);
    rosbag::View view(opened, rosbag::TopicQuery("/joint_states"));
    for (const rosbag::MessageInstance& instance : view)
      if (const auto message = instance.instantiate<sensor_msgs::JointState>())
        sum += message->effort.front();
  }
  benchmark::DoNotOptimize(sum);
  rate(state);
}

void read(benchmark::State& state) {
  const std::string path = bag();
  for (auto _ : state) benchmark::DoNotOptimize(ros_bridge::read_bag(path, "", "joint_states").size());
  rate(state);
}

/// `waveform`, which fits the machine to a dozen stretches of the record however long it is, takes its time
/// apart.
void read_and_diagnose(benchmark::State& state, bool waveform) {
  const std::string path = bag();
  rig_file::RigFile file = rig_file::default_rig_file();
  if (!waveform) file.diagnosis.waveform.reset();
  for (auto _ : state) {
    const record::Record record = ros_bridge::read_bag(path, "", "joint_states");
    benchmark::DoNotOptimize(
        diagnosis::diagnose(record, file.diagnosis, nullptr, std::nullopt).estimates.size());
  }
  rate(state);
}

void measured(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

BENCHMARK(bare_view)->Name("bags/bare_view")->Apply(measured);
BENCHMARK(read)->Name("bags/read")->Apply(measured);
BENCHMARK_CAPTURE(read_and_diagnose, , false)->Name("bags/read_and_diagnose")->Apply(measured);
BENCHMARK_CAPTURE(read_and_diagnose, , true)->Name("bags/read_and_diagnose_waveform")->Apply(measured);

}  // namespace

int main(int argc, char** argv) {
  keep_freed_memory();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
