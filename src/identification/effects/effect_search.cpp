// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/effects/effect_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/record/shared_samples.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "contradicting_records.h"
#include "effect_roles.h"
#include "found_effects.h"
#include "impossible_friction.h"
#include "search.h"
#include "signature.h"
#include "steps.h"
#include "traced_records.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr double kMostShared = 0.1;  // choice: of the test record, in a training record
constexpr double kMostNoise = 0.5;   // choice: of the deviation of the torque of the test record

std::string described(const FoundEffect& effect, const model::Rig& rig) {
  std::string text = effect.id;
  for (const EffectParameter& p : effect.parameters)
    text += fmt::format(", {} {:.3g} +- {:.2g} {}", p.name, p.measured.value, p.measured.standard_error,
                        model::axis_unit(p.unit, rig.linear));
  return text;
}

/// Is in the model, and not called missing.
void note_instead(std::vector<FoundEffect>::iterator at, const std::string& note, const std::string& reason,
                  Trace& trace) {
  trace.notes.push_back(note);
  trace.rejected.push_back({at->id, reason + ", see the notes"});
  trace.steps.erase(at);
}

/// Every friction builds up over some path; it is called missing only where that shows.
void note_shape_of_friction(const Hypothesis& h, double least, Trace& trace) {
  const auto at = std::find_if(trace.steps.begin(), trace.steps.end(),
                               [](const FoundEffect& e) { return shapes_friction(e.id); });
  if (at == trace.steps.end()) return;
  const double share = share_of_signal(h, at->id);
  if (share >= least) return;
  note_instead(at,
               fmt::format("friction builds up after each reversal ({}): {:.2g} % of the {}, so it is in the "
                           "model but not called missing",
                           described(*at, trace.augmented), 100 * share, at->channel),
               "too small to be called missing", trace);
}

/// What every machine has some of is in the model, and called missing only where it is more than usual.
void note_usual_effects(const Hypothesis& h, Trace& trace) {
  for (const Effect& effect : h.effects) {
    const auto at = std::find_if(trace.steps.begin(), trace.steps.end(),
                                 [&](const FoundEffect& e) { return e.id == effect.candidate.id; });
    if (at == trace.steps.end() || !is_usual(effect.candidate, h)) continue;
    note_instead(at,
                 described(*at, trace.augmented) +
                     ": in the model but not called missing, as every machine has as much",
                 "no more than every machine has", trace);
  }
}

struct Records {
  std::vector<std::string> names;  // of the training records, then of the test record
  std::vector<ServoData> train;
  ServoData test;
};

/// Errors on what the fit has seen confirm nothing.
void require_unseen(const std::vector<record::Record>& train, const record::Record& test) {
  for (const record::Record& known : train)
    if (const double shared = record::shared_samples(test, known); shared > kMostShared)
      throw CannotIdentify(fmt::format(
          "{:.0f} % of the test record {} are samples of the training record {}, so that errors on it would "
          "confirm nothing: give records that share none, such as the two halves of one (convert_record "
          "--from, --to)",
          100 * shared, test.name, known.name));
}

Records records_of(const model::Rig& rig, const std::vector<record::Record>& train,
                   const record::Record& test) {
  if (train.empty()) throw CannotIdentify("no training record");
  require_unseen(train, test);
  Records records;
  const double interval = common_interval(train, test);
  for (const record::Record& record : train) {
    records.names.push_back(record.name);
    records.train.push_back(traced_data(record, rig, 0, interval));
  }
  records.names.push_back(test.name);
  double torque = 0;  // what the model says of the test record knows nothing of that record's torque
  for (const ServoData& data : records.train) torque = std::max(torque, model::usual_torque(data.torque));
  records.test = traced_data(test, rig, torque, interval);
  return records;
}

/// Parameters of the machine without and with effects, and the steps.
void describe_machine(const SearchResult& result, const std::vector<ServoPrediction>& on_test,
                      const SearchSettings& settings, Trace& trace) {
  const Hypothesis& found = result.found;
  trace.base = result.declared.base->fit.machine.rig;
  trace.augmented = found.fitted->fit.machine.rig;
  trace.base_parameters =
      fitted_values(*result.declared.base, result.declared.declared->parameters.size()).machine;
  FittedValues values = fitted_values(*found.fitted, found.declared->parameters.size());
  allow_for_valley(values, *found.fitted, settings.fit);
  trace.parameters = values.machine;
  for (const auto& [name, value] : found.held) trace.parameters[name] = {value, std::nan("")};
  for (const Hypothesis* h : {&result.declared, &found})
    for (const FitParameter& p : h->base->start.parameters) trace.units[p.name] = p.unit;
  trace.steps = found_effects(found, values.effects, on_test, settings.belief);
  trace.rejected = rejected_effects(found);
}

