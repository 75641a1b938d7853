#include "procedures.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/identification/rig_parameters.h"

namespace backlash {
namespace {

// What the models of the procedures leave out, as a share of the value, beside the noise.
constexpr double kLineModel = 0.0005;     // share of the motor in the inertia, not known better than to 40 %
constexpr double kDecayModel = 0.01;      // the contact's own damping at the start of a ringing
constexpr double kResponseModel = 0.002;  // a mesh that is not quite linear
constexpr double kLeastCoherence =
    0.1;  // dropping faint points would leave the anti-resonance those that noise lifts
constexpr double kDeclared = 0.4;          // relative standard error of what a rig file says
constexpr double kClearanceModel = 0.005;  // a push that is no polynomial, steps of the sensor
constexpr double kSuspicious = 3;          // standard errors

std::string plus_minus(const Measured& m, const std::string& unit) {
  char text[96];
  std::snprintf(text, sizeof text, "%.5g +- %.2g %s", m.value, m.standard_error, unit.c_str());
  return text;
}

Measured with_model_error(Measured m, double share) {
  m.standard_error = std::hypot(m.standard_error, share * m.value);
  return m;
}

void add(IdentificationCase& c, const std::string& procedure, std::map<std::string, double> combination,
         const Measured& measured) {
  if (std::isfinite(measured.value) && measured.standard_error > 0)
    c.result.findings.push_back({procedure, std::move(combination), measured});
}

/// A parameter as it is known by now.
Measured known(const IdentificationCase& c, const std::string& name) {
  const double value = servo_parameter(name).get(c.result.rig);
  const auto found = c.result.parameters.find(name);
  return {value, found == c.result.parameters.end() ? kDeclared * value : found->second.standard_error};
}

double relative(const Measured& m) {
  return m.standard_error / m.value;
}

/// Calls `body` on every record that `wanted` accepts and keeps the names of those that it can use; the
/// reasons of the others make the message of the exception where there is none.
std::vector<std::string> on_each(const IdentificationCase& c, bool (CaseRecord::*wanted)() const,
                                 const std::function<void(const CaseRecord&)>& body) {
  std::vector<std::string> used, reasons;
  for (const CaseRecord& record : c.records) {
    if (!(record.*wanted)()) continue;
    try {
      body(record);
      used.push_back(record.record.name);
    } catch (const CannotIdentify& error) {
      const std::string reason = error.what();
      const bool named = reason.compare(0, record.record.name.size(), record.record.name) == 0;
      reasons.push_back(named ? reason : record.record.name + ": " + reason);
    }
  }
  if (used.empty()) throw CannotIdentify(reasons.empty() ? "no such record" : joined(reasons));
  return used;
}

ProcedureReport calibrate(IdentificationCase& c) {
  ProcedureReport report{"sensor_calibration", {}, ""};
  std::vector<Record> one_way;
  report.records = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    calibrate_position({r.record});
    one_way.push_back(r.record);
  });
  const PositionCalibration position = calibrate_position(one_way);
  c.result.position_calibration = position;
  report.message = "load = " + plus_minus(position.scale, "") + "times motor";
  if (std::fabs(position.scale.value - 1) > kSuspicious * position.scale.standard_error &&
      std::fabs(position.scale.value - 1) > 1e-5)
    c.result.warnings.push_back(
        "the position sensors differ in scale: load = " + plus_minus(position.scale, "") + "times motor");
  for (const Record& record : one_way) {
    if (!record.has(Channel::motor_velocity) || !record.has(Channel::load_velocity)) continue;
    try {
      c.result.speed_calibration = calibrate_speed(record);
      break;
    } catch (const CannotIdentify&) {  // one of the runs is enough, and none is needed
    }
  }
  return report;
}

