// SPDX-License-Identifier: BSD-3-Clause
// What the estimates are worth: a seeded study over random backlash, noise and length of record.
#include "backlash_diagnosis/studies/uncertainty_study.h"

#include <cmath>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

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

constexpr double kHalfGap = 70e-6;  // m, of the table that looks at moderate backlash
constexpr double kNoise = 0.02;     // of the signal's rms, of the table at one noise

Command command() {
  Command c;
  c.name = "uncertainty_study";
  c.summary =
      "Simulates records with random backlash, sensor noise and length on machines whose values are drawn "
      "from what the rig file knows of them, diagnoses each with all channels and without positions, and "
      "counts: error, coverage of the 95 % interval, wrong and sure, share of 'cannot tell'. Then the same "
      "under wrong conditions.";
  c.positional = {"RIG.yaml"};
  c.options = {
      {"json", "OUT.json", "all tables and every single record", true},
      {"curve", "CURVE.yaml", "monitoring curve; default: built first"},
      {"records", "N", "random records; default: 600"},
      {"variants", "N", "records of each wrong condition, 0: none; default: 40"},
      {"known", "X", "every uncertainty of the rig file times X: of a machine known better; default: 1"},
      {"sample-rate", "HZ", "default: the rig file's"},
      {"seed", "N", "of all random numbers; default: 1"},
      {"waveform", "", "also run the estimator waveform: seconds a record"},
      {"plot", "OUT.png", "also draw errors and coverage"},
  };
  c.notes =
      "'combined' is the verdict. An answer is wrong and sure where the truth is outside of its interval by "
      "more than twice its width, or by more than 10 um and a fifth of the truth. Under wrong conditions an "
      "answer within one width counts as right.";
  c.examples = {"uncertainty_study config/sarkar_1997.yaml --json study.json --plot study.png"};
  c.exit_codes = "  0   done\n  1   answers were wrong and sure, or wrong answers under wrong conditions\n";
  return c;
}

Json row_json(const studies::StudyRow& row) {
  return {{"method", row.method},
          {"records", row.trials},
          {"told", row.answered},
          {"median_error", report::json_number(row.median_error)},
          {"p95_error", report::json_number(row.p95_error)},
          {"median_width", report::json_number(row.median_width)},
          {"coverage", report::json_number(row.coverage)},
          {"cannot_tell", report::json_number(row.cannot_tell)},
          {"wrong_and_sure", row.wrong_and_sure}};
}

struct Table {
  bool position;
  double half_gap, noise;  // m, of the signal's rms (NaN: any)
  std::vector<studies::StudyRow> rows;
};

std::vector<Table> tables_of(const std::vector<studies::StudyTrial>& trials,
                             const studies::StudyRequest& request) {
  std::vector<Table> tables;
  const double all = 0.5 * request.max_backlash;
  for (const bool position : {true, false}) {
    std::vector<std::pair<double, double>> groups = {{all, kNaN}, {kHalfGap, kNaN}, {kHalfGap, kNoise}};
    for (const double level : request.noise) groups.emplace_back(all, level);
    for (const auto& [half_gap, noise] : groups)
      tables.push_back(
          {position, half_gap, noise, studies::summarise_study(trials, position, half_gap, noise)});
  }
  return tables;
}

void print(const Table& table) {
  std::cout << (table.position ? "\nall channels" : "\nthe signal and motor_torque alone")
            << ", half gaps to " << 1e6 * table.half_gap << " um, ";
  if (std::isnan(table.noise))
    std::cout << "all noise levels\n";
  else
    std::cout << "noise " << 100 * table.noise << " % of rms\n";
  std::cout << "  method               records  error [um] median   95 %   width   coverage  cannot tell  "
               "wrong and sure\n";
  for (const studies::StudyRow& row : table.rows) {
    std::cout << "  " << std::left << std::setw(22) << row.method << std::right << std::setw(6) << row.trials;
    if (row.answered == 0) {
      std::cout << "    -\n";
      continue;
    }
    std::cout << std::fixed << std::setprecision(2) << std::setw(19) << 1e6 * row.median_error << std::setw(7)
              << 1e6 * row.p95_error << std::setw(8) << 1e6 * row.median_width << std::setprecision(1)
              << std::setw(9) << 100 * row.coverage << " %" << std::setw(10) << 100 * row.cannot_tell << " %"
              << std::setw(8) << row.wrong_and_sure << '\n'
              << std::defaultfloat << std::setprecision(6);
  }
}

