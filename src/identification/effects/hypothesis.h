// SPDX-License-Identifier: BSD-3-Clause
// What the search compares: a fitted machine with some effects, the evidence for each of them, and the
// reasons why others were rejected. Steps of the search take a hypothesis and return another; copies are
// cheap.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../fit/multi_start.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "candidates.h"
#include "search_settings.h"
#include "validation.h"

namespace backlash::identification {

/// What was fitted of an effect, and what it explains.
struct Fitted {
  Candidate candidate;
  Gain gain;
};

/// An effect that is in the model.
struct Effect : Fitted {
  std::vector<Fitted> alternatives;      // other effects that reach most of its gain, as fitted
  std::vector<std::string> nearest;      // of a learned map: named effects that explain part of the same
  std::shared_ptr<const Machine> after;  // fitted with this effect and those before it
};

struct Hypothesis {
  std::shared_ptr<const Machine> declared;  // the machine without effects, where its fits start
  std::shared_ptr<const BandFit> base;      // that, fitted
  std::shared_ptr<const BandFit> fitted;    // with the effects; base if there are none
  std::vector<Effect> effects;
  bool other_teeth = false;              // not those that the rig file declares
  bool behind_shaft = false;             // the load, which the rig file declares on the gear
  std::map<std::string, double> held;    // parameters of the machine that are no longer fitted, and where
  std::vector<RejectedEffect> rejected;  // the latest last
};

/// What all steps read, and to whom they report: `data` are searched, `unseen` is only asked. `settings.fit`
/// has its bands.
struct SearchContext {
  const std::vector<ServoData>& data;
  const ServoData& unseen;
  model::MotionRange range;
  SearchSettings settings;
  std::function<void(const std::string& phase)> report;      // throws Cancelled
  std::function<void(const Hypothesis&)> report_hypothesis;  // one that was fitted
};

/// Whether teeth and shafts are of the same kind.
bool same_machine(const Hypothesis& a, const Hypothesis& b);
const Misfit& misfit(const Hypothesis& h);
/// Of the misfit, of both channels.
double size(const Hypothesis& h);
/// Whether the residuals of both channels are close to noise, so that no other set of effects needs to be
/// tried.
bool clearly_right(const Misfit& misfit, const SearchContext& context);
bool has_learned_map(const std::vector<Effect>& effects);

Hypothesis with_rejected(Hypothesis h, const std::string& effect, const std::string& reason);
/// All effects that were rejected and are not in it after all, each with the latest reason.
std::vector<RejectedEffect> rejected_effects(const Hypothesis& h);

/// Without the effect a value may have been fitted to about 0 (dry friction at or below it), where the model
/// hardly depends on it. With the effect its fit starts at the declared value again.
Machine with_vanished_again(Machine machine, const Machine& declared);

/// The machine with the terms of a candidate, whose values are fitted as well.
Machine extended(Machine machine, const Candidate& candidate, const SearchContext& context);
/// The machine with these effects alone, at the values that it has now: a start for a fit.
Machine start_with(const Hypothesis& h, const std::vector<Effect>& effects, const SearchContext& context);

/// A hypothesis to start a fit from, with this parameter of the machine at `value` and no longer fitted.
Hypothesis with_held(const Hypothesis& h, const FitParameter& parameter, double value);

/// How well a fit has to settle: roughly, to choose among several, or as what is kept.
enum class Settled { roughly, wholly };

/// The same machine with these effects instead, fitted at weights of its own. Nothing where that fails.
std::optional<Hypothesis> refitted(const Hypothesis& h, std::vector<Effect> effects,
                                   const SearchContext& context, Settled settled = Settled::wholly);

/// The result of a fit, or nothing where the model cannot be fitted or followed.
template <typename Fit>
auto attempted(const Fit& fit) -> std::optional<decltype(fit())> {
  try {
    return fit();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace backlash::identification
