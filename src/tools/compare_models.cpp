// SPDX-License-Identifier: BSD-3-Clause
// How well several models of a machine say what a record of it shows: table, JSON and picture.
#include <fmt/core.h>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/identification/model_comparison.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "report/json.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/of_file.h"
#include "tools/common/plot.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_door.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;
using Channels = std::map<std::string, identification::ChannelComparison>;

Command command() {
  const identification::ComparisonSettings defaults;
  const auto fallback = [](double value) { return "; default: " + to_text(value); };
  Command c;
  c.name = "compare_models";
  c.summary =
      "Compares what several models of a machine say of one record: torque, position difference and speed "
      "difference of motor and load, as in Chapter 6 of Yumrukcal (2013).";
  c.positional = {"RECORD", "RIG..."};
  c.options = {
      {"json", "OUT.json", "errors per model and channel, engagements, traces", true},
      {"plot", "OUT.png", "also draw them"},
      {"cutoff", "HZ", "low-pass of torque and position difference" + fallback(defaults.cutoff)},
      {"after", "S", "of an engagement that count" + fallback(defaults.after)},
  };
  c.notes =
      "Followed: the load of the model is driven by the recorded motor position through the whole record. "
      "Free: the whole model is driven by the recorded torque, from just before the teeth leave a flank to "
      "the "
      "end of the ringing on the other one, each time anew. Errors are norm(r) / norm(y - mean), r what the "
      "model leaves of the measured y; the floor is what noise alone would leave. The record needs "
      "motor_torque, motor_position and load_position; motor_velocity and load_velocity where it has them.";
  c.examples = {"simulate config/yumrukcal_2013_varying.yaml --run square_wave_backward --out test.csv",
                "compare_models test.csv config/yumrukcal_2013_basic.yaml config/yumrukcal_2013.yaml "
                "config/yumrukcal_2013_varying.yaml --json models.json --plot models.png"};
  c.exit_codes = "  0   done\n  3   the record does not allow a comparison\n";
  return c;
}

/// Shortest decimals that keep six digits: enough for a plot.
Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values)
    list.push_back(report::json_number(std::stod(fmt::format("{:.6g}", value))));
  return list;
}

Json to_json(const Channels& channels) {
  Json json;
  for (const auto& [name, c] : channels)
    json[name] = {{"error", report::json_number(c.error)},
                  {"floor", report::json_number(c.floor)},
                  {"rms", report::json_number(c.rms)},
                  {"peak", report::json_number(c.peak)},
                  {"unit", c.unit}};
  return json;
}

Json to_json(const identification::ModelComparison& m, const rig_file::RigFile& file) {
  Json peaks = Json::array();
  for (const identification::EngagementPeak& p : m.peaks)
    peaks.push_back({{"measured", report::json_number(p.measured)},
                     {"predicted", report::json_number(p.predicted)},
                     {"measured_frequency", report::json_number(p.measured_frequency)},
                     {"predicted_frequency", report::json_number(p.predicted_frequency)},
                     {"measured_damping_ratio", report::json_number(p.measured_damping_ratio)},
                     {"predicted_damping_ratio", report::json_number(p.predicted_damping_ratio)}});
  return {{"rig", file.source},
          {"name", file.rig.name},
          {"rig_digest", file.digest},
          {"encoder_offset", report::json_number(m.calibration.encoder_offset)},
          {"followed", to_json(m.followed)},
          {"free", to_json(m.free)},
          {"peak_ratio", report::json_number(m.peak_ratio)},
          {"frequency_ratio", report::json_number(m.frequency_ratio)},
          {"damping_ratio", report::json_number(m.damping_ratio)},
          {"peaks", peaks},
          {"traces",
           {{"deflection", numbers(m.traces.deflection)},
            {"free_deflection", numbers(m.traces.free_deflection)},
            {"free_speed_difference", numbers(m.traces.free_speed_difference)}}}};
}

Json to_json(const identification::ComparedRecord& record, const std::string& path) {
  Json engagements = Json::array();
  for (const identification::Engagement& e : record.engagements)
    engagements.push_back({{"time", e.time}, {"load_position", e.load_position}, {"direction", e.direction}});
  return {{"record", path},
          {"interval", record.data.interval},
          {"first_time", record.time.front()},
          {"engagements", engagements},
          {"measured",
           {{"deflection", numbers(record.deflection)},
            {"raw_deflection", numbers(record.raw_deflection)},
            {"speed_difference", numbers(record.speed_difference)}}}};
}

