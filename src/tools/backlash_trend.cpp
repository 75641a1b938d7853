// SPDX-License-Identifier: BSD-3-Clause
// Whether the backlash of a joint grows, by its history.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/diagnosis/trend.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "report/json.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/plot.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDay = 86400;

Command command() {
  Command c;
  c.name = "backlash_trend";
  c.summary =
      "Estimates from a joint's history of estimates how fast its backlash grows and when it reaches a "
      "limit.";
  c.positional = {"HISTORY"};
  c.options = {
      {"rig", "RIG.yaml",
       "rig file: whose estimates count and which service limit holds; default: that of the "
       "last entry, no limit"},
      {"limits", "LIMITS.yaml", "limits of which `service` holds, instead of the rig file's"},
      {"baseline", "BASELINE.yaml", "the healthy machine: the limits then hold for the growth since"},
      {"limit", "M", "limit of the backlash itself, instead of those of a file"},
      {"limit-angle", "RAD", "the same as an angle on the axis of motor_position"},
      {"horizon", "DAYS",
       "a limit that is reached within so many days from the last entry is worth watching; "
       "default: 90"},
      {"json", "OUT.json", "report to write; '-' writes it to standard output instead of the summary"},
      {"plot", "OUT.png", "also draw the history, its trend and the limit"},
  };
  c.notes =
      "A trend needs 10 estimates at different times over a day, and begins anew at each baseline. The rate "
      "is "
      "that of Theil and Sen; its 95 % interval allows for errors that hang together from one estimate to "
      "the "
      "next, the date's is Fieller's. Parts that a full history left behind (HISTORY.1, ...) are read with "
      "it.";
  c.examples = {"backlash_trend ~/.ros/history/elbow.csv --rig elbow.yaml",
                "backlash_trend elbow.csv --limit 150e-6 --json trend.json --plot trend.png"};
  c.exit_codes =
      "  0   no growth, or the limit is far\n"
      "  1   watch: the limit is reached within the horizon\n"
      "  2   the limit is exceeded\n"
      "  3   inconclusive: no trend can be estimated\n";
  return c;
}

/// What the command was given, read.
struct Inputs {
  diagnosis::HistoryFile history;
  std::string rig, rig_digest;  // name empty where it is not known
  bool angular = false;
  std::optional<double> limit;
  double horizon = 90 * kDay;

  const char* unit() const { return angular ? "rad" : "m"; }
  double value(const diagnosis::HistoryEntry& e) const { return angular ? e.backlash_angle : e.backlash; }
};

bool knows_lengths(const std::vector<diagnosis::HistoryEntry>& entries) {
  return entries.empty() || std::any_of(entries.begin(), entries.end(), [](const diagnosis::HistoryEntry& e) {
           return std::isfinite(e.backlash);
         });
}

/// The value from which the limits count; 0 without a baseline.
double baseline_value(Inputs& in, const Arguments& arguments) {
  if (!arguments.has("baseline")) return 0;
  const std::string path = arguments.text("baseline");
  const diagnosis::Baseline baseline = diagnosis::read_baseline(path);
  const std::string warning = diagnosis::check_baseline(baseline, in.rig, in.rig_digest, path);
  if (!warning.empty()) in.history.warnings.push_back(warning);
  const double value = in.angular ? baseline.backlash_angle : baseline.backlash;
  if (!std::isfinite(value)) throw BadData(path, std::string("holds no backlash in ") + in.unit());
  return value;
}

void read_limit(Inputs& in, const Arguments& arguments, const std::optional<rig_file::RigFile>& rig) {
  std::optional<diagnosis::Limits> limits;
  if (rig) limits = rig->diagnosis.limits;
  if (arguments.has("limits")) limits = diagnosis::read_limits_file(arguments.text("limits"));
  const bool by_hand = arguments.has("limit") || arguments.has("limit-angle");
  in.angular = by_hand  ? arguments.has("limit-angle")
               : limits ? limits->angular
               : rig    ? rig->rig.mesh.angular()
                        : !knows_lengths(in.history.entries);
  if (rig && rig->rig.mesh.angular() && !in.angular)
    throw BadData(arguments.text(by_hand ? "rig" : "limits"),
                  "a rig without base_radius needs a limit of backlash_angle");
  const double start = baseline_value(in, arguments);
  if (by_hand)
    in.limit = arguments.number(in.angular ? "limit-angle" : "limit", 0, Range::positive());
  else if (limits)
    in.limit = start + limits->service;
}

void check_options(const Arguments& arguments) {
  if (arguments.has("limit") && arguments.has("limit-angle"))
    throw UsageError("--limit and --limit-angle: only one of them");
  if ((arguments.has("limit") || arguments.has("limit-angle")) &&
      (arguments.has("limits") || arguments.has("baseline")))
    throw UsageError("--limit is of the backlash itself: without --limits and --baseline");
  if (arguments.has("baseline") && !arguments.has("rig")) throw UsageError("--baseline needs --rig");
  std::vector<std::string> inputs = {arguments.positional(0)};
  for (const char* option : {"rig", "limits", "baseline"})
    if (arguments.has(option)) inputs.push_back(arguments.text(option));
  const std::string json = arguments.text("json"), plot = arguments.text("plot");
  if (!json.empty() && json != kStandardOutput) check_output(json, inputs);
  if (plot.empty()) return;
  check_plot_path(plot);
  if (!json.empty() && json != kStandardOutput) inputs.push_back(json);
  check_output(plot, inputs);
}

