// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/effects/effect_search.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "independence.h"
#include "learned.h"
#include "search.h"
#include "signature.h"

namespace backlash {
namespace {

constexpr double kTwoInertiaCutoff = 60;   // Hz
constexpr double kHighestCutoff = 0.2;     // of the sampling rate
constexpr double kPeriods = 100;           // in the record: friction has more to say than a slow motion
constexpr double kLeastLoadTravel = 0.01;  // of the motor's: less, and the link does not move freely
constexpr double kSureSpeed = 5;           // standard deviations of the motor speed's noise
constexpr double kLeastMoving = 0.05;      // of the samples
constexpr int kLags = 25;                  // to either side, of the test for independence
constexpr double kUnexplained = 2;         // times the floor, beyond which something is left
constexpr double kShapeOfFriction = 0.01;  // of the signal: less is how friction begins, not an effect
constexpr double kWorse = 1.05;            // times the error on the test record: an effect that does harm
constexpr double kCalibrationCutoff = 15;  // Hz, of the first round of a calibration

double default_cutoff(const Rig& rig, const std::vector<ServoData>& data) {
  const double highest = kHighestCutoff / data.front().interval;
  if (load_moves_freely(rig)) return std::min(kTwoInertiaCutoff, highest);
  double widest = 0;
  for (const ServoData& d : data)
    widest =
        std::max({widest, motion_bandwidth(d.motor, d.interval), kPeriods / (double(d.size()) * d.interval)});
  return std::min(widest, highest);
}

double travel(const std::vector<double>& position) {
  const auto [low, high] = std::minmax_element(position.begin(), position.end());
  return *high - *low;
}

ServoData data_of(const Record& record, const Rig& rig) {
  ServoData data = servo_data(record, rig);
  if (load_moves_freely(rig)) {
    if (data.load.empty())
      throw CannotIdentify(record.name + " has no load_position, which a rig with two inertias needs");
    if (travel(data.load) < kLeastLoadTravel * travel(data.motor))
      throw CannotIdentify(record.name +
                           ": the load stands still while the motor moves; the rig file has a link that " +
                           "moves freely (a gearbox with locked output: link: locked)");
  }
  const double sure = kSureSpeed * data.rate_noise;
  const auto moving = std::count_if(data.motor_rate.begin(), data.motor_rate.end(),
                                    [&](double rate) { return std::fabs(rate) > sure; });
  if (double(moving) < kLeastMoving * double(data.size()))
    throw CannotIdentify(record.name +
                         " moves too slowly: its speed stands out of the noise of the encoder in " +
                         std::to_string(100 * moving / long(data.size())) + " % of the samples");
  return data;
}

/// What a machine says of a record that it was not fitted to, with the record's own calibration.
ServoPrediction predicted(Machine machine, const ServoData& record, double cutoff) {
  const std::vector<ServoData> data = {record};
  const Calibration like = machine.calibrations.front();
  machine.parameters.clear();
  machine.calibrations = {like};
  NonlinearOptions options;
  options.parallel = true;
  for (const double band : {std::min(kCalibrationCutoff, cutoff), cutoff}) {
    if (Unknowns(machine).size() == 0) break;
    RecordSet records(data, band, kLoadFeedback);
    records.weigh(machine);
    machine = fit_machine(machine, records, options).machine;
  }
  OutputErrorSettings settings;
  settings.cutoff = cutoff;
  return predict_servo(machine.rig, record, settings, machine.calibrations.front());
}

/// All training records together, as fitted.
ChannelError train_error(const Machine& machine, const std::vector<ServoData>& data, double cutoff,
                         ChannelError ServoPrediction::*channel) {
  double error = 0;
  OutputErrorSettings settings;
  settings.cutoff = cutoff;
  for (std::size_t i = 0; i < data.size(); ++i)
    error +=
        std::pow((predict_servo(machine.rig, data[i], settings, machine.calibrations[i]).*channel).error, 2);
  return {std::sqrt(error / double(data.size())), 0};
}

struct Numbers {
  std::map<std::string, Measured> machine;
  std::vector<Measured> effects;  // in the order of the effects' fitted parameters
};

/// Values with standard errors of a stage of which the first `declared` parameters are the machine's.
Numbers numbers(const Stage& stage, std::size_t declared) {
  MachineFit fit = stage.fit;
  judge_errors(fit, stage.start, stage.records);
  const Unknowns unknowns(stage.start);
  Numbers out;
  for (std::size_t i = 0; i < stage.start.parameters.size(); ++i) {
    const Measured m = unknowns.parameter(fit.fit, i);
    if (i < declared)
      out.machine[stage.start.parameters[i].name] = m;
    else
      out.effects.push_back(m);
  }
  return out;
}

/// Of a learned map: where its coordinate reaches and how large it gets.
void describe_map(const Term& term, std::vector<Measured>& fitted, FoundEffect& effect) {
  const TermMap& map = *term_type(term.id).map;
  const MapKind& kind = kind_of(term.values);
  effect.words = {{map.acts_on, kind.acts_on}, {map.coordinate, kind.coordinate}};
  effect.curve_x = term.values.list(map.points);
  effect.curve_y = term.values.list(map.values);
  const std::string &x = kind.coordinate, &unit = kind.coordinate_unit;
  const auto largest = std::max_element(effect.curve_y.begin(), effect.curve_y.end(),
                                        [](double a, double b) { return std::fabs(a) < std::fabs(b); });
  const Measured at_largest{*largest, fitted[std::size_t(largest - effect.curve_y.begin())].standard_error};
  effect.parameters = {{x + "_from", unit, {effect.curve_x.front(), 0}},
                       {x + "_to", unit, {effect.curve_x.back(), 0}},
                       {"largest", kind.unit, at_largest}};
  fitted.erase(fitted.begin(), fitted.begin() + long(effect.curve_y.size()));
}

/// Parameters and words of an effect's term; what was not fitted but chosen among values has the error 0.
void describe(const Term& term, const std::string& suffix, std::vector<Measured>& fitted,
              FoundEffect& effect) {
  const TermType& type = term_type(term.id);
  if (type.map) return describe_map(term, fitted, effect);
  const TermSearch& search = *type.search;
  std::map<std::string, Measured> found;
  const auto take = [&](const std::string& name) {
    found[name] = fitted.front();
    fitted.erase(fitted.begin());
  };
  take(search.strength);
  if (!search.phase.empty()) take(search.phase);
  for (const TermShape& shape : search.shapes)
    if (shape.refined) take(shape.name);
  for (const ParameterSpec& spec : type.parameters) {
    if (!spec.choices.empty()) {
      effect.words[spec.name + suffix] = term.values.choice(spec.name);
      continue;
    }
    const auto at = found.find(spec.name);
    const Measured m = at != found.end() ? at->second : Measured{term.values.at(spec.name), 0};
    effect.parameters.push_back({spec.name + suffix, spec.unit, m});
  }
}

/// One step per effect; a second term of the same kind belongs to the step of the first.
std::vector<FoundEffect> found_effects(const Search& search, std::vector<Measured> fitted,
                                       const std::vector<ServoPrediction>& on_test,
                                       std::size_t declared_terms) {
  std::vector<FoundEffect> all;
  const auto error = [](const ServoPrediction& p, const std::string& channel) {
    return channel == "torque" ? p.torque_error.error : p.deflection_error.error;
  };
  std::size_t place = declared_terms;
  for (std::size_t i = 0; i < search.effects().size(); ++i) {
    const Accepted& accepted = search.effects()[i];
    auto step = std::find_if(all.begin(), all.end(),
                             [&](const FoundEffect& e) { return e.id == accepted.candidate.id; });
    if (step == all.end()) {
      FoundEffect e;
      e.id = accepted.candidate.id;
      e.channel = accepted.gain.deflection ? "deflection" : "torque";
      e.evidence = accepted.gain.evidence;
      e.equivalent_to = accepted.equivalent_to;
      e.nearest = accepted.nearest;
      e.test_error_before = error(on_test[i], e.channel);
      step = all.insert(all.end(), e);
    }
    step->test_error_after = error(on_test[i + 1], step->channel);
    for (std::size_t t = 0; t < accepted.candidate.terms.size(); ++t, ++place) {
      step->terms.push_back(place);
      const std::size_t number = step->terms.size();
      describe(*search.stage().fit.machine.rig.terms[place], number > 1 ? "_" + std::to_string(number) : "",
               fitted, *step);
    }
  }
  return all;
}

/// Every friction builds up over some path; it is called missing only where that shows.
void note_shape_of_friction(const Search& search, Trace& trace) {
  const auto is_shape = [](const FoundEffect& e) { return term_type(e.id).shapes_friction; };
  const auto at = std::find_if(trace.steps.begin(), trace.steps.end(), is_shape);
  if (at == trace.steps.end()) return;
  const double share = search.share(at->id);
  if (share >= kShapeOfFriction) return;
  std::string note = "friction builds up after each reversal (" + at->id;
  for (const EffectParameter& p : at->parameters) {
    char text[96];
    std::snprintf(text, sizeof text, ", %s %.3g +- %.2g %s", p.name.c_str(), p.measured.value,
                  p.measured.standard_error, axis_unit(p.unit, trace.augmented.linear).c_str());
    note += text;
  }
  char text[96];
  std::snprintf(text, sizeof text, "): %.2g %% of the %s, so it is in the model but not called missing",
                100 * share, at->channel.c_str());
  trace.notes.push_back(note + text);
  trace.steps.erase(at);
}

/// The test record as the machine before any effect and each stage have it.
std::vector<ServoPrediction> stages_on(const ServoData& unseen, const Search& search, double cutoff) {
  std::vector<ServoPrediction> all = {predicted(search.start().fit.machine, unseen, cutoff)};
  for (const Accepted& effect : search.effects()) all.push_back(predicted(effect.after, unseen, cutoff));
  return all;
}

/// Effects are chosen by the training records alone; the test record only judges them.
void warn_of_harm(const std::vector<FoundEffect>& steps, std::vector<std::string>& warnings) {
  for (const FoundEffect& e : steps) {
    if (e.test_error_after <= kWorse * e.test_error_before) continue;
    char text[160];
    std::snprintf(text, sizeof text,
                  "%s makes the test record worse (%s %.3g -> %.3g %%): not to be believed", e.id.c_str(),
                  e.channel.c_str(), 100 * e.test_error_before, 100 * e.test_error_after);
    warnings.push_back(text);
  }
}

TraceSeries series(const ServoData& data, const ServoPrediction& before, const ServoPrediction& after) {
  TraceSeries s;
  for (std::size_t k = 0; k < data.size(); ++k) s.time.push_back(double(k) * data.interval);
  s.motor_position = data.motor;
  s.motor_velocity = data.motor_rate;
  s.motor_torque = data.torque;
  s.load_position = after.load.load;
  s.load_velocity = after.load.load_rate;
  s.mesh_torque = after.load.mesh_torque;
  s.torque_counts = after.counts;
  s.deflection_counts = after.settled;
  s.torque = after.measured_torque;
  s.torque_before = before.torque;
  s.torque_after = after.torque;
  s.deflection = after.measured_deflection;
  s.deflection_before = before.deflection;
  s.deflection_after = after.deflection;
  return s;
}

/// Every so many samples: as many as the low-passed residual has independent values.
std::vector<Independence> independence(const TraceSeries& s, const ServoData& data, double cutoff) {
  const auto stride = std::size_t(std::max(1L, std::lround(0.4 / (cutoff * data.interval))));
  const auto thinned = [&](const std::vector<double>& x) {
    std::vector<double> out;
    for (std::size_t k = 0; k < x.size(); k += stride) out.push_back(x[k]);
    return out;
  };
  const auto residual = [&](const std::vector<double>& y, const std::vector<double>& p,
                            const std::vector<char>& counts) {
    std::vector<double> r(y.size());
    for (std::size_t k = 0; k < y.size(); ++k) r[k] = counts[k] ? y[k] - p[k] : 0;
    return thinned(r);
  };
  std::vector<Independence> all;
  const std::pair<const char*, std::vector<double>> inputs[] = {{"motor_torque", thinned(s.torque)},
                                                                {"motor_velocity", thinned(data.motor_rate)}};
  for (const auto& [name, values] : inputs) {
    const std::vector<double>& input = values;  // a lambda of C++17 captures no name of a binding
    const auto share = [&](const std::vector<double>& r) { return share_outside_band(r, input, kLags); };
    all.push_back({"torque", name, share(residual(s.torque, s.torque_before, s.torque_counts)),
                   share(residual(s.torque, s.torque_after, s.torque_counts))});
    if (!s.deflection.empty())
      all.push_back({"deflection", name,
                     share(residual(s.deflection, s.deflection_before, s.deflection_counts)),
                     share(residual(s.deflection, s.deflection_after, s.deflection_counts))});
  }
  return all;
}

void require_same_rate(const std::vector<ServoData>& data, const ServoData& test) {
  for (const ServoData& d : data)
    if (std::fabs(d.interval / test.interval - 1) > 0.01)
      throw CannotIdentify("records sampled every " + std::to_string(d.interval) + " s and every " +
                           std::to_string(test.interval) + " s cannot be compared");
}

void warn_of_range(const std::vector<ServoData>& train, const ServoData& test, bool linear, Trace& trace) {
  const MotionRange known = motion_range(train), asked = motion_range({test});
  const double slack = 0.1 * (known.to - known.from);
  const std::string angle = axis_unit("rad", linear), speed = axis_unit("rad/s", linear),
                    torque = axis_unit("N m", linear);
  char text[256];
  if (asked.from < known.from - slack || asked.to > known.to + slack) {
    std::snprintf(text, sizeof text,
                  "the test record moves from %.3g to %.3g %s, the training records from %.3g to %.3g",
                  asked.from, asked.to, angle.c_str(), known.from, known.to);
    trace.warnings.push_back(text);
  }
  if (asked.speed > 1.5 * known.speed || asked.torque > 1.5 * known.torque) {
    std::snprintf(text, sizeof text,
                  "the test record is faster or stronger than the training records: "
                  "speed %.3g against %.3g %s, %s %.3g against %.3g %s (standard deviations)",
                  asked.speed, known.speed, speed.c_str(), linear ? "force" : "torque", asked.torque,
                  known.torque, torque.c_str());
    trace.warnings.push_back(text);
  }
}

}  // namespace

Trace trace_residual(const Rig& raw, const std::vector<Record>& train, const Record& test,
                     const TraceSettings& settings, const Progress& progress) {
  const Rig declared = load_side(raw);
  if (train.empty()) throw CannotIdentify("no training record");
  std::vector<ServoData> data;
  for (const Record& record : train) data.push_back(data_of(record, raw));
  const ServoData unseen = data_of(test, raw);
  require_same_rate(data, unseen);
  Trace trace;
  trace.cutoff = settings.cutoff > 0 ? settings.cutoff : default_cutoff(declared, data);
  Search search(declared, data, trace.cutoff, settings, progress);
  search.run();

  const std::vector<ServoPrediction> on_test = stages_on(unseen, search, trace.cutoff);
  const Machine &base = search.base().fit.machine, &last = search.stage().fit.machine;
  const ServoPrediction before =
      search.other_teeth() ? predicted(base, unseen, trace.cutoff) : on_test.front();
  const ServoPrediction& after = on_test.back();
  trace.base = base.rig;
  trace.augmented = last.rig;
  const auto channel = [&](const std::string& name, ChannelError ServoPrediction::*of) {
    trace.channels[name] = {(before.*of).error, (after.*of).error, (after.*of).floor,
                            train_error(base, data, trace.cutoff, of).error,
                            train_error(last, data, trace.cutoff, of).error};
  };
  channel("torque", &ServoPrediction::torque_error);
  if (!after.deflection.empty()) channel("deflection", &ServoPrediction::deflection_error);
  const std::size_t own = search.start().start.parameters.size();
  trace.base_parameters = numbers(search.base(), base.parameters.size()).machine;
  const Numbers found = numbers(search.stage(), own - search.held().size());
  trace.parameters = found.machine;
  for (const std::string& name : search.held()) trace.parameters[name] = {0, 0};
  for (const Machine* machine : {&base, &search.start().start})
    for (const FitParameter& p : machine->parameters) trace.units[p.name] = p.unit;
  trace.steps = found_effects(search, found.effects, on_test, declared.terms.size());
  if (search.other_teeth())
    trace.notes.push_back(
        "the teeth are Hertzian (force with the power 1.5 of the penetration), not linear as declared; " +
        std::string("so they are in the model, but nothing is called missing for it"));
  note_shape_of_friction(search, trace);
  trace.unexplained = signature(last, search.stage().records, kUnexplained);
  if (!trace.steps.empty())
    trace.verdict = TraceVerdict::effect_found;
  else if (trace.unexplained)
    trace.verdict = TraceVerdict::unexplained;
  trace.series = series(unseen, before, after);
  trace.independence = independence(trace.series, unseen, trace.cutoff);
  warn_of_range(data, unseen, declared.linear, trace);
  warn_of_harm(trace.steps, trace.warnings);
  return trace;
}

}  // namespace backlash
