// SPDX-License-Identifier: BSD-3-Clause
// Geometry and mesh stiffness of a pair of spur gears, from shim to backlash and back.
#include "backlash_diagnosis/model/gear_geometry.h"

#include <fmt/core.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/centre_distance.h"
#include "backlash_diagnosis/model/mesh_stiffness.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"

namespace backlash::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = M_PI / 180;
constexpr int kCyclePoints = 400;  // per mesh cycle

// Table 2 of Sarkar, Ellis and Moore (1997); addendum and material are not printed there.
constexpr int kTeeth = 40;
constexpr double kModule = 0.79375e-3, kPressureAngleDeg = 20, kFaceWidth = 6.35e-3, kAddendum = 1;
constexpr double kYoungsModulus = 193e9, kPoissonRatio = 0.29;

Command command() {
  const auto fallback = [](double value) { return "; default: " + to_text(value); };
  Command c;
  c.name = "gear_geometry";
  c.summary =
      "Computes how a pair of external involute spur gears meets: radii, contact ratio, backlash from centre "
      "distance and "
      "tooth thinning (or the shim for a wanted backlash), and the stiffness along the mesh cycle.";
  c.options = {
      {"teeth1", "N", "of the pinion" + fallback(kTeeth)},
      {"teeth2", "N", "of the gear" + fallback(kTeeth)},
      {"module", "M", "[m]" + fallback(kModule)},
      {"pressure-angle-deg", "DEG", "of the basic rack" + fallback(kPressureAngleDeg)},
      {"addendum", "X", "of both, in modules" + fallback(kAddendum)},
      {"shift1", "X", "profile shift of the pinion, in modules; default: 0"},
      {"shift2", "X", "of the gear; default: 0"},
      {"thinning1", "M", "of the pinion's teeth along the reference circle [m]; default: 0"},
      {"thinning2", "M", "of the gear's teeth; default: 0"},
      {"centre-distance-change", "M",
       "shim: from the centre distance at which unthinned teeth mesh without play [m]; default: 0"},
      {"backlash", "M",
       "wanted play along the line of action [m]: gives the shim instead of --centre-distance-change"},
      {"stop", "M",
       "setting of the stop of a hinged bracket [m], from no play, instead of the shim; needs the bracket"},
      {"pivot-to-stop", "M", "of the bracket: pivot to the axis of the stop [m]"},
      {"pivot-to-pinion", "M", "of the bracket: pivot to the centre of the pinion [m]"},
      {"mesh-angle-deg", "DEG",
       "of the bracket: tangent of the mesh to the line from pivot to pinion; default: 0"},
      {"pinion-step-deg", "DEG",
       "prints what one step of a position sensor on the pinion's shaft is at the teeth"},
      {"table", "N",
       "a table of N rows, from 0 to --centre-distance-change, --stop or --backlash, instead of one pair"},
      {"face-width", "M", "[m]" + fallback(kFaceWidth)},
      {"youngs-modulus", "PA", "of both gears [Pa]" + fallback(kYoungsModulus)},
      {"poisson-ratio", "X", "of both gears" + fallback(kPoissonRatio)},
      {"transition", "X", "travel over which a pair takes up its load, base pitches, 0 to 0.5; default: 0"},
      {"json", "OUT.json",
       "also write the numbers, with the stiffness over two mesh cycles; '-' writes them to standard output "
       "instead of the text"},
  };
  c.notes =
      "The defaults are the gears of Sarkar, Ellis and Moore (1997), Table 2, with an addendum of one module "
      "and "
      "stainless steel 303. Backlash is the full free play. A hinged bracket moves the centre by d r2/r1 "
      "cos(psi) for a stop setting d, r1 from pivot to stop, r2 from pivot to pinion (Yumrukcal 2013, Eqs. "
      "A.1 "
      "to A.4); with --backlash the stop setting that gives it is printed. plot_mesh_stiffness.py draws "
      "OUT.json.";
  c.examples = {
      "gear_geometry --centre-distance-change 50e-6", "gear_geometry --backlash 50e-6",
      "gear_geometry --centre-distance-change 100e-6 --table 5",
      "gear_geometry --backlash 50e-6 --pivot-to-stop 0.2 --pivot-to-pinion 0.1 --mesh-angle-deg 15",
      "gear_geometry --teeth1 20 --teeth2 40 --module 2e-3 --face-width 20e-3 --json gears.json"};
  c.exit_codes =
      "  0   done\n"
      "  2   the pair does not run: contact ratio below 1, interference or pointed teeth\n";
  return c;
}

