// SPDX-License-Identifier: BSD-3-Clause
// Which integrator at which tolerance: tables as JSON and text, pictures where asked.
#include "backlash_diagnosis/studies/integrator_study.h"

#include <cmath>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "report/json.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/of_file.h"
#include "tools/common/plot.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kRight = 0.01;
constexpr double kLevels[] = {1e-4, 1e-6, 1e-8};
constexpr studies::AbsoluteTolerance kKinds[] = {studies::AbsoluteTolerance::scaled,
                                                 studies::AbsoluteTolerance::plain};
constexpr std::pair<const char*, studies::Cost> kCosts[] = {{"evaluations", studies::Cost::evaluations},
                                                            {"cpu_time", studies::Cost::cpu_time}};

Command command() {
  Command c;
  c.name = "integrator_study";
  c.summary =
      "Runs every integration method over its tolerances on single teeth (restitution, loop area, energy, "
      "penetration of the wrong flank) and on a rig (work against precision).";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"loop", "LOOP.yaml", "teeth, start states and what to do with the rig: config/hysteresis_loop.yaml",
       true},
      {"json", "OUT.json", "all figures and the drawn motions", true},
      {"plot", "PREFIX", "also draw PREFIX_loops.png and PREFIX_work.png"},
  };
  c.notes =
      "All but the CPU times is the same in every run. Absolute tolerances: 'scaled' are the relative "
      "tolerance times the depth and the speed of the impact, 'plain' the same number in m and in m/s.";
  c.examples = {
      "integrator_study config/sarkar_1997.yaml --loop config/hysteresis_loop.yaml --json study.json --plot "
      "study"};
  c.exit_codes = "  0   done\n";
  return c;
}

Json errors_json(const studies::ToothErrors& e) {
  return {{"restitution", report::json_number(e.restitution)},
          {"loop_area", report::json_number(e.loop_area)},
          {"energy", report::json_number(e.energy)},
          {"energy_gain", report::json_number(e.energy_gain)},
          {"opposite", report::json_number(e.opposite)},
          {"motion", report::json_number(e.motion)}};
}

Json tooth_json(const studies::Tooth& tooth, const studies::ToothReference& reference,
                const studies::IntegratorStudy& study) {
  Json json = {{"name", tooth.name},
               {"gap", tooth.gap},
               {"duration", tooth.duration},
               {"impact_speed", reference.impact_speed},
               {"depth", reference.depth},
               {"restitution", report::json_number(reference.restitution)},
               {"reference_agreement", reference.agreement},
               {"reference_restitution_error", report::json_number(reference.restitution_error)}};
  for (const studies::AbsoluteTolerance kind : kKinds)
    for (const std::string& method : simulation::integrator_methods())
      json["right_from"][studies::to_string(kind)][method] =
          report::json_number(study.right_from(tooth.name, method, kind, kRight));
  for (const studies::ToothRow& row : study.rows)
    if (row.tooth == tooth.name)
      json["runs"].push_back({{"method", row.method},
                              {"absolute", studies::to_string(row.absolute)},
                              {"tolerance", row.tolerance},
                              {"worst", errors_json(row.worst)},
                              {"median", errors_json(row.median)},
                              {"opposite_runs", row.opposite_runs},
                              {"failed_runs", row.failed_runs},
                              {"steps", row.steps}});
  for (const studies::DrawnMotion& d : study.drawn)
    if (d.tooth == tooth.name)
      json["drawn"].push_back({{"method", d.method},
                               {"tolerance", d.tolerance},
                               {"penetration", d.motion.penetration},
                               {"force", d.motion.force}});
  return json;
}

Json point_json(const studies::WorkPoint& p) {
  return {{"method", p.method},           {"tolerance", p.tolerance}, {"error", report::json_number(p.error)},
          {"evaluations", p.evaluations}, {"steps", p.steps},         {"cpu_time", p.cpu_time}};
}

