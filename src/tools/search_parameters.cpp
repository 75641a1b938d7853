// SPDX-License-Identifier: BSD-3-Clause
// Searches the unprinted parameters of a published monitoring curve.
#include <fmt/core.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/studies/parameter_search.h"
#include "report/json.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/progress_bar.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;

Command command() {
  Command c;
  c.name = "search_parameters";
  c.summary =
      "Searches the parameters that a publication does not print, within declared bounds, for a rig whose "
      "monitoring "
      "curve meets the published skewness values and never rises.";
  c.positional = {"SEARCH.yaml"};
  c.options = {
      {"out", "RIG.yaml", "rig file found"},
      {"json", "OUT.json", "published and achieved values, curve, bounds, history"},
      {"budget", "N", "rigs to try; default: the search file's"},
      {"seed", "N", "of the search; default: the search file's"},
      {"set", "KEY=VALUE,...",
       "changes parameters of the search: a value that is not searched (gear_train.motor.inertia=2.24e-4), "
       "or bounds "
       "(gear_train.input_coupling.damping=1e-5..0.1, log scale)"},
      {"check", "RIG.yaml", "do not search: judge this rig by the targets of the search file, in seconds"},
  };
  c.notes =
      "The result depends on the search file and its seed, not on the number of processors. A rig file found "
      "earlier "
      "is confirmed with --check.";
  c.examples = {"search_parameters config/sarkar_1997_search.yaml --out fitted.yaml --json fitted.json",
                "search_parameters config/sarkar_1997_search.yaml --check config/sarkar_1997_fitted.yaml"};
  c.exit_codes = "  0   done; how well the values are met is in the report\n";
  return c;
}

Json points_json(const std::vector<studies::CurveFit::Point>& points) {
  Json list = Json::array();
  for (const studies::CurveFit::Point& p : points)
    list.push_back({{"backlash", p.backlash},
                    {"skewness", report::json_number(p.skewness)},
                    {"lowest", report::json_number(p.lowest)},
                    {"highest", report::json_number(p.highest)},
                    {"highest_class", report::json_number(p.highest_class)},
                    {"largest_torque", report::json_number(p.largest_torque)}});
  return list;
}

Json fit_json(const studies::CurveFit& fit, const studies::CurveTarget& target) {
  Json json;
  json["published"] = points_json(fit.published);
  for (std::size_t i = 0; i < target.skewness.size(); ++i)
    json["published"][i]["published_skewness"] = target.skewness[i];
  json["rms"] = report::json_number(fit.rms);
  json["rise"] = report::json_number(fit.rise);
  json["rise_at"] = fit.rise_at;
  json["curve"] = points_json(fit.curve);
  return json;
}

Json result_json(const studies::SearchFile& search, const studies::SearchResult& result) {
  Json json;
  json["seed"] = search.minimise.seed;
  json["budget"] = search.minimise.budget;
  json["evaluations"] = result.evaluations;
  for (std::size_t i = 0; i < search.parameters.size(); ++i) {
    const studies::FreeParameter& p = search.parameters[i];
    Json entry = {{"key", p.key}, {"value", result.values[i]}};
    if (p.choices.empty())
      entry.update({{"lower", p.lower}, {"upper", p.upper}, {"at_bound", bool(result.at_bound[i])}});
    else
      entry["choices"] = p.choices;
    json["parameters"].push_back(entry);
  }
  for (const auto& step : result.history)
    json["history"].push_back({{"evaluations", step.evaluations}, {"best", report::json_number(step.value)}});
  return json;
}

void set_values(studies::SearchFile& search, const std::string& list) {
  std::istringstream stream(list);
  for (std::string item; std::getline(stream, item, ',');) {
    const std::size_t equals = item.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == item.size())
      throw UsageError("--set " + list + ": '" + item + "' is not KEY=VALUE");
    studies::set_parameter(search, item.substr(0, equals), item.substr(equals + 1));
  }
}

std::string header(const studies::SearchFile& search, const studies::SearchResult& result,
                   const std::string& set) {
  return "# Found by: search_parameters " + search.source + " --seed " +
         std::to_string(search.minimise.seed) + " --budget " + std::to_string(search.minimise.budget) +
         (set.empty() ? "" : " --set " + set) + "\n# in " + search.rig_source + ": rms " +
         to_text(std::round(1e4 * result.fit.rms) / 1e4) + ", largest rise " +
         to_text(std::round(1e4 * result.fit.rise) / 1e4) + ".\n";
}

void print_fit(const studies::CurveFit& fit, const studies::CurveTarget& target) {
  std::cout << "half gap [um]  published  achieved  highest class [%]  largest torque [N m]\n";
  for (std::size_t i = 0; i < fit.published.size(); ++i) {
    const studies::CurveFit::Point& p = fit.published[i];
    std::cout << fmt::format("{:13.1f}  {:9.4f}  {:8.4f}  {:17.1f}  {:20.3f}\n", 0.5e6 * p.backlash,
                             target.skewness[i], p.skewness, p.highest_class, p.largest_torque);
  }
  std::cout << "rms " << fit.rms << "; largest rise " << fit.rise << " on " << fit.curve.size()
            << " points up to " << target.max_backlash << " m\n";
}

int search(const Arguments& arguments) {
  const std::string out = arguments.text("out"), json_path = arguments.text("json"),
                    checked = arguments.text("check");
  studies::SearchFile search = studies::load_search_file(arguments.positional(0));
  search.minimise.budget = static_cast<int>(
      arguments.integer("budget", search.minimise.budget, search.minimise.population, 10'000'000));
  search.minimise.seed = arguments.integer("seed", search.minimise.seed, 0, std::uint64_t{1} << 53);
  set_values(search, arguments.text("set"));
  if (checked.empty() == out.empty()) throw UsageError("give either --out (to search) or --check");
  for (const std::string& path : {out, json_path})
    if (!path.empty()) check_output(path, {search.source, search.rig_source});
  Json json;
  json["schema_version"] = 1;
  json["version"] = version();
  json["search"] = search.source;
  studies::CurveFit fit;
  if (!checked.empty()) {
    json["rig"] = checked;
    fit = studies::fit_of(rig_file::load_rig_file(checked), search.target);
  } else {
    studies::SearchResult result;
    {
      ProgressBar bar;
      result = studies::search_parameters(search, bar.progress());
    }
    write_text(out, header(search, result, arguments.text("set")) + result.rig_text);
    json["rig"] = out;
    json.update(result_json(search, result));
    fit = result.fit;
  }
  json.update(fit_json(fit, search.target));
  if (!json_path.empty()) write_text(json_path, json.dump(2) + "\n");
  print_fit(fit, search.target);
  return kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, search);
}