struct Request {
  model::GearPair pair;
  model::MeshStiffnessSettings mesh;
  bool inverse = false;  // backlash given
  double last = 0;       // m: centre-distance change, or backlash
  int rows = 0;          // 0: one pair
  std::optional<model::HingedBracket> bracket;
  double pinion_step = 0;  // rad, of a position sensor; 0: none
};

std::optional<model::HingedBracket> read_bracket(const Arguments& a) {
  const bool lengths = a.has("pivot-to-stop") && a.has("pivot-to-pinion");
  if (!lengths) {
    for (const char* option : {"stop", "pivot-to-stop", "pivot-to-pinion", "mesh-angle-deg"})
      if (a.has(option))
        throw UsageError(std::string("--") + option + " needs --pivot-to-stop and --pivot-to-pinion");
    return std::nullopt;
  }
  model::HingedBracket b;
  b.pivot_to_stop = a.number("pivot-to-stop", 0, Range::positive());
  b.pivot_to_pinion = a.number("pivot-to-pinion", 0, Range::positive());
  b.angle = a.number("mesh-angle-deg", 0, Range::between(-89, 89)) * kDegree;
  return b;
}

/// m: the centre-distance change of --stop, or as given.
double read_change(const Arguments& a, const std::optional<model::HingedBracket>& bracket) {
  return a.has("stop") ? model::centre_distance_change(*bracket, a.number("stop", 0, Range::any()))
                       : a.number("centre-distance-change", 0, Range::any());
}