/// Both directions of one subject, and what they say about the bodies in `bodies`.
void add_friction(IdentificationCase& c, const std::string& subject,
                  const std::vector<ConstantSpeedRun>& runs, const std::vector<std::string>& bodies) {
  FrictionDetail detail{subject, {}};
  for (const Direction direction : {Direction::positive, Direction::negative}) {
    const double sign = direction == Direction::positive ? 1 : -1;
    try {
      const FrictionLine line = fit_friction_line(runs, direction);
      std::map<std::string, double> coulomb, viscous;
      for (const std::string& body : bodies) {
        coulomb[body + "_coulomb"] = viscous[body + "_viscous"] = 1;
        coulomb[body + "_coulomb_asymmetry"] = viscous[body + "_viscous_asymmetry"] = sign;
      }
      add(c, "friction_lines", coulomb, {sign * line.coulomb.value, line.coulomb.standard_error});
      add(c, "friction_lines", viscous, line.viscous);
      for (const std::string& warning : line.warnings)
        c.result.warnings.push_back("friction of the " + subject +
                                    (sign > 0 ? ", forward: " : ", backward: ") + warning);
      detail.lines.push_back(line);
    } catch (const CannotIdentify& error) {
      c.result.warnings.push_back("friction of the " + subject + (sign > 0 ? ", forward: " : ", backward: ") +
                                  error.what());
    }
  }
  if (!detail.lines.empty()) c.result.friction.push_back(std::move(detail));
}

ProcedureReport friction(IdentificationCase& c) {
  ProcedureReport report{"friction_lines", {}, ""};
  struct Subject {
    const char* name;
    bool (CaseRecord::*wanted)() const;
    std::vector<std::string> bodies;
  };
  for (const Subject& s : {Subject{"motor", &CaseRecord::motor_alone, {"motor"}},
                           Subject{"drive", &CaseRecord::drive, {"motor", "load"}}}) {
    std::vector<ConstantSpeedRun> runs;
    try {
      const auto used = on_each(c, s.wanted, [&](const CaseRecord& r) {
        const auto more = find_constant_speed(r.record);
        runs.insert(runs.end(), more.begin(), more.end());
      });
      add_friction(c, s.name, runs, s.bodies);
      report.records.insert(report.records.end(), used.begin(), used.end());
    } catch (const CannotIdentify& error) {
      report.message += std::string(report.message.empty() ? "" : "; ") + s.name + ": " + error.what();
    }
  }
  if (c.result.friction.empty()) throw CannotIdentify(report.message);
  for (const FrictionDetail& d : c.result.friction)
    for (const FrictionLine& line : d.lines)
      report.message += (report.message.empty() ? "" : "; ") + d.subject + " " +
                        plus_minus(line.coulomb, "N m") + ", " + plus_minus(line.viscous, "N m s/rad");
  return report;
}

ProcedureReport inertia(IdentificationCase& c) {
  ProcedureReport report{"line_inertia", {}, ""};
  const Rig& rig = c.result.rig;
  std::string reasons;
  for (const bool alone : {true, false}) {
    InertiaDetail detail{alone ? "motor" : "drive", {}, {}};
    std::vector<Measured> values;
    try {
      const auto used =
          on_each(c, alone ? &CaseRecord::motor_alone : &CaseRecord::drive, [&](const CaseRecord& r) {
            LineInertiaOptions options;
            options.torque_delay = 0.5 * r.record.sampling_interval();  // held where a loop commands it
            if (!alone) options.motor_share = rig.motor.inertia / (rig.motor.inertia + rig.link.inertia);
            detail.runs.push_back(line_inertia(r.record, options));
            values.push_back(detail.runs.back().inertia);
          });
      detail.combined = robust_mean(values);
      std::map<std::string, double> sum = {{"motor_inertia", 1}};
      if (!alone) sum["load_inertia"] = 1;
      add(c, "line_inertia", sum, with_model_error(detail.combined, kLineModel));
      report.records.insert(report.records.end(), used.begin(), used.end());
      report.message +=
          (report.message.empty() ? "" : "; ") + detail.subject + " " + plus_minus(detail.combined, "kg m^2");
      c.result.inertia.push_back(std::move(detail));
    } catch (const CannotIdentify& error) {
      reasons += std::string(reasons.empty() ? "" : "; ") + detail.subject + ": " + error.what();
    }
  }
  if (c.result.inertia.empty()) throw CannotIdentify(reasons);
  return report;
}

std::size_t reversing(const FrequencyResponse& response) {
  return std::count_if(response.points.begin(), response.points.end(),
                       [](const ResponsePoint& p) { return p.reverses; });
}

