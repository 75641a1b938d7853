// SPDX-License-Identifier: BSD-3-Clause
// Where skewness can separate backlash from noise, friction and load: table, JSON and picture.
#include "backlash_diagnosis/studies/separability_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "report/json.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/plot.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMost = 100'000;

Command command() {
  const studies::SeparabilityRequest defaults;
  const auto fallback = [](double value) { return "; default: " + to_text(value); };
  Command c;
  c.name = "separability_map";
  c.summary =
      "Maps where backlash can be distinguished from sensor noise, viscous and dry friction and inertia of "
      "the motor, "
      "a "
      "constant load torque, stiffness of couplings and contact, gain and delay of the torque sensor and a "
      "late load encoder: by the bare skewness, by apd_skewness, apd_shape, waveform and the verdict.";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"json", "OUT.json", "all cells of the maps", true},
      {"curve", "CURVE.yaml", "monitoring curve of the rig (see build_curve); without it one is built"},
      {"plot", "OUT.png", "also draw the maps"},
      {"points", "N", "backlash values, evenly over the curve" + fallback(defaults.backlash_values)},
      {"records", "N", "per cell" + fallback(defaults.records)},
      {"periods", "N", "of the excitation per record, after settling" + fallback(defaults.periods)},
      {"noise", "X",
       "on the signal and on motor_torque where noise is not what the map is about, of the signal's rms" +
           fallback(defaults.noise)},
      {"waveform", "", "also run the estimator waveform: seconds a record"},
      {"seed", "N", "of noise and starts of the records" + fallback(defaults.seed)},
  };
  c.notes =
      "A cell is right where the 95 % interval holds the true backlash, wrong where it does not (or where "
      "more "
      "backlash than the curve covers is claimed that is not there), refused where the method says that it "
      "cannot tell. "
      "The equivalent is the change of skewness that the disturbance alone causes, over the slope of the "
      "curve: "
      "the error of one who reads backlash off the bare curve.";
  c.examples = {"separability_map config/sarkar_1997.yaml --json map.json --plot map.png"};
  c.exit_codes = "  0   done\n";
  return c;
}

/// A table [level][backlash] of what `get` takes from a cell.
template <typename Get>
Json table(const studies::SeparabilityMap& map, const Get& get) {
  Json rows = Json::array();
  for (const auto& row : map.cells) {
    Json values = Json::array();
    for (const studies::SeparabilityCell& cell : row) values.push_back(get(cell));
    rows.push_back(values);
  }
  return rows;
}

Json map_json(const studies::SeparabilityMap& map, const std::vector<std::string>& methods) {
  using Cell = studies::SeparabilityCell;
  Json json = {{"disturbance", map.disturbance.name},
               {"axis", map.disturbance.axis},
               {"none", map.disturbance.none},
               {"levels", map.disturbance.levels},
               {"skewness", table(map, [](const Cell& c) { return report::json_number(c.skewness); })},
               {"equivalent", table(map, [](const Cell& c) { return report::json_number(c.equivalent); })}};
  for (std::size_t m = 0; m < methods.size(); ++m)
    json["methods"][methods[m]] = {
        {"right", table(map, [m](const Cell& c) { return c.answers[m].right; })},
        {"wrong", table(map, [m](const Cell& c) { return c.answers[m].wrong; })},
        {"refused", table(map, [m](const Cell& c) { return c.answers[m].refused; })},
        {"error", table(map, [m](const Cell& c) { return report::json_number(c.answers[m].error); })},
        {"status", table(map, [m](const Cell& c) { return diagnosis::to_string(c.answers[m].status); })},
        {"reason", table(map, [m](const Cell& c) { return c.answers[m].reason; })}};
  return json;
}

Json to_json(const studies::Separability& all, const rig_file::RigFile& file,
             const diagnosis::MonitoringCurve& curve, const std::string& curve_source,
             const studies::SeparabilityRequest& request) {
  Json resolution = Json::array();
  for (const double r : all.resolution) resolution.push_back(report::json_number(r));
  Json json = {{"schema_version", 1},
               {"version", version()},
               {"rig", file.rig.name},
               {"rig_digest", file.digest},
               {"curve", curve_source},
               {"angular", curve.conditions.angular},
               {"sampling_rate", curve.conditions.sampling_rate},
               {"periods", request.periods},
               {"records", request.records},
               {"noise", request.noise},
               {"seed", request.seed},
               {"slope", report::json_number(all.slope)},
               {"backlash", all.backlash},
               {"resolution", resolution}};
  for (const studies::SeparabilityMap& map : all.maps) json["maps"].push_back(map_json(map, all.methods));
  return json;
}