Request read_request(const Arguments& a) {
  Request r;
  model::GearPair& p = r.pair;
  p.pinion.teeth = static_cast<int>(a.integer("teeth1", kTeeth, 3, 1'000'000));
  p.gear.teeth = static_cast<int>(a.integer("teeth2", kTeeth, 3, 1'000'000));
  p.module = a.number("module", kModule, Range::positive());
  p.pressure_angle = a.number("pressure-angle-deg", kPressureAngleDeg, Range::between(5, 45)) * kDegree;
  p.pinion.addendum = p.gear.addendum = a.number("addendum", kAddendum, Range::between(0.1, 2));
  p.pinion.profile_shift = a.number("shift1", 0, Range::between(-1, 1.5));
  p.gear.profile_shift = a.number("shift2", 0, Range::between(-1, 1.5));
  p.pinion.thinning = a.number("thinning1", 0, Range::any());
  p.gear.thinning = a.number("thinning2", 0, Range::any());
  r.mesh.face_width = a.number("face-width", kFaceWidth, Range::positive());
  r.mesh.youngs_modulus = a.number("youngs-modulus", kYoungsModulus, Range::positive());
  r.mesh.poisson_ratio = a.number("poisson-ratio", kPoissonRatio, Range::between(0, 0.5));
  r.mesh.transition = a.number("transition", 0, Range::between(0, 0.5));
  r.bracket = read_bracket(a);
  if (a.has("pinion-step-deg")) r.pinion_step = a.number("pinion-step-deg", 0, Range::positive()) * kDegree;
  r.inverse = a.has("backlash");
  if (a.has("backlash") + a.has("centre-distance-change") + a.has("stop") > 1)
    throw UsageError("--backlash, --centre-distance-change and --stop exclude each other");
  r.last = r.inverse ? a.number("backlash", 0, Range::not_negative()) : read_change(a, r.bracket);
  if (a.has("table")) r.rows = static_cast<int>(a.integer("table", 0, 2, 10'000));
  return r;
}

/// The pair at a centre-distance change, or at the one that a backlash needs.
model::GearPair pair_at(const Request& request, double value) {
  model::GearPair pair = request.pair;
  pair.centre_distance_change = request.inverse ? model::centre_distance_change_for(pair, value) : value;
  return pair;
}

double small_change_play(const model::GearPair& pair) {
  return model::small_change_backlash(pair.centre_distance_change, pair.pressure_angle) +
         (pair.pinion.thinning + pair.gear.thinning) * std::cos(pair.pressure_angle);
}

Json to_json(const model::GearCircles& c) {
  return {{"reference_radius", c.reference_radius},
          {"base_radius", c.base_radius},
          {"tip_radius", c.tip_radius},
          {"operating_radius", c.operating_radius},
          {"operating_tooth_thickness", c.operating_tooth_thickness},
          {"tip_thickness", c.tip_thickness}};
}

Json to_json(const model::GearPair& pair, const model::GearGeometry& g,
             const std::optional<model::HingedBracket>& bracket) {
  Json json = {{"centre_distance_change", pair.centre_distance_change},
               {"centre_distance", g.centre_distance},
               {"operating_pressure_angle", g.operating_pressure_angle},
               {"base_pitch", g.base_pitch},
               {"approach", g.approach},
               {"recess", g.recess},
               {"length_of_contact", g.length_of_contact},
               {"contact_ratio", g.contact_ratio},
               {"backlash", g.backlash},
               {"small_change_backlash", small_change_play(pair)},
               {"pitch_circle_backlash", g.pitch_circle_backlash},
               {"backlash_angle", {{"pinion", g.pinion_backlash_angle()}, {"gear", g.gear_backlash_angle()}}},
               {"pinion", to_json(g.pinion)},
               {"gear", to_json(g.gear)},
               {"faults", g.faults},
               {"remarks", g.remarks}};
  if (bracket) json["stop"] = model::stop_setting_for(*bracket, pair.centre_distance_change);
  return json;
}

Json to_json(const model::HingedBracket& b) {
  return {{"pivot_to_stop", b.pivot_to_stop}, {"pivot_to_pinion", b.pivot_to_pinion}, {"angle", b.angle}};
}

/// What one step of the sensor on the pinion's shaft is at the teeth, m.
Json resolution_to_json(const model::GearPair& pair, double step) {
  const double pitch_circle = model::resolution_on_pitch_circle(pair.pinion.teeth, pair.module, step);
  return {{"pinion_step", step},
          {"pitch_circle", pitch_circle},
          {"line_of_action", pitch_circle * std::cos(pair.pressure_angle)}};
}

/// Mean and course over two mesh cycles of every law; one that the gears do not suit has the reason instead.
Json stiffness_to_json(const model::GearPair& pair, model::MeshStiffnessSettings settings) {
  Json phase = Json::array(), pairs = Json::array(), laws = Json::object();
  for (int i = 0; i < 2 * kCyclePoints; ++i) phase.push_back(static_cast<double>(i) / kCyclePoints);
  for (const std::string& law : model::mesh_stiffness_laws()) {
    settings.law = law;
    try {
      const model::MeshStiffness mesh(pair, settings);
      Json course = Json::array();
      for (const double p : phase) course.push_back(mesh.stiffness(p));
      laws[law] = {{"mean", mesh.mean()}, {"stiffness", course}};
      if (pairs.empty())
        for (const double p : phase) pairs.push_back(mesh.pairs(p));
    } catch (const InvalidParameter& error) {
      laws[law] = {{"mean", nullptr}, {"reason", error.what()}};
    }
  }
  return {{"face_width", settings.face_width},
          {"youngs_modulus", settings.youngs_modulus},
          {"poisson_ratio", settings.poisson_ratio},
          {"transition", settings.transition},
          {"phase", phase},
          {"pairs", pairs},
          {"laws", laws}};
}

template <typename... Values>
void line(const char* format, const Values&... values) {
  std::cout << fmt::format(fmt::runtime(format), values...) << '\n';
}

void print_rig(const Json& json) {
  const auto one = [](const char* name, double value, int digits) {
    line("{:<34}{:12.{}f}", name, value, digits);
  };
  if (json.contains("bracket")) one("stop setting [um]", 1e6 * json["geometry"]["stop"].get<double>(), 2);
  if (!json.contains("resolution")) return;
  one("sensor step, pitch circle [um]", 1e6 * json["resolution"]["pitch_circle"].get<double>(), 3);
  one("  line of action [um]", 1e6 * json["resolution"]["line_of_action"].get<double>(), 3);
}

void print_pair(const model::GearPair& pair, const model::GearGeometry& g, const Json& stiffness) {
  line("{:<34}{:>12}{:>12}", "", "pinion", "gear");
  line("{:<34}{:12}{:12}", "teeth", pair.pinion.teeth, pair.gear.teeth);
  const auto both = [](const char* name, double pinion, double gear) {
    line("{:<34}{:12.4f}{:12.4f}", name, 1e3 * pinion, 1e3 * gear);
  };
  both("reference radius [mm]", g.pinion.reference_radius, g.gear.reference_radius);
  both("base radius [mm]", g.pinion.base_radius, g.gear.base_radius);
  both("tip radius [mm]", g.pinion.tip_radius, g.gear.tip_radius);
  both("operating pitch radius [mm]", g.pinion.operating_radius, g.gear.operating_radius);
  line("");
  const auto one = [](const char* name, double value, int digits) {
    line("{:<34}{:12.{}f}", name, value, digits);
  };
  one("centre distance [mm]", 1e3 * g.centre_distance, 4);
  one("  change (shim) [um]", 1e6 * pair.centre_distance_change, 2);
  one("operating pressure angle [deg]", g.operating_pressure_angle / kDegree, 3);
  one("base pitch [mm]", 1e3 * g.base_pitch, 4);
  one("length of contact [mm]", 1e3 * g.length_of_contact, 4);
  one("contact ratio [-]", g.contact_ratio, 3);
  line("");
  one("backlash, line of action [um]", 1e6 * g.backlash, 2);
  one("  small-change form [um]", 1e6 * small_change_play(pair), 2);
  one("backlash, pitch circle [um]", 1e6 * g.pitch_circle_backlash, 2);
  const auto angle = [](const char* name, double value) {
    line("{:<34}{:12.4f}{:12.4f} deg", name, 1e3 * value, value / kDegree);
  };
  angle("backlash at the pinion [mrad]", g.pinion_backlash_angle());
  angle("backlash at the gear [mrad]", g.gear_backlash_angle());
  line("\nmean mesh stiffness, face width {:g} mm", 1e3 * stiffness["face_width"].get<double>());
  for (const auto& [law, value] : stiffness["laws"].items()) {
    if (value["mean"].is_null())
      std::cout << "  " << law << ": " << value["reason"].get<std::string>() << '\n';
    else
      line("  {:<32}{:12.3g} N/m", law, value["mean"].get<double>());
  }
}

void warn(const model::GearGeometry& g) {
  for (const auto* list : {&g.faults, &g.remarks})
    for (const std::string& text : *list) std::cerr << "gear_geometry: " << text << '\n';
}

/// The report; fills `faults` with whether any pair in it does not run.
Json report(const Request& request, bool print, bool& faults) {
  Json json = {{"schema_version", 1},
               {"pinion_teeth", request.pair.pinion.teeth},
               {"gear_teeth", request.pair.gear.teeth},
               {"module", request.pair.module},
               {"pressure_angle", request.pair.pressure_angle}};
  if (request.bracket) json["bracket"] = to_json(*request.bracket);
  if (request.pinion_step > 0) json["resolution"] = resolution_to_json(request.pair, request.pinion_step);
  if (request.rows == 0) {
    const model::GearPair pair = pair_at(request, request.last);
    const model::GearGeometry g = model::gear_geometry(pair);
    json["geometry"] = to_json(pair, g, request.bracket);
    json["mesh_stiffness"] = stiffness_to_json(pair, request.mesh);
    faults = !g.faults.empty();
    if (print) {
      print_pair(pair, g, json["mesh_stiffness"]);
      print_rig(json);
    }
    warn(g);
    return json;
  }
  json["table"] = Json::array();
  if (print)
    line("{:>10}{:>13}{:>9}{:>15}{:>19}{:>15}{:>14}", "shim [um]", "angle [deg]", "eps [-]", "backlash [um]",
         "small-change [um]", "pitch c. [um]", "pinion [deg]");
  for (int i = 0; i < request.rows; ++i) {
    const model::GearPair pair = pair_at(request, request.last * i / (request.rows - 1));
    const model::GearGeometry g = model::gear_geometry(pair);
    json["table"].push_back(to_json(pair, g, request.bracket));
    faults = faults || !g.faults.empty();
    if (print)
      line("{:10.2f}{:13.3f}{:9.3f}{:15.2f}{:19.2f}{:15.2f}{:14.4f}{}", 1e6 * pair.centre_distance_change,
           g.operating_pressure_angle / kDegree, g.contact_ratio, 1e6 * g.backlash,
           1e6 * small_change_play(pair), 1e6 * g.pitch_circle_backlash, g.pinion_backlash_angle() / kDegree,
           g.faults.empty() ? "" : "  does not run");
  }
  return json;
}

int run(const Arguments& arguments) {
  const Request request = read_request(arguments);
  const std::string out = arguments.text("json");
  if (!out.empty() && out != kStandardOutput) check_output(out, {});
  bool faults = false;
  Json json;
  try {
    json = report(request, out != kStandardOutput, faults);
  } catch (const InvalidParameter& error) {  // the options are all there is
    throw UsageError(error.what());
  }
  const std::string text = json.dump(2) + "\n";
  if (out == kStandardOutput) std::cout << text;
  if (!out.empty() && out != kStandardOutput) write_text(out, text);
  return faults ? kFault : kHealthy;
}

}  // namespace
}  // namespace backlash::tools

int main(int argc, char** argv) {
  using namespace backlash::tools;
  return run_command(command(), argc, argv, run);
}