/// Held between samples or not: as which the fitted delay vanishes.
ResponseDetail respond(const Record& record) {
  ResponseDetail best;
  double least = INFINITY;
  for (const bool held : {false, true}) {
    ResponseSettings settings;
    settings.held = held;
    settings.least_coherence = kLeastCoherence;
    ResponseDetail d;
    d.held = held;
    d.response = estimate_response(record, settings);
    d.resonances = find_resonances(d.response);
    d.plateaus = find_inertias(d.response, d.resonances);
    d.fit = fit_two_mass(d.response);
    if (std::fabs(d.fit.delay.value) < least) {
      least = std::fabs(d.fit.delay.value);
      best = std::move(d);
    }
  }
  const std::pair<const char*, Kept> kinds[] = {
      {"a", Kept::total_inertia}, {"b", Kept::motor_inertia}, {"c", Kept::both_inertias}};
  for (const auto& [letter, kept] : kinds) {
    try {
      best.alternatives[letter] =
          split_stiffness(kept, best.resonances, best.plateaus.total, best.plateaus.motor);
    } catch (
        const CannotIdentify&) {  // frequencies and inertias that contradict each other: the fit tells more
    }
  }
  return best;
}

ProcedureReport response(IdentificationCase& c) {
  ProcedureReport report{"frequency_response", {}, ""};
  std::optional<ResponseDetail> best;
  const auto used = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    ResponseDetail d = respond(r.record);
    const auto share = [](const ResponseDetail& x) {
      return double(reversing(x.response)) / x.response.points.size();
    };
    if (best && share(*best) <= share(d)) throw CannotIdentify("another record reverses less");
    best = std::move(d);
    report.records = {r.record.name};
  });
  const TwoMassFit& fit = best->fit;
  report.message = "resonance " + plus_minus(best->resonances.resonance, "Hz") + ", anti-resonance " +
                   plus_minus(best->resonances.anti_resonance, "Hz") + ", stiffness " +
                   plus_minus(fit.stiffness, "N m/rad");
  if (2 * reversing(best->response) < best->response.points.size()) {
    add(c, report.name, {{"motor_inertia", 1}}, with_model_error(fit.motor_inertia, kResponseModel));
    add(c, report.name, {{"load_inertia", 1}}, with_model_error(fit.load_inertia, kResponseModel));
    add(c, report.name, {{"mesh_stiffness", 1}}, with_model_error(fit.stiffness, kResponseModel));
    add(c, report.name, {{"mesh_damping", 1}}, with_model_error(fit.damping, 5 * kResponseModel));
  } else {
    report.message += "; the speed reverses, so play and Coulomb friction are in it: not used further";
    c.result.warnings.push_back(
        "frequency_response: the speed reverses in the record; a bias torque would keep the "
        "teeth in contact");
  }
  c.result.response = std::move(*best);
  return report;
}

/// Torque that jumps by half of its range several times.
bool is_square(const Record& record) {
  const std::vector<double>& torque = record.column(Channel::motor_torque);
  const auto [low, high] = std::minmax_element(torque.begin(), torque.end());
  int jumps = 0;
  for (std::size_t k = 1; k < torque.size(); ++k)
    jumps += std::fabs(torque[k] - torque[k - 1]) > 0.5 * (*high - *low);
  return jumps >= 3;
}

ProcedureReport decay(IdentificationCase& c) {
  ProcedureReport report{"decay", {}, ""};
  const Rig& rig = c.result.rig;
  const double motor = rig.motor.inertia, load = rig.link.inertia;
  DecaySettings settings;
  settings.stiffness = known(c, "mesh_stiffness");
  const double reduced = motor * load / (motor + load);
  settings.reduced_inertia = {
      reduced, reduced * std::hypot(load / (motor + load) * relative(known(c, "motor_inertia")),
                                    motor / (motor + load) * relative(known(c, "load_inertia")))};
  settings.bearing_damping =
      reduced * reduced *
      (rig.motor.viscous_damping / (motor * motor) + rig.link.viscous_damping / (load * load));
  std::vector<DecayIdentification> all;
  report.records = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    if (!is_square(r.record)) throw CannotIdentify("no square wave of torque");
    all.push_back(identify_decay(r.record, settings));
  });
  for (const DecayIdentification& d : all)
    add(c, report.name, {{"mesh_damping", 1}}, with_model_error(d.damping, kDecayModel));
  report.message = "damping " + plus_minus(all.front().damping, "N m s/rad") + " from " +
                   std::to_string(all.front().ringings.size()) + " engagements";
  c.result.decay = std::move(all.front());
  return report;
}

