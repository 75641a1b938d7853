// SPDX-License-Identifier: BSD-3-Clause
#include "trace_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "joint_effects.h"
#include "trace_result.h"

namespace backlash::arm {
namespace {

class EffectSteps {
 public:
  EffectSteps(const CandidateFits& fits, const Motions& fitted, const Motions& judged,
              JointEffectsFound& found)
      : fits_(fits), fitted_(fitted), judged_(judged), found_(found) {}

  std::optional<Candidate> next(const Candidate& model) const;
  /// Instead of a factor of all friction of that joint.
  std::optional<Candidate> other_friction(const Candidate& model, std::size_t joint) const;
  /// Where a joint stays unexplained, the effect that takes most of it away need not be the missing one.
  void drop_what_does_not_explain(const Candidate& model) const;

 private:
  std::optional<Candidate> next(const Candidate& model, bool everywhere) const;
  Candidate with(const Candidate& model, const EffectGuess& guess, bool everywhere) const;
  void reject(const ArmTrace::Rejected& one) const;
  ArmTraceSettings settings_for_other_friction() const;
  bool is_of_term(const EffectGuess& guess) const {
    return stands_for_term(guess.effect.effect.spec(), fits_.rig);
  }

  const CandidateFits& fits_;
  const Motions& fitted_;
  const Motions& judged_;
  JointEffectsFound& found_;
};

/// Friction is known to be another one; which one is still to be reported, however small it is.
ArmTraceSettings EffectSteps::settings_for_other_friction() const {
  ArmTraceSettings settings = fits_.settings;
  settings.least_at_joint = settings.least_gain;
  settings.least_of_signal = 0;
  return settings;
}

std::optional<Candidate> EffectSteps::next(const Candidate& model) const {
  std::optional<Candidate> own = next(model, false), all;
  if (fits_.rig.fitted) return own;
  all = next(model, true);
  if (!own || !all || own->joint != all->joint) return all ? all : own;
  Candidate against = *own;
  judge(against, *all, judged_, fits_.rig, fits_.settings);
  const bool better = against.gains[own->joint] > fits_.settings.clearly && against.lowers[own->joint] > 0;
  return better ? own : all;
}

/// Fitted with it.
Candidate EffectSteps::with(const Candidate& model, const EffectGuess& guess, bool everywhere) const {
  Candidate c = model;
  c.alike = guess.alike;
  c.freedom.effects.push_back(guess.effect);
  c.freedom.effects.back().everywhere = everywhere;
  c.freedom.effects.back().of_term = is_of_term(guess);
  fits_.fit(c, fitted_);
  // Starts from the last fit, so that the next effect gains nothing by settling this one.
  for (std::size_t i = 0; i < c.freedom.effects.size(); ++i)
    c.freedom.effects[i].effect = c.fit.effects[i].effect;
  fits_.fit(c, fitted_);
  c.freedom.effects.back().effect.shape = guess.effect.effect.shape;
  return c;
}

std::optional<Candidate> EffectSteps::next(const Candidate& model, bool everywhere) const {
  const ArmTraceSettings& settings = fits_.settings;
  const std::vector<FittedMotion> motions = everywhere ? fits_.motions(fitted_) : as_fitted(fitted_, true);
  int tried = 0;
  for (const EffectGuess& guess : guess_effects(model.fit, model.freedom, motions, everywhere)) {
    // A factor of all friction and more of one kind of friction may also be a factor and more of another
    // kind.
    if (is_of_term(guess) && model.freedom.rubs_otherwise(guess.effect.joint)) continue;
    if (guess.share < settings.least_at_joint / 2 || tried++ == settings.most_tried) break;
    Candidate c = with(model, guess, everywhere);
    judge(c, model, judged_, fits_.rig, settings);
    const std::string reason = effect_refusal(c, model, judged_, settings);
    if (reason.empty()) return c;
    reject({guess.effect.effect.id, reason, fits_.rig.joints[c.joint].name});
  }
  return std::nullopt;
}

std::optional<Candidate> EffectSteps::other_friction(const Candidate& model, std::size_t joint) const {
  const ArmTraceSettings settings = settings_for_other_friction();
  found_.friction_alike[joint].clear();
  Candidate steady = model;
  steady.freedom.steady.push_back(joint);
  fits_.fit(steady, fitted_);
  std::optional<Candidate> best;
  int tried = 0;
  for (const EffectGuess& guess :
       guess_effects(steady.fit, steady.freedom, as_fitted(fitted_, true), false)) {
    if (guess.effect.joint != joint) continue;
    if (guess.share < settings.least_at_joint / 2 || tried++ == settings.most_tried) break;
    Candidate c = with(steady, guess, false), against = c;
    judge(c, steady, judged_, fits_.rig, settings);
    judge(against, model, judged_, fits_.rig, settings);
    const double gain = against.gains[joint];
    std::string reason = effect_refusal(c, steady, judged_, settings);
    if (reason.empty() && gain > -settings.nearly)
      found_.friction_alike[joint].push_back(guess.effect.effect.id);
    if (reason.empty() && !(gain > settings.clearly && against.lowers[joint] > 0))
      reason =
          fmt::format("leaves {:.2f} times the squared error that a factor of all friction leaves", 1 - gain);
    if (!reason.empty())
      reject({guess.effect.effect.id, reason, fits_.rig.joints[joint].name});
    else if (!best || c.gain > best->gain)
      best = c;
  }
  return best;
}

void EffectSteps::drop_what_does_not_explain(const Candidate& model) const {
  if (found_.steps.empty()) return;
  const Candidate last = found_.steps.back();
  const std::vector<double> expected = fits_.expected_errors(last, judged_),
                            errors = relative_errors(last.fit, last.freedom, as_fitted(judged_, true), 0);
  const auto left_of = [&](const Candidate& c) {
    const std::size_t joint = c.freedom.effects.back().joint;
    return errors[joint] / expected[joint];
  };
  const auto doubt = [&](const Candidate& c) -> std::string {
    if (left_of(c) > most_left(c, fits_.settings))
      return fmt::format("leaves {:.3g} times the error that the training records let expect", left_of(c));
    if (!(errors_from_none(c, last.fit) > fits_.settings.sure))
      return "is none beside what was found after it";
    return "";
  };
  const auto explains = [&](const Candidate& c) { return doubt(c).empty(); };
  if (std::all_of(found_.steps.begin(), found_.steps.end(), explains)) return;
  std::vector<Candidate> kept;
  for (const Candidate& c : found_.steps) {
    const FreeEffect& own = c.freedom.effects.back();
    if (!explains(c)) {
      reject({own.effect.id, doubt(c), fits_.rig.joints[own.joint].name});
      continue;
    }
    const Candidate before = kept.empty() ? model : kept.back();
    Candidate again = before;
    const bool instead = !c.freedom.rubs_otherwise(own.joint);
    if (instead) again.freedom.steady.push_back(own.joint);
    again.alike = c.alike;
    again.freedom.effects.push_back(own);
    fits_.fit(again, fitted_);
    judge(again, before, judged_, fits_.rig, fits_.settings);
    const std::string reason =
        effect_refusal(again, before, judged_, instead ? settings_for_other_friction() : fits_.settings);
    if (reason.empty())
      kept.push_back(std::move(again));
    else
      reject({own.effect.id, reason, fits_.rig.joints[own.joint].name});
  }
  found_.steps = std::move(kept);
}

/// Each effect of a joint once, with the last reason.
void EffectSteps::reject(const ArmTrace::Rejected& one) const {
  const auto known = std::find_if(
      found_.rejected.begin(), found_.rejected.end(),
      [&](const ArmTrace::Rejected& r) { return r.effect == one.effect && r.joint == one.joint; });
  if (known != found_.rejected.end())
    *known = one;
  else
    found_.rejected.push_back(one);
}

}  // namespace

JointEffectsFound joint_effects(const Candidate& model, const CandidateFits& fits, const Motions& fitted,
                                const Motions& judged) {
  JointEffectsFound found;
  const EffectSteps steps(fits, fitted, judged, found);
  const auto last = [&]() -> const Candidate& { return found.steps.empty() ? model : found.steps.back(); };
  const auto most = std::size_t(fits.settings.most_effects);
  const auto look_at_friction = [&] {
    for (std::size_t j = 0; j < fits.rig.joints.size() && found.steps.size() < most; ++j) {
      if (!other_friction_than_trained(last().fit, j, fits.settings)) continue;
      if (std::optional<Candidate> other = steps.other_friction(last(), j))
        found.steps.push_back(std::move(*other));
    }
  };
  look_at_friction();
  const std::size_t known = found.steps.size();
  while (found.steps.size() < most) {
    std::optional<Candidate> next = steps.next(last());
    if (!next) break;
    found.steps.push_back(std::move(*next));
  }
  if (found.steps.size() > known) look_at_friction();
  steps.drop_what_does_not_explain(model);
  return found;
}

}  // namespace backlash::arm
