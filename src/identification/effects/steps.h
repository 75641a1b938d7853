// SPDX-License-Identifier: BSD-3-Clause
// The steps of the search for missing effects, one file each: each takes a hypothesis and gives another, the
// same where it finds nothing better. A set of effects that is tried and not taken leaves its reason in
// `rejected`.
#pragma once

#include "hypothesis.h"

namespace backlash::identification {

/// The declared machine, fitted. Friction may come out below 0 here: the machine may lack an effect.
Hypothesis fit_declared(const model::Rig& declared, const SearchContext& context);
/// The parameters that the rig declares and such records identify.
std::vector<FitParameter> declared_parameters(const model::Rig& rig);

/// Whether every machine has as much of it (model/term.h).
bool is_usual(const Candidate& candidate, const Hypothesis& h);

/// One more named effect, that which two encoders show plainly to explain most; none of a machine with one.
Hypothesis add_plain_effect(const Hypothesis& h, const SearchContext& context);

/// One more named effect: the first of the best trials that convinces, that the machine can be fitted with
/// and that the unseen record bears out. Nothing is built upon one that believe() would take out again.
Hypothesis add_effect(const Hypothesis& h, const SearchContext& context);
/// Named effects until nothing helps.
Hypothesis add_effects(const Hypothesis& h, const SearchContext& context);
/// The same; where mesh hardening is found, and once more beside all effects, a shaft before
/// the load and other teeth are tried.
Hypothesis add_effects_or_teeth(const Hypothesis& h, const SearchContext& context);

/// Hertzian teeth before a spring instead of linear ones, and of mesh hardening, which they look like.
/// Nothing where they leave more than mesh hardening, or not clearly less where there is none.
std::optional<Hypothesis> with_other_teeth(const Hypothesis& h, const SearchContext& context);

/// The load behind a shaft, with bearing and encoder before it. Nothing where that does not leave clearly
/// less of the records, and less of the unseen one.
std::optional<Hypothesis> with_shaft(const Hypothesis& h, const SearchContext& context);
/// The better of both.
std::optional<Hypothesis> with_other_machine(const Hypothesis& h, const SearchContext& context);

/// With other values of the shapes that are chosen and not fitted, such as an exponent, where they leave
/// less.
Hypothesis with_best_shapes(const Hypothesis& h, const SearchContext& context);

/// Without one effect; those that came after it are fitted again, one by one.
Hypothesis without_effect(const Hypothesis& h, std::size_t effect, const SearchContext& context);

/// Simpler names in place of effects, where they explain the same beside the others.
Hypothesis take_simpler(const Hypothesis& h, const SearchContext& context);

/// One learned map, of those that explain most.
Hypothesis add_map(const Hypothesis& h, const SearchContext& context);
/// A learned map where named effects leave much: tried without the effects that may be stand-ins, then with
/// named effects on top.
Hypothesis add_learned(const Hypothesis& h, const SearchContext& context);

/// Whether the strength of the last effect does not stand out of its error.
bool last_is_vague(const Hypothesis& h, const SearchContext& context);
/// Why the unseen record does not bear out the last effect; empty: it does.
std::string contradicted_by_unseen(const Hypothesis& h, const SearchContext& context);
/// Without the effects that the unseen record does not bear out, or whose strength does not stand out of its
/// error.
Hypothesis believe(const Hypothesis& h, const ServoData& unseen, const SearchContext& context);

/// The declared machine without effects where those that are believed one by one do not explain more of the
/// unseen record together.
Hypothesis believe_together(const Hypothesis& h, const Hypothesis& declared, const ServoData& unseen,
                            const SearchContext& context);

/// Of a machine that is coupled to other axes: with stiff teeth, unless the unseen record bears their
/// compliance out.
Hypothesis believe_compliance(const Hypothesis& h, const ServoData& unseen, const SearchContext& context);

/// Friction of the machine that comes out below 0 held at 0, one parameter after the other. Throws
/// CannotIdentify where the machine cannot be fitted with that.
Hypothesis hold_friction(const Hypothesis& h, const SearchContext& context);

}  // namespace backlash::identification
