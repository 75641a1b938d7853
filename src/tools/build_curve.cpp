// SPDX-License-Identifier: BSD-3-Clause
// Builds a monitoring curve and, where asked, its plot.
#include <fmt/core.h>

#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/feedback.h"
#include "tools/common/of_file.h"
#include "tools/common/plot.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

constexpr std::uint64_t kMost = 1'000'000;

Command command() {
  const studies::CurveRequest defaults;
  const auto fallback = [](double value) { return "; default: " + to_text(value); };
  Command c;
  c.name = "build_curve";
  c.summary =
      "Simulates a rig over a grid of backlash values and writes the monitoring curve: skewness of the "
      "amplitude "
      "probability distribution against backlash, with its scatter and all conditions it holds for.";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"out", "CURVE.yaml", "curve to write", true},
      {"points", "N", "backlash values, from 0 to the largest" + fallback(defaults.points)},
      {"max-backlash", "M",
       "largest total free play along the line of action [m] (a rig without base radius: angle at "
       "the load [rad])" +
           fallback(defaults.max_backlash)},
      {"sample-rate", "HZ", "of the records that the curve is for; default: the rig file's"},
      {"periods", "N", "excitation periods per run, after settling" + fallback(defaults.periods)},
      {"seeds", "N",
       "runs per backlash value, each with its own noise and sampling phase" + fallback(defaults.seeds)},
      {"plot", "CURVE.png", "also draw the curve with its scatter"},
      feedback_option(),
  };
  c.examples = {"build_curve config/sarkar_1997.yaml --out curve.yaml --plot curve.png"};
  c.exit_codes = "  0   done (a stretch where skewness rises is flagged in the curve and reported)\n";
  return c;
}

studies::CurveRequest read_request(const Arguments& arguments) {
  studies::CurveRequest request;
  request.points = static_cast<int>(arguments.integer("points", request.points, 2, kMost));
  request.max_backlash = arguments.number("max-backlash", request.max_backlash, Range::positive());
  request.sampling_rate = arguments.number("sample-rate", request.sampling_rate, Range::positive());
  request.periods = static_cast<int>(arguments.integer("periods", request.periods, 1, kMost));
  request.seeds = static_cast<int>(arguments.integer("seeds", request.seeds, 1, kMost));
  return request;
}

void print_curve(const diagnosis::MonitoringCurve& curve, const std::string& out) {
  const char* unit = curve.conditions.angular ? " rad" : " m";
  const diagnosis::CurvePoint &first = curve.points.front(), &last = curve.points.back();
  std::cout << fmt::format(
      "{0}: skewness {2:.6g} at backlash {3:.6g}{1} to {4:.6g} at {5:.6g}{1}, {6} points, {7:.6g} Hz\n", out,
      unit, curve.nominal(first).mean, first.backlash, curve.nominal(last).mean, last.backlash,
      curve.points.size(), curve.conditions.sampling_rate);
  if (curve.flat()) {
    std::cerr << "build_curve: the skewness of " << curve.conditions.signal
              << " does not depend on backlash: no backlash can be estimated from it (flat curve)\n";
    return;
  }
  std::vector<std::string> rising;
  for (const diagnosis::CurvePoint& point : curve.points)
    if (!point.monotonic) rising.push_back(fmt::format("{:.6g}", point.backlash));
  if (!rising.empty())
    std::cerr << "build_curve: not monotonic, flagged in the curve, at backlash [" << (unit + 1)
              << "]: " << joined(rising) << '\n';
}

int build(const Arguments& arguments) {
  const std::string& rig = arguments.positional(0);
  const std::string out = arguments.text("out"), plot = arguments.text("plot");
  studies::CurveRequest request = read_request(arguments);
  const rig_file::RigFile file = rig_file::load_rig_file(rig);
  check_output(out, {rig});
  if (!plot.empty()) {
    check_plot_path(plot);
    if (plot == out) throw UsageError("--plot and --out name the same file");
    check_output(plot, {rig});
  }
  diagnosis::MonitoringCurve curve;
  if (arguments.has("feedback")) {
    FeedbackLines lines;
    request.best_so_far = lines.best_so_far();
    curve = of_file(rig, [&] { return studies::build_curve(file, request, lines.progress()); });
  } else {
    ProgressBar bar;
    curve = of_file(rig, [&] { return studies::build_curve(file, request, bar.progress()); });
  }
  write_text(out, curve.to_yaml());
  if (!arguments.has("feedback")) print_curve(curve, out);
  if (!plot.empty()) {
    std::cout.flush();
    plot_curve(out, plot);
  }
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, build);
}