/// The torque of a machine that is coupled to other axes is not known.
void forget_torque(Trace& trace) {
  const double unknown = std::nan("");
  trace.channels.at("torque") = {unknown, unknown, unknown, unknown, unknown, {}, false};
  auto& all = trace.independence;
  all.erase(
      std::remove_if(all.begin(), all.end(), [](const Independence& i) { return i.channel == "torque"; }),
      all.end());
  trace.notes.emplace_back(
      "other axes move (gear_train.coupled): nothing can be said of the torque, which holds their coupling, "
      "and no "
      "effect is sought. The deflection is predicted from the torque that goes through the teeth, and shows "
      "the "
      "skew of the encoders");
}

/// Errors of both channels before and after, and the test record as both models have it.
void describe_errors(const SearchResult& result, const std::vector<ServoPrediction>& on_test,
                     const Records& records, const FitSettings& fit, Trace& trace) {
  const Machine &base = result.declared.base->fit.machine, &last = result.found.fitted->fit.machine;
  const ServoPrediction before = result.found.other_teeth || result.found.behind_shaft
                                     ? predicted(base, records.test, fit)
                                     : on_test.front();
  const ServoPrediction& after = on_test.back();
  const auto channel = [&](const std::string& name, ChannelError ServoPrediction::*of, double sensors,
                           double repeats) {
    const double sensor_floor = (after.*of).floor;
    trace.channels[name] = {(before.*of).error,
                            (after.*of).error,
                            sensors > 0 ? sensor_floor * std::max(1.0, repeats / sensors) : sensor_floor,
                            train_error(base, records.train, fit, of),
                            train_error(last, records.train, fit, of),
                            {},
                            repeats > 0};
  };
  const Predicted unseen{&records.test, after};
  channel("torque", &ServoPrediction::torque_error, after.torque_floor, repeated_noise(unseen, false));
  if (!after.deflection.empty())
    channel("deflection", &ServoPrediction::deflection_error, after.deflection_floor,
            repeated_noise(unseen, true));
  trace.series = trace_series(records.test, before, after);
  trace.independence = independence(trace.series, records.test, trace.cutoff);
  if (last.rig.coupled) forget_torque(trace);
}

/// What the effects of a channel took away, as a share of its signal; 0 where it has none.
double explained(const std::string& channel, const Trace& trace) {
  const bool any = std::any_of(trace.steps.begin(), trace.steps.end(),
                               [&](const FoundEffect& step) { return step.channel == channel; });
  const TraceChannel& c = trace.channels.at(channel);
  return any ? std::sqrt(std::max(0.0, c.before * c.before - c.after * c.after)) : 0;
}

/// What is left of each channel, of the training records and of the unseen one.
std::vector<ChannelRemainder> remainders(const SearchResult& result, const ServoPrediction& on_test,
                                         const Records& records, const SearchSettings& settings,
                                         const Trace& trace) {
  const Machine& last = result.found.fitted->fit.machine;
  std::vector<Predicted> train;
  for (std::size_t i = 0; i < records.train.size(); ++i)
    train.push_back(
        {&records.train[i], predict_servo(last.rig, records.train[i], settings.fit, last.calibrations[i])});
  const std::vector<Predicted> test = {{&records.test, on_test}};
  std::vector<ChannelRemainder> all;
  for (const bool deflection : {false, true}) {
    if (deflection ? on_test.deflection.empty() : last.rig.coupled) continue;
    const std::string channel = deflection ? "deflection" : "torque";
    all.push_back({channel, "", remainder(train, deflection, settings.fit.cutoff, settings.explainable)});
    all.push_back({channel, " on the unseen record",
                   remainder(test, deflection, settings.fit.cutoff, settings.explainable)});
    for (auto c = all.end() - 2; c != all.end(); ++c)
      c->left.explained = explained(channel, trace) * c->left.signal;
  }
  return all;
}

/// Whether what is left is noise, and a machine that nothing is said to lack a possible one.
void judge_remainder(const std::vector<ChannelRemainder>& all, const Hypothesis& found, const ServoData& test,
                     const SearchSettings& search, Trace& trace) {
  const ExplainableSettings& settings = search.explainable;
  std::map<std::string, double> most;
  for (const ChannelRemainder& c : all) {
    const auto [at, first] = most.emplace(c.channel, 0.0);
    const double part = explainable_part(c.left);
    if (!first && part <= at->second) continue;
    at->second = part;
    trace.channels.at(c.channel).explainable = {c.left.explainable.value, c.left.explainable.lower,
                                                c.left.explainable.upper};
  }
  trace.unexplained = signature(all, trace.augmented.linear, settings);
  const bool as_declared =
      found.effects.empty() && !found.other_teeth && !found.behind_shaft && !trace.augmented.coupled;
  if (!trace.unexplained && as_declared)
    trace.unexplained =
        impossible_friction(trace.base_parameters, trace.units, motion_size(test), search.belief, settings);
  if (!trace.unexplained)
    for (std::string& note : noise_notes(all, settings)) trace.notes.push_back(std::move(note));
  // A map that leaves something is the shape of what is missing, and not what it is.
  const bool named = std::any_of(trace.steps.begin(), trace.steps.end(),
                                 [](const FoundEffect& step) { return !is_learned(step.id); });
  if (named || (!trace.steps.empty() && !trace.unexplained))
    trace.verdict = TraceVerdict::effect_found;
  else if (trace.unexplained)
    trace.verdict = TraceVerdict::unexplained;
}

