// SPDX-License-Identifier: BSD-3-Clause
// Runs a rig without ROS and writes what its sensors measure.
#include <cmath>
#include <iostream>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/for_arm.h"
#include "tools/common/of_file.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

constexpr double kMostSamples = 1e9;

Command command() {
  Command c;
  c.name = "simulate";
  c.summary = "Simulates the rig that a file describes, from rest, and writes the record of its sensors.";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"duration", "S", "length of the record [s]; default: that of --run"},
      {"out", "RECORD.{csv,bag,mcap}",
       "record to write; a bag has the joint of the rig file on /joint_states"},
      {"run", "NAME", "one of the rig file's test runs instead of its excitation"},
      {"list-runs", "", "print the rig file's test runs, simulate nothing"},
      {"backlash", "M",
       "total free play along the line of action [m] (a rig without base radius: angle at the load "
       "[rad]) instead of the rig file's"},
      {"half-gap", "M", "half of that, instead of --backlash"},
      {"seed", "N", "of all sensor noise, instead of the rig file's; the same seed gives the same record"},
      {"sample-rate", "HZ", "instead of the rig file's"},
      {"motion", "MOTION.yaml", "of an arm: its position loops follow what plan_motion has planned"},
  };
  c.examples = {"simulate config/sarkar_1997.yaml --duration 2 --backlash 60e-6 --out run.csv",
                "simulate config/yumrukcal_2013.yaml --run sine_sweep --out sweep.csv",
                "simulate config/yumrukcal_2013.yaml --list-runs"};
  c.notes =
      "The rig file of an arm (urdf, with simulation) gives one record of all its joints: a .csv with "
      "columns "
      "JOINT/channel, or a bag or MCAP file whose messages have JOINT_motor and JOINT_load of each.";
  c.exit_codes = "  0   done\n";
  return c;
}

void apply(const Arguments& arguments, rig_file::RigFile& file) {
  if (arguments.has("backlash") && arguments.has("half-gap"))
    throw UsageError("--backlash and --half-gap say the same thing, give one of them");
  double& backlash = file.rig.mesh.backlash;
  const double most = file.rig.mesh.most_backlash();
  backlash = arguments.number("backlash", backlash, Range::between(0, most));
  if (arguments.has("half-gap")) backlash = 2 * arguments.number("half-gap", 0, Range::between(0, most / 2));
  simulation::SensorsSettings& sensors = file.simulation.sensors;
  sensors.seeded = sensors.seeded || arguments.has("seed");
  sensors.seed = arguments.integer("seed", sensors.seed, 0, std::numeric_limits<std::uint64_t>::max());
  sensors.sampling_rate = arguments.number("sample-rate", sensors.sampling_rate, Range::positive());
}

const rig_file::TestRun& chosen_run(const Arguments& arguments, const rig_file::RigFile& file) {
  try {
    return rig_file::find_test_run(file.test_runs, arguments.text("run"));
  } catch (const InvalidParameter& e) {
    throw UsageError(std::string("--") + e.what());
  }
}

int list_runs(const Arguments& arguments) {
  for (const char* option : {"out", "run", "duration"})
    if (arguments.has(option)) throw UsageError(std::string("--list-runs simulates nothing: no --") + option);
  for (const rig_file::TestRun& run : rig_file::load_rig_file(arguments.positional(0)).test_runs)
    std::cout << run.name << ": " << to_text(run.duration) << " s, " << run.excitation.type
              << (run.excitation.at_load ? " at the load" : "")
              << (run.excitation.motor_brake ? ", motor braked" : "")
              << (run.without_load ? ", driver alone" : "") << '\n';
  return kHealthy;
}

int simulate(const Arguments& arguments) {
  RecordDoor door("simulate");
  if (rig_file::is_arm_rig(arguments.positional(0))) return run_for_arm(arguments, door);
  if (arguments.has("motion")) throw UsageError("--motion is for the rig file of an arm");
  if (arguments.has("list-runs")) return list_runs(arguments);
  for (const char* option : {"out", "duration"})
    if (!arguments.has(option) && !(arguments.has("run") && std::string(option) == "duration"))
      throw UsageError(std::string("missing --") + option);
  const std::string out = arguments.text("out");
  check_written_path(out);
  double duration = arguments.number("duration", 0, Range::positive());
  rig_file::RigFile file = rig_file::load_rig_file(arguments.positional(0));
  if (arguments.has("run")) {
    const rig_file::TestRun& run = chosen_run(arguments, file);
    if (!arguments.has("duration")) duration = run.duration;
    rig_file::apply_test_run(run, file);
  }
  apply(arguments, file);
  const double samples = std::round(duration * file.simulation.sensors.sampling_rate);
  if (samples < 1 || samples > kMostSamples)
    throw UsageError("a duration of " + to_text(duration) + " s at " +
                     to_text(file.simulation.sensors.sampling_rate) +
                     " Hz (--sample-rate, or sensors.sampling_rate of " + file.source +
                     "): must give from 1 to 1e9 samples");
  check_output(out, {arguments.positional(0)});
  record::Record record;
  {
    ProgressBar bar;
    record = of_file(file.source, [&] {
      return simulation::simulate_record(file.rig, file.simulation, duration, bar.progress());
    });
  }
  write_record(record, out, file.rig.joint);
  std::cout << out << ": " << record.size() << " samples at "
            << to_text(file.simulation.sensors.sampling_rate) << " Hz of " << file.rig.name
            << (arguments.has("run") ? ", run " + arguments.text("run") + "," : "") << " with backlash "
            << to_text(file.rig.mesh.backlash) << (file.rig.mesh.angular() ? " rad" : " m") << '\n';
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, simulate);
}
