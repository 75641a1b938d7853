// SPDX-License-Identifier: BSD-3-Clause
#include "search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/interruption.h"
#include "effect_roles.h"
#include "steps.h"

namespace backlash::identification {
namespace {

/// What is reported on the way: a share that never falls back when effects are taken out again, and the best
/// so far.
class SearchProgress {
 public:
  SearchProgress(const SearchSettings& settings, const Progress& progress)
      : most_(double(settings.asked.most_effects)),
        best_so_far_(settings.asked.best_so_far),
        progress_(progress) {}

  void phase(const std::string& phase) {
    phase_ = phase;
    if (!goes_on()) throw Cancelled();
  }
  bool goes_on() const { return !progress_ || progress_(done_, phase_); }

  void hypothesis(const Hypothesis& h) {
    done_ = std::max(done_, std::min(1.0, double(h.effects.size() + 1) / (most_ + 1)));
    if (!best_so_far_) return;
    std::string names;
    for (const Effect& effect : h.effects) names += (names.empty() ? "" : " + ") + effect.candidate.id;
    best_so_far_(fmt::format("{}: torque {:.3g}, deflection {:.3g} times the noise floor",
                             names.empty() ? "the declared machine" : names, misfit(h).torque,
                             misfit(h).deflection));
  }

 private:
  double most_, done_ = 0;
  BestSoFar best_so_far_;
  const Progress& progress_;
  std::string phase_;
};

/// Friction that comes out negative is held at zero, which fits all else anew: the unseen record is asked
/// again.
Hypothesis believe_physical(const Hypothesis& before, const ServoData& unseen, const SearchContext& context) {
  Hypothesis h = believe(before, unseen, context);
  for (;;) {
    const Hypothesis held = hold_friction(h, context);
    if (held.fitted == h.fitted) return h;
    h = believe(held, unseen, context);
  }
}

/// Together, and with friction held at zero, they may explain less than each did.
Hypothesis believe_all(const Hypothesis& before, const Hypothesis& declared, const ServoData& unseen,
                       const SearchContext& context) {
  const Hypothesis h = believe_physical(before, unseen, context),
                   together = believe_together(h, declared, unseen, context);
  return together.fitted == h.fitted ? h : believe_physical(together, unseen, context);
}

/// What two encoders show plainly, one effect after the other, as long as the unseen record bears all of them
/// out: one that is not there would spoil those before it. Adds why others were rejected.
std::optional<Hypothesis> plain_effects(Hypothesis& declared, const ServoData& unseen,
                                        const SearchContext& context) {
  std::optional<Hypothesis> found;
  for (Hypothesis h = declared; h.effects.size() < context.settings.asked.most_effects;) {
    const Hypothesis more = add_plain_effect(h, context);
    if (more.effects.size() == h.effects.size()) break;
    h = more;
    const Hypothesis believed = believe_all(h, declared, unseen, context);
    declared.rejected = believed.rejected;
    if (found && believed.effects.size() < h.effects.size()) return found;
    if (!believed.effects.empty()) found = believed;
  }
  return found;
}

/// Friction that is held at zero was negative because something else is missing, and would keep that from
/// being found.
Hypothesis with_free_friction(const Hypothesis& h, const Hypothesis& declared, const SearchContext& context) {
  if (h.held.empty() || !same_machine(h, declared)) return h;
  Hypothesis free = h;
  free.declared = declared.declared;
  free.held.clear();
  auto fitted = refitted(free, h.effects, context);
  return fitted ? *fitted : h;
}

/// Of the square that a channel has above its noise; what takes less may stand in for something else.
bool takes_half(const Misfit& before, const Misfit& after, double half) {
  const auto above = [](double misfit) { return std::max(0.0, misfit * misfit - 1); };
  return above(after.torque) < half * above(before.torque) ||
         above(after.deflection) < half * above(before.deflection);
}

/// Beside plain effects what no sum of torques shows: effects about a standstill, a delay, a gap that varies
/// slowly, and other teeth.
Hypothesis with_hidden_effects(const Hypothesis& plain, const Hypothesis& declared, const ServoData& unseen,
                               const SearchContext& context) {
  const Hypothesis more = add_effects_or_teeth(with_free_friction(plain, declared, context), context);
  if (more.effects.size() > plain.effects.size() || !same_machine(more, plain)) {
    Hypothesis believed = believe_all(more, declared, unseen, context);
    const bool teeth = believed.effects.size() == plain.effects.size() &&
                       size(believed) < context.settings.revision.clearly_less * size(plain);
    const bool effects = believed.effects.size() > plain.effects.size() &&
                         takes_half(misfit(plain), misfit(believed), context.settings.revision.half);
    if (teeth || effects) return believed;
  }
  Hypothesis h = plain;
  h.rejected = more.rejected;
  return h;
}

bool any_stands_in_for_teeth(const Hypothesis& h) {
  return std::any_of(h.effects.begin(), h.effects.end(),
                     [](const Effect& effect) { return stands_in_for_contact_law(effect.candidate.id); });
}

}  // namespace

SearchResult search_effects(const model::Rig& declared, const std::vector<ServoData>& data,
                            const ServoData& unseen, const SearchSettings& settings,
                            const Progress& progress) {
  SearchProgress reported(settings, progress);
  const Interruption interruption([&] { return reported.goes_on(); });  // fits of minutes end when asked to
  const SearchContext context{data,
                              unseen,
                              motion_range(data),
                              settings,
                              [&](const std::string& p) { reported.phase(p); },
                              [&](const Hypothesis& h) { reported.hypothesis(h); }};
  SearchResult result{fit_declared(declared, context), {}};
  if (declared.coupled) {
    result.found = believe_compliance(result.declared, unseen, context);
    return result;
  }
  Hypothesis machine = result.declared;
  auto plain = plain_effects(machine, unseen, context);
  while (!plain) {  // where teeth or shafts are not as declared, no effect is what it seems
    auto other = with_other_machine(machine, context);
    if (!other) break;
    machine = std::move(*other);
    plain = plain_effects(machine, unseen, context);
  }
  if (plain) {
    const auto other = any_stands_in_for_teeth(*plain) ? with_other_teeth(*plain, context) : std::nullopt;
    result.found = with_hidden_effects(
        other ? believe_all(*other, machine, unseen, context) : std::move(*plain), machine, unseen, context);
    return result;
  }
  Hypothesis h = add_effects_or_teeth(machine, context);
  h = take_simpler(h, context);
  h = add_learned(h, context);
  result.found = believe_all(h, machine, unseen, context);
  return result;
}

double share_of_signal(const Hypothesis& h, const std::string& id) {
  Machine without = h.fitted->fit.machine;
  auto& terms = without.rig.terms;
  terms.erase(std::remove_if(terms.begin() + long(h.declared->rig.terms.size()), terms.end(),
                             [&](const auto& term) { return term->id == id; }),
              terms.end());
  const Misfit &with = misfit(h), less = h.fitted->records.misfit(without);
  const auto change = [](double before, double after) {
    return std::sqrt(std::max(0.0, before * before - after * after));
  };
  return std::max(change(less.torque_share, with.torque_share),
                  change(less.deflection_share, with.deflection_share));
}

}  // namespace backlash::identification