Json work_json(const studies::WorkPrecision& work) {
  Json json = {{"problem", work.problem()}, {"reference_agreement", work.agreement()}};
  for (const studies::WorkPoint& point : work.points()) json["points"].push_back(point_json(point));
  for (const double level : kLevels) {
    Json at = {{"error", level}};
    for (const auto& [name, cost] : kCosts) {
      at["cheapest"][name] = work.cheapest(level, cost);
      for (const std::string& method : simulation::integrator_methods())
        at[name][method] = report::json_number(work.cost(method, level, cost));
    }
    json["cost"].push_back(at);
  }
  return json;
}

Json study_json(const studies::IntegratorStudy& study, const studies::IntegratorStudySettings& settings,
                const rig_file::RigFile& rig) {
  Json json = {{"schema_version", 1},
               {"version", version()},
               {"rig", rig.rig.name},
               {"half_gap", settings.half_gap},
               {"rig_duration", settings.rig_duration},
               {"starts", settings.starts},
               {"right_share", kRight}};
  for (std::size_t i = 0; i < settings.teeth.size(); ++i)
    json["teeth"].push_back(tooth_json(settings.teeth[i], study.references[i], study));
  for (const studies::WorkPrecision& work : study.work) json["work"].push_back(work_json(work));
  json["rig_declared"] = point_json(study.rig_declared);
  return json;
}

void print_accuracy(const studies::IntegratorStudy& study, const studies::IntegratorStudySettings& settings) {
  std::cout
      << "Loosest tolerance from which on a method is right to 1 % (scaled | plain absolute tolerances):\n"
      << std::setw(18) << "";
  for (const studies::Tooth& tooth : settings.teeth) std::cout << std::setw(17) << tooth.name;
  std::cout << '\n';
  const auto shown = [](double tolerance) { return std::isnan(tolerance) ? "never" : to_text(tolerance); };
  for (const std::string& method : simulation::integrator_methods()) {
    std::cout << "  " << std::left << std::setw(16) << method << std::right;
    for (const studies::Tooth& tooth : settings.teeth)
      std::cout << std::setw(17)
                << shown(study.right_from(tooth.name, method, studies::AbsoluteTolerance::scaled, kRight)) +
                       " | " +
                       shown(study.right_from(tooth.name, method, studies::AbsoluteTolerance::plain, kRight));
    std::cout << '\n';
  }
}

void print_cost(const studies::WorkPrecision& work) {
  std::cout << "Evaluations (CPU time in ms) for an error, " << work.problem() << ":\n"
            << std::setw(18) << "";
  for (const double level : kLevels) std::cout << std::setw(19) << to_text(level);
  std::cout << '\n' << std::fixed;
  for (const std::string& method : simulation::integrator_methods()) {
    std::cout << "  " << std::left << std::setw(16) << method << std::right;
    for (const double level : kLevels)
      std::cout << std::setw(10) << std::setprecision(0)
                << work.cost(method, level, studies::Cost::evaluations) << " (" << std::setw(6)
                << std::setprecision(2) << 1e3 * work.cost(method, level, studies::Cost::cpu_time) << ')';
    std::cout << '\n';
  }
  std::cout << std::defaultfloat << std::setprecision(6);
}

int run_study(const Arguments& arguments) {
  const std::string& rig = arguments.positional(0);
  const std::string loop = arguments.text("loop"), out = arguments.text("json"),
                    plot = arguments.text("plot");
  const rig_file::RigFile file = rig_file::load_rig_file(rig);
  const studies::IntegratorStudySettings settings = studies::load_integrator_study(loop);
  check_output(out, {rig, loop});
  if (!plot.empty())
    for (const char* picture : {"_loops.png", "_work.png"}) check_output(plot + picture, {rig, loop, out});
  studies::IntegratorStudy study;
  {
    ProgressBar bar;
    study = of_file(loop + " with " + rig,
                    [&] { return studies::study_integrators(file, settings, bar.progress()); });
  }
  write_text(out, study_json(study, settings, file).dump() + "\n");
  print_accuracy(study, settings);
  for (const studies::WorkPrecision& work : study.work) print_cost(work);
  const studies::WorkPoint& own = study.rig_declared;
  std::cout << "The solver of " << rig << ", " << own.method << " at " << to_text(own.tolerance) << ": error "
            << own.error << ", " << own.evaluations << " evaluations\n";
  if (!plot.empty()) {
    std::cout.flush();
    plot_integrator_study(out, plot);
  }
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, run_study);
}