ProcedureReport clearance(IdentificationCase& c) {
  ProcedureReport report{"clearance", {}, ""};
  ClearanceSettings settings;
  settings.stiffness = servo_parameter("mesh_stiffness").get(c.result.rig);
  settings.load_inertia = c.result.rig.link.inertia;
  std::string reasons;
  for (const CaseRecord& r : c.records) {
    if (r.motor_moves || !r.load_moves) continue;
    try {
      const Clearance found = identify_clearance(r.record, settings);
      add(c, report.name, {{"backlash_angle", 1}}, with_model_error(found.gap, kClearanceModel));
      report.records.push_back(r.record.name);
      report.message =
          plus_minus(found.gap, "rad") + " from " + std::to_string(found.passages.size()) + " passages";
      c.result.clearance = found;
    } catch (const CannotIdentify& error) {
      reasons += std::string(reasons.empty() ? "" : "; ") + error.what();
    }
  }
  if (report.records.empty())
    throw CannotIdentify(reasons.empty() ? "no record with the motor braked" : reasons);
  return report;
}

/// Friction of the load at a speed, from what is known by now [N m].
Measured load_friction_at(const IdentificationCase& c, double speed) {
  const Body& link = c.result.rig.link;
  const double sign = speed > 0 ? 1 : -1;
  const double value = link.coulomb_friction + sign * link.coulomb_asymmetry +
                       (link.viscous_damping + sign * link.viscous_asymmetry) * std::fabs(speed);
  return {value, c.result.parameters.count("load_coulomb") ? known(c, "load_coulomb").standard_error
                                                           : kDeclared * value};
}

ProcedureReport gap_map(IdentificationCase& c) {
  ProcedureReport report{"gap_map", {}, ""};
  struct OneWay {
    const CaseRecord* record;
    double speed;  // rad/s, mean
  };
  std::vector<OneWay> runs;
  for (const CaseRecord& r : c.records) {
    if (!r.drive() || !r.has_load) continue;
    const auto& q = r.record.column(Channel::load_position);
    const auto [low, high] = std::minmax_element(q.begin(), q.end());
    const double travel = q.back() - q.front();
    if (std::fabs(travel) < 0.95 * (*high - *low)) continue;
    runs.push_back({&r, travel / (r.record.time.back() - r.record.time.front())});
  }
  std::string reasons;
  for (const OneWay& a : runs)
    for (const OneWay& b : runs) {
      if (!(a.speed > 0 && b.speed < 0)) continue;
      GapMapSettings settings;
      settings.stiffness = known(c, "mesh_stiffness");
      settings.friction_forward = load_friction_at(c, a.speed);
      settings.friction_reverse = load_friction_at(c, b.speed);
      try {
        GapMap map = identify_gap_map(a.record->record, b.record->record, settings);
        if (c.result.gap_map && c.result.gap_map->mean_gap.standard_error <= map.mean_gap.standard_error)
          continue;  // the pair that tells more
        c.result.gap_map = std::move(map);
        report.records = {a.record->record.name, b.record->record.name};
      } catch (const CannotIdentify& error) {
        reasons += std::string(reasons.empty() ? "" : "; ") + error.what();
      }
    }
  if (!c.result.gap_map)
    throw CannotIdentify(reasons.empty() ? "no two runs one way each in opposite directions" : reasons);
  const GapMap& map = *c.result.gap_map;
  add(c, report.name, {{"backlash_angle", 1}}, map.mean_gap);
  report.message = "mean gap " + plus_minus(map.mean_gap, "rad") + "; " + map.statement;
  if (map.varies) {  // the clearance is then that of one place
    auto& all = c.result.findings;
    all.erase(
        std::remove_if(all.begin(), all.end(), [](const Finding& f) { return f.procedure == "clearance"; }),
        all.end());
    c.result.warnings.push_back("backlash depends on the position of the load: " + map.statement);
  }
  return report;
}

}  // namespace

const std::vector<Procedure>& servo_procedures() {
  static const std::vector<Procedure> procedures = {{"sensor_calibration", calibrate},
                                                    {"friction_lines", friction},
                                                    {"line_inertia", inertia},
                                                    {"frequency_response", response},
                                                    {"decay", decay},
                                                    {"clearance", clearance},
                                                    {"gap_map", gap_map},
                                                    {"output_error", run_output_error}};
  return procedures;
}

void update_from_findings(IdentificationCase& c) {
  c.result.parameters = combine_findings(c.result.findings, c.declared, c.names);
  c.result.rig = c.declared;
  for (const auto& [name, m] : c.result.parameters) {
    const RigParameter& parameter = servo_parameter(name);
    if (!parameter.positive || m.value > 0) parameter.set(c.result.rig, m.value);
  }
}

}  // namespace backlash