Inputs read_inputs(const Arguments& arguments) {
  check_options(arguments);
  Inputs in;
  in.horizon = kDay * arguments.number("horizon", 90, Range::positive());
  std::optional<rig_file::RigFile> rig;
  if (arguments.has("rig")) rig = rig_file::load_rig_file(arguments.text("rig"));
  in.history = diagnosis::read_history(arguments.positional(0));
  const auto& entries = in.history.entries;
  if (rig) in.rig = rig->rig.name;
  in.rig_digest = rig ? rig->digest : entries.empty() ? "" : entries.back().rig_digest;
  read_limit(in, arguments, rig);
  const auto others = std::count_if(entries.begin(), entries.end(), [&](const diagnosis::HistoryEntry& e) {
    return e.rig_digest != in.rig_digest;
  });
  if (others > 0)
    in.history.warnings.push_back(std::to_string(others) +
                                  " entries were made with another version of the rig file and are left out");
  return in;
}

Json date(double time) {
  const std::string text = std::isfinite(time) ? utc_time(time) : "";
  return text.empty() ? Json(nullptr) : Json(text);
}

Json crossing_json(const diagnosis::Trend& trend) {
  if (!trend.reaches) return nullptr;
  const diagnosis::Trend::Crossing& c = *trend.reaches;
  Json json;
  json["time"] = report::json_number(c.time);
  json["date"] = date(c.time);
  json["interval"] = report::json_interval(c.earliest, c.latest);
  json["date_interval"] = Json::array({date(c.earliest), date(c.latest)});
  return json;
}

/// What a picture shows: the entries that the trend stands on, or every n-th of very many.
Json series_json(const Inputs& in) {
  constexpr std::size_t kMost = 2000;
  const auto& all = in.history.entries;
  const auto baseline = std::find_if(all.rbegin(), all.rend(), [](const diagnosis::HistoryEntry& e) {
    return e.event == diagnosis::kBaselineEvent;
  });
  std::vector<const diagnosis::HistoryEntry*> shown;
  for (auto entry = baseline.base(); entry != all.end(); ++entry)
    if (entry->rig_digest == in.rig_digest && std::isfinite(in.value(*entry))) shown.push_back(&*entry);
  Json json = {{"time", Json::array()}, {"value", Json::array()}, {"interval", Json::array()}};
  const std::size_t step = (shown.size() + kMost - 1) / kMost;
  for (std::size_t i = 0; i < shown.size(); i += step) {
    const diagnosis::HistoryEntry& e = *shown[i];
    json["time"].push_back(e.time);
    json["value"].push_back(in.value(e));
    json["interval"].push_back(in.angular ? report::json_interval(e.angle_lower, e.angle_upper)
                                          : report::json_interval(e.lower, e.upper));
  }
  return json;
}

Json report(const Inputs& in, const diagnosis::Trend& trend, const std::string& path) {
  Json json;
  json["schema_version"] = 1;
  json["version"] = version();
  json["history"] = path;
  json["rig"] = in.rig.empty() ? Json(nullptr) : Json(in.rig);
  json["rig_digest"] = in.rig_digest;
  json["quantity"] = in.angular ? "backlash_angle" : "backlash";
  json["unit"] = in.unit();
  json["limit"] = in.limit ? Json(*in.limit) : Json(nullptr);
  json["horizon"] = in.horizon;
  json["entries"] = in.history.entries.size();
  json["points"] = trend.points;
  json["span"] = trend.span;
  json["known"] = trend.known;
  json["grows"] = trend.grows;
  json["exceeded"] = trend.exceeded;
  json["rate"] = report::json_number(trend.rate);
  json["rate_interval"] = report::json_interval(trend.rate_lower, trend.rate_upper);
  json["level"] = report::json_number(trend.level);
  json["time"] = report::json_number(trend.time);
  json["date"] = date(trend.time);
  json["reaches"] = crossing_json(trend);
  json["message"] = trend.message;
  const auto since = diagnosis::silent_since(in.history.entries, double(std::time(nullptr)));
  json["silent_since"] = since ? date(*since) : Json(nullptr);
  json["warnings"] = in.history.warnings;
  json["series"] = series_json(in);
  return json;
}

int exit_code(const Inputs& in, const diagnosis::Trend& trend) {
  if (trend.exceeded) return kFault;
  if (!trend.known) return kInconclusive;
  return trend.reaches && trend.reaches->time - trend.time <= in.horizon ? kWatch : kHealthy;
}

int run(const Arguments& arguments) {
  const Inputs in = read_inputs(arguments);
  const diagnosis::Trend trend = diagnosis::find_trend(
      diagnosis::trend_points(in.history.entries, in.angular, in.rig_digest), in.limit, in.angular);
  const std::string out = arguments.text("json");
  const std::string json =
      report(in, trend, arguments.positional(0)).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  if (out == kStandardOutput) {
    std::cout << json;
  } else {
    if (!out.empty()) write_text(out, json);
    for (const std::string& warning : in.history.warnings) std::cerr << "backlash_trend: " << warning << '\n';
    std::cout << trend.message << '\n';
    if (const auto since = diagnosis::silent_since(in.history.entries, double(std::time(nullptr))))
      std::cout << "nothing was reported since " << utc_time(*since) << '\n';
  }
  if (arguments.has("plot")) {
    std::cout.flush();
    plot_trend(json, arguments.text("plot"));
  }
  return exit_code(in, trend);
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, run);
}