void print_comparison(const std::vector<rig_file::RigFile>& files,
                      const std::vector<identification::ModelComparison>& models, std::size_t engagements) {
  std::cout << std::fixed;
  const auto rows = [&](const char* title, Channels identification::ModelComparison::*channels) {
    std::cout << title << '\n';
    for (std::size_t i = 0; i < models.size(); ++i)
      for (const auto& [name, c] : models[i].*channels)
        std::cout << "  " << std::left << std::setw(28) << files[i].rig.name << std::setw(18) << name
                  << std::right << std::setprecision(3) << std::setw(9) << 100 * c.error << " % (noise "
                  << std::setw(6) << 100 * c.floor << " %), rms " << std::scientific << std::setprecision(2)
                  << c.rms << ", at most " << c.peak << ' ' << c.unit << std::fixed << '\n';
  };
  rows("Followed: load driven by the recorded motor position", &identification::ModelComparison::followed);
  if (engagements == 0) {
    std::cout << "The teeth do not change flanks in this record: no free runs\n";
    return;
  }
  rows(("Free: driven by the torque through " + std::to_string(engagements) + " engagements").c_str(),
       &identification::ModelComparison::free);
  std::cout << "After an engagement, model over measured: first peak of the speed difference, frequency and "
               "damping ratio of the ringing\n"
            << std::setprecision(3);
  for (std::size_t i = 0; i < models.size(); ++i)
    std::cout << "  " << std::left << std::setw(46) << files[i].rig.name << std::right << std::setw(9)
              << models[i].peak_ratio << std::setw(9) << models[i].frequency_ratio << std::setw(9)
              << models[i].damping_ratio << '\n';
}

void check_outputs(const Arguments& arguments) {
  const std::string json = arguments.text("json"), plot = arguments.text("plot");
  check_output(json, arguments.positionals());
  if (plot.empty()) return;
  check_plot_path(plot);
  if (plot == json) throw UsageError("--plot and --json name the same file");
  check_output(plot, arguments.positionals());
}

std::string joined_sources(const std::vector<rig_file::RigFile>& files) {
  std::vector<std::string> names;
  for (const rig_file::RigFile& file : files) names.push_back(file.source);
  return joined(names);
}

int compare(const Arguments& arguments) {
  const std::string& path = arguments.positional(0);
  const std::string out = arguments.text("json");
  identification::ComparisonSettings settings;
  settings.cutoff = arguments.number("cutoff", settings.cutoff, Range::positive());
  settings.after = arguments.number("after", settings.after, Range::positive());
  check_record_path(path);
  check_outputs(arguments);
  std::vector<rig_file::RigFile> files;
  std::vector<model::Rig> rigs;
  for (std::size_t i = 1; i < arguments.positionals().size(); ++i) {
    files.push_back(rig_file::load_rig_file(arguments.positional(i)));
    rigs.push_back(files.back().rig);
  }
  RecordDoor door("compare_models");
  record::Record given =
      door.admit(read_record(path, place_of(files.front())), rig_file::declared_motion(rigs.front()), path);
  given.name = path;
  identification::ComparedRecord record;
  std::vector<identification::ModelComparison> models;
  try {
    ProgressBar bar;
    record = of_file(path + " with " + files.front().source,
                     [&] { return identification::compared_record(given, rigs.front(), settings); });
    models = of_file(path + " with " + joined_sources(files),
                     [&] { return identification::compare_models(rigs, record, settings, bar.progress()); });
  } catch (const CannotIdentify& error) {
    std::cerr << "compare_models: " << error.what() << '\n';
    return kInconclusive;
  }
  Json json = {{"schema_version", 1}, {"version", version()}};
  json.update(to_json(record, path));
  for (std::size_t i = 0; i < models.size(); ++i) json["models"].push_back(to_json(models[i], files[i]));
  write_text(out, door.with_findings(json.dump(-1, ' ', false, Json::error_handler_t::replace)));
  print_comparison(files, models, record.engagements.size());
  std::cout.flush();
  if (arguments.has("plot")) plot_model_comparison(out, arguments.text("plot"));
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, compare);
}