std::string span(const std::vector<studies::SeparabilityCell>& row, double unit) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const studies::SeparabilityCell& cell : row) {
    low = std::fmin(low, cell.equivalent);
    high = std::fmax(high, cell.equivalent);
  }
  if (!(low <= high)) return "-";
  return fmt::format("{:+.1f} .. {:+.1f}", low / unit + 0.0, high / unit + 0.0);  // no "-0.0"
}

/// Shares of the records, and the largest error of a cell that was not refused.
std::string outcome(const std::vector<studies::SeparabilityCell>& row, std::size_t method, double unit) {
  double right = 0, wrong = 0, refused = 0, worst = kNaN;
  for (const studies::SeparabilityCell& cell : row) {
    const studies::SeparabilityAnswer& a = cell.answers[method];
    right += a.right, wrong += a.wrong, refused += a.refused;
    worst = std::fmax(worst, std::fabs(a.error));
  }
  const double percent = 100 / (right + wrong + refused);
  const std::string largest = std::isnan(worst) ? "-" : fmt::format("{:.1f}", worst / unit);
  return fmt::format("{:3.0f} /{:4.0f} /{:4.0f}{:>8}", percent * right, percent * wrong, percent * refused,
                     largest);
}

void print_map(const studies::Separability& all, bool angular) {
  const double unit = angular ? 1e-3 : 1e-6;
  const std::string name = angular ? "mrad" : "um";
  for (const studies::SeparabilityMap& map : all.maps) {
    std::cout << map.disturbance.axis << '\n'
              << std::setw(8) << "level" << std::setw(22) << "equivalent [" + name + "]";
    for (const std::string& method : all.methods)
      std::cout << "   " << std::setw(13) << method << ": right/wrong/refused [%], worst [" << name << "]";
    std::cout << '\n';
    for (std::size_t i = 0; i < map.cells.size(); ++i) {
      std::cout << std::setw(8) << map.disturbance.levels[i] << std::setw(22) << span(map.cells[i], unit);
      for (std::size_t m = 0; m < all.methods.size(); ++m)
        std::cout << "   " << std::setw(49 + static_cast<int>(name.size())) << outcome(map.cells[i], m, unit);
      std::cout << '\n';
    }
  }
}

studies::SeparabilityRequest read_request(const Arguments& a) {
  studies::SeparabilityRequest r;
  r.backlash_values = static_cast<int>(a.integer("points", r.backlash_values, 2, kMost));
  r.records = static_cast<int>(a.integer("records", r.records, 1, kMost));
  r.periods = static_cast<int>(a.integer("periods", r.periods, 1, kMost));
  r.waveform = a.has("waveform");
  r.noise = a.number("noise", r.noise, Range::not_negative());
  r.seed = a.integer("seed", r.seed, 0, std::numeric_limits<std::uint64_t>::max());
  return r;
}

void check_outputs(const Arguments& arguments) {
  const std::string out = arguments.text("json"), plot = arguments.text("plot");
  std::vector<std::string> inputs = {arguments.positional(0)};
  if (arguments.has("curve")) inputs.push_back(arguments.text("curve"));
  check_output(out, inputs);
  if (plot.empty()) return;
  check_plot_path(plot);
  if (plot == out) throw UsageError("--plot and --json name the same file");
  check_output(plot, inputs);
}

int map(const Arguments& arguments) {
  const studies::SeparabilityRequest request = read_request(arguments);
  const std::string out = arguments.text("json"), given = arguments.text("curve");
  const rig_file::RigFile file = rig_file::load_rig_file(arguments.positional(0));
  check_outputs(arguments);
  diagnosis::MonitoringCurve curve;
  studies::Separability all;
  {
    ProgressBar bar;
    curve = given.empty() ? studies::build_curve(file, {}, bar.progress()) : diagnosis::read_curve(given);
    all = studies::map_separability(file, curve, studies::disturbances_of(file), request, bar.progress());
  }
  if (curve.conditions.rig_digest != file.digest)
    std::cerr << "separability_map: the curve was made from another version of the rig file\n";
  const std::string source = given.empty() ? "built for this map" : given;
  write_text(out, to_json(all, file, curve, source, request).dump() + "\n");
  print_map(all, curve.conditions.angular);
  if (arguments.has("plot")) {
    std::cout.flush();
    plot_separability_map(out, arguments.text("plot"));
  }
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, map);
}
