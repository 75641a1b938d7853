// SPDX-License-Identifier: BSD-3-Clause
// The unseen record decides what is believed: each effect, with those before it, must lower the error there,
// and its strength must stand out of its own error.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "effect_roles.h"
#include "found_effects.h"
#include "steps.h"
#include "strength_in_parts.h"
#include "unseen_gain.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

std::string interval(const TestGain& g) {
  return fmt::format("{:.2g} % (95 %: {:.2g} to {:.2g} %)", 100 * g.value, 100 * g.lower, 100 * g.upper);
}

/// Why the record does not bear out the effect that makes the difference of both; empty: it does. A map,
/// which can take any shape, has no credit with the other channel.
std::string contradicted(const ServoPrediction& before, const ServoPrediction& after, bool deflection,
                         bool map, const BeliefSettings& settings) {
  const char* const names[] = {"torque", "deflection"};
  const Left was = left(before, deflection, settings), is = left(after, deflection, settings);
  const TestGain gain = test_gain(was, is, settings);
  const char* const name = names[deflection];
  if (!(gain.lower > 0))
    return fmt::format(
        "on the unseen record it lessens the error of {} by {}: not distinguished from nothing", name,
        interval(gain));
  const double above = was.total() - was.noise, decrease = was.total() - is.total();
  if (decrease < (map ? settings.least_part_of_map : settings.least_part) * above)
    return fmt::format("on the unseen record it explains {:.2g} % of what {} has above the noise: too little",
                       100 * decrease / above, name);
  if (before.deflection.empty()) return "";
  const Left other_was = left(before, !deflection, settings), other_is = left(after, !deflection, settings);
  const TestGain other = test_gain(other_was, other_is, settings);
  const double price = (other_is.total() - other_was.total()) / other_was.noise;
  const bool dear = map || price > settings.price * decrease / was.noise;
  if (other.upper < 0 && other.value < -settings.worse && dear)
    return fmt::format("on the unseen record it makes the error of {} worse, by {}", names[!deflection],
                       interval({-other.value, -other.upper, -other.lower}));
  return "";
}

/// How far a delay is beyond what a held torque may be misjudged, and how well the records show that.
signal::Measured beyond_hold(const signal::Measured& delay, const SearchContext& context) {
  const double interval = context.data.front().interval, hold = kUnsureOfHold * interval;
  return {std::max(0.0, std::fabs(delay.value) - context.settings.fit.calibration_delay * interval),
          std::sqrt(std::max(0.0, delay.standard_error * delay.standard_error - hold * hold))};
}

/// The strengths of each effect's terms; none of a map.
std::vector<std::vector<signal::Measured>> strengths(const Hypothesis& h, const SearchContext& context) {
  const std::vector<signal::Measured> all = fitted_values(*h.fitted, h.declared->parameters.size()).effects;
  std::vector<std::vector<signal::Measured>> out;
  std::size_t at = 0;
  for (const Effect& effect : h.effects) {
    out.emplace_back();
    for (std::size_t t = 0; t < effect.candidate.terms.size(); ++t) {
      if (is_delay(effect.candidate.id))
        out.back().push_back(beyond_hold(all.at(at), context));
      else if (!model::term_type(effect.candidate.id).map)
        out.back().push_back(all.at(at));
      at += fitted_count(effect.candidate, t);
    }
  }
  return out;
}

/// Does not stand out of its error; an effect of several terms needs one that does.
bool is_vague(const std::vector<signal::Measured>& strengths, double least) {
  return !strengths.empty() && std::all_of(strengths.begin(), strengths.end(), [&](const auto& m) {
    return !(std::fabs(m.value) >= least * m.standard_error);
  });
}

/// Why the effect is not itself in some part of the motion; empty: it is.
std::string other_in_a_part(const StrengthInParts& parts, std::size_t effect) {
  const auto part = parts.differing(effect);
  if (!part) return "";
  return fmt::format("{} it has {:.2g} +- {:.1g} of its strength: it stands in for something else",
                     part->part, part->ratio, part->standard_error);
}

const std::string kRunsAway = "with it the simulated load does not follow the unseen record";

std::optional<ServoPrediction> followed(const Machine& machine, const ServoData& unseen,
                                        const SearchContext& context) {
  return attempted([&] { return predicted(machine, unseen, context.settings.fit); });
}

/// The first effect that is not to be believed, and why.
std::optional<std::pair<std::size_t, std::string>> unbelievable(const Hypothesis& h, const ServoData& unseen,
                                                                const SearchContext& context) {
  const BeliefSettings& settings = context.settings.belief;
  const auto belongs_to_machine = [&](std::size_t i) { return is_usual(h.effects[i].candidate, h); };
  const auto all = strengths(h, context);
  for (std::size_t i = 0; i < h.effects.size(); ++i)
    if (!belongs_to_machine(i) && is_vague(all[i], settings.least_z))
      return std::pair{i, fmt::format("its strength is less than {:.0f} standard errors", settings.least_z)};
  std::vector<ServoPrediction> on_unseen = {predicted(h.base->fit.machine, unseen, context.settings.fit)};
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    auto with = followed(*h.effects[i].after, unseen, context);
    if (!with) return std::pair{i, kRunsAway};
    on_unseen.push_back(std::move(*with));
  }
  const StrengthInParts parts(h, unseen, context);
  for (std::size_t i = 0; i < h.effects.size(); ++i)
    if (std::string why = other_in_a_part(parts, i); !belongs_to_machine(i) && !why.empty())
      return std::pair{i, std::move(why)};
  for (std::size_t i = 0; i < h.effects.size(); ++i) {
    const Effect& effect = h.effects[i];
    std::string why = contradicted(on_unseen[i], on_unseen[i + 1], effect.gain.deflection,
                                   is_learned(effect.candidate.id), settings);
    if (!belongs_to_machine(i) && !why.empty()) return std::pair{i, std::move(why)};
  }
  return std::nullopt;
}

}  // namespace

bool last_is_vague(const Hypothesis& h, const SearchContext& context) {
  return is_vague(strengths(h, context).back(), context.settings.belief.least_z);
}

std::string contradicted_by_unseen(const Hypothesis& h, const SearchContext& context) {
  const FitSettings& fit = context.settings.fit;
  const Effect& last = h.effects.back();
  if (is_usual(last.candidate, h)) return "";
  const Machine& before = h.effects.size() > 1 ? *h.effects.end()[-2].after : h.base->fit.machine;
  const auto with = followed(*last.after, context.unseen, context);
  if (!with) return kRunsAway;
  return contradicted(predicted(before, context.unseen, fit), *with, last.gain.deflection,
                      is_learned(last.candidate.id), context.settings.belief);
}

Hypothesis believe(const Hypothesis& before, const ServoData& unseen, const SearchContext& context) {
  Hypothesis h = before;
  while (!h.effects.empty()) {
    context.report("asking the unseen record");
    const auto wrong = unbelievable(h, unseen, context);
    if (!wrong) break;
    const std::string id = h.effects[wrong->first].candidate.id;
    h = with_rejected(without_effect(h, wrong->first, context), id, wrong->second);
  }
  return h;
}

}  // namespace backlash::identification