void print(const std::vector<studies::VariantRow>& rows) {
  std::cout << "\nwrong conditions: recognised / right although wrong / wrong\n";
  std::string last;
  for (const studies::VariantRow& row : rows) {
    const std::string title = row.variant + (row.position ? ", all channels" : ", the signal alone");
    if (title != last) std::cout << (last.empty() ? "" : "\n") << "  " << std::left << std::setw(42) << title;
    last = title;
    std::cout << "  " << row.method << ' ' << row.recognised << '/' << row.right << '/' << row.wrong;
  }
  std::cout << '\n';
}

Json trials_json(const std::vector<studies::StudyTrial>& trials) {
  Json all = Json::array();
  for (const studies::StudyTrial& trial : trials) {
    Json json = {{"variant", trial.variant},
                 {"backlash", trial.backlash},
                 {"noise", trial.noise},
                 {"periods", trial.periods},
                 {"position", trial.position}};
    for (const diagnosis::Estimate& e : trial.estimates) {
      report::Json& row = json["estimates"][e.method];
      row = {{"status", diagnosis::to_string(e.status)},
             {"backlash", report::json_number(e.backlash)},
             {"interval", {report::json_number(e.lower), report::json_number(e.upper)}}};
      if (e.status != diagnosis::Status::ok) row["message"] = e.message;
    }
    all.push_back(std::move(json));
  }
  return all;
}

/// Answers that nobody should have got.
int misses(const std::vector<Table>& tables, const std::vector<studies::VariantRow>& variants) {
  int count = 0;
  for (const Table& table : tables)
    for (const studies::StudyRow& row : table.rows) count += row.wrong_and_sure;
  for (const studies::VariantRow& row : variants) count += row.wrong;
  return count;
}

diagnosis::MonitoringCurve curve_for(const Arguments& arguments, const rig_file::RigFile& file,
                                     const studies::StudyRequest& request, const Progress& progress) {
  if (arguments.has("curve")) return diagnosis::read_curve(arguments.text("curve"));
  studies::CurveRequest wanted;
  wanted.max_backlash = request.max_backlash;
  wanted.sampling_rate = request.sampling_rate;
  return studies::build_curve(file, wanted, progress);
}

int study(const Arguments& arguments) {
  const std::string& rig = arguments.positional(0);
  const std::string out = arguments.text("json"), plot = arguments.text("plot");
  studies::StudyRequest request;
  request.records = static_cast<int>(arguments.integer("records", request.records, 1, 1'000'000));
  request.seed = arguments.integer("seed", request.seed, 0, std::uint64_t{1} << 53);
  request.waveform = arguments.has("waveform");
  request.sampling_rate = arguments.number("sample-rate", request.sampling_rate, Range::positive());
  const int variants = static_cast<int>(arguments.integer("variants", 40, 0, 1'000'000));
  rig_file::RigFile file = rig_file::load_rig_file(rig);
  if (arguments.has("known")) file = studies::known_to(file, arguments.number("known", 1, Range::positive()));
  check_output(out, {rig});
  if (!plot.empty()) {
    check_plot_path(plot);
    check_output(plot, {rig});
  }
  std::vector<studies::StudyTrial> trials, wrong;
  {
    ProgressBar bar;
    const diagnosis::MonitoringCurve curve = curve_for(arguments, file, request, bar.progress());
    request.max_backlash = curve.points.back().backlash;
    trials = studies::run_study(file, curve, request, bar.progress());
    wrong = studies::run_variants(file, curve, request, variants, bar.progress());
  }
  const std::vector<Table> tables = tables_of(trials, request);
  const std::vector<studies::VariantRow> rows = studies::summarise_variants(wrong);
  Json json = {{"schema_version", 1},  {"version", version()},       {"rig", rig},
               {"seed", request.seed}, {"records", request.records}, {"max_backlash", request.max_backlash}};
  for (const Table& table : tables) {
    Json entry = {{"position", table.position},
                  {"half_gap", table.half_gap},
                  {"noise", report::json_number(table.noise)}};
    for (const studies::StudyRow& row : table.rows) entry["rows"].push_back(row_json(row));
    json["tables"].push_back(std::move(entry));
    print(table);
  }
  for (const studies::VariantRow& row : rows)
    json["variants"].push_back({{"variant", row.variant},
                                {"method", row.method},
                                {"position", row.position},
                                {"recognised", row.recognised},
                                {"right", row.right},
                                {"wrong", row.wrong}});
  print(rows);
  json["trials"] = trials_json(trials);
  json["variant_trials"] = trials_json(wrong);
  write_text(out, json.dump(1) + "\n");
  std::cout.flush();
  if (!plot.empty()) plot_uncertainty_study(out, plot);
  return misses(tables, rows) > 0 ? kWatch : kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, study);
}