/// Where the records serve, and yet do not show what the machine does.
Trace cannot_tell(const model::Rig& declared, const TraceSettings& asked, const std::string& reason) {
  const double unknown = std::nan("");
  const TraceChannel none = {unknown, unknown, unknown, unknown, unknown, {unknown, unknown, unknown}};
  Trace trace;
  trace.verdict = TraceVerdict::unexplained;
  trace.determined = false;
  trace.cutoff = asked.cutoff > 0 ? asked.cutoff : unknown;
  trace.base = trace.augmented = declared;
  trace.channels["torque"] = none;
  if (simulation::load_moves_freely(declared)) trace.channels["deflection"] = none;
  trace.unexplained = {"torque", reason, none.explainable};
  return trace;
}

/// A machine of which a record shows little but noise lacks nothing that it shows.
bool shows_nothing(const Trace& trace) {
  return trace.verdict == TraceVerdict::nothing_missing && trace.channels.at("torque").floor > kMostNoise;
}

/// Times the noise, of the training records and of the unseen one, the channel of which more is left.
double most_left(const Trace& trace, const Hypothesis& found) {
  double most = std::max(misfit(found).torque, misfit(found).deflection);
  for (const auto& [name, c] : trace.channels) most = std::max(most, c.after / c.floor);
  return most;
}

/// Why something is unexplained, where the records contradict each other.
std::optional<SeveralMachines> several_of(const model::Rig& declared, const Records& records,
                                          const SearchSettings& settings, double left,
                                          const Progress& progress) {
  const auto report = [&](const std::string&) {
    if (progress && !progress(1, "fit of each record by itself")) throw Cancelled();
  };
  return contradicting_records(
      declared, records.names, records.test, left,
      {records.train, records.test, motion_range(records.train), settings, report, [](const auto&) {}});
}

}  // namespace

Trace trace_residual(const model::Rig& raw, const std::vector<record::Record>& train,
                     const record::Record& test, const TraceSettings& asked, const Progress& progress) {
  const model::Rig declared = model::load_side(raw);
  const Records records = records_of(raw, train, test);
  SearchSettings settings(asked);
  SearchResult result;
  try {
    settings.fit = with_bands(settings.fit, declared, records.train);
    result = search_effects(declared, records.train, records.test, settings, progress);
  } catch (const CannotIdentify& error) {
    return cannot_tell(
        declared, asked,
        std::string("the declared machine cannot be fitted to the training records: ") + error.what());
  }
  const Hypothesis& found = result.found;
  Trace trace;
  trace.cutoff = settings.fit.cutoff;
  const std::vector<ServoPrediction> on_test = predicted_by_all(found, records.test, settings.fit);
  describe_machine(result, on_test, settings, trace);
  describe_errors(result, on_test, records, settings.fit, trace);
  if (found.other_teeth)
    trace.notes.push_back(
        fmt::format("the teeth are Hertzian (contact law {}), not linear as declared: they are in the model, "
                    "but nothing is called missing for it",
                    trace.augmented.mesh.contact_spec().law));
  if (found.behind_shaft)
    trace.notes.push_back(
        fmt::format("the load turns behind a shaft of {:.3g} N m/rad, before which its bearing rubs and its "
                    "encoder reads: it is in the model, but nothing is called missing for it",
                    trace.augmented.output_coupling.stiffness));
  note_shape_of_friction(
      found,
      simulation::load_moves_freely(declared) ? settings.shape_of_friction : settings.shape_of_all_torque,
      trace);
  note_usual_effects(found, trace);
  judge_remainder(remainders(result, on_test.back(), records, settings, trace), found, records.test, settings,
                  trace);
  if (shows_nothing(trace))
    return cannot_tell(
        declared, asked,
        fmt::format("{:.0f} % of how the {} of the test record varies is noise",
                    100 * trace.channels.at("torque").floor, declared.linear ? "force" : "torque"));
  if (trace.unexplained)
    trace.several = several_of(declared, records, settings, most_left(trace, found), progress);
  trace.warnings = range_warnings(records.train, records.test, declared.linear);
  return trace;
}

}  // namespace backlash::identification
