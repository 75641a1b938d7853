// SPDX-License-Identifier: BSD-3-Clause
#include "trace_effects.h"

#include <algorithm>
#include <optional>

#include "joint_effects.h"
#include "trace_result.h"

namespace backlash::arm {
namespace {

class EffectSteps {
 public:
  EffectSteps(const CandidateFits& fits, const Motions& fitted, const Motions& judged,
              std::vector<ArmTrace::Rejected>& rejected)
      : fits_(fits), fitted_(fitted), judged_(judged), rejected_(rejected) {}

  std::optional<Candidate> next(const Candidate& model) const;

 private:
  std::optional<Candidate> next(const Candidate& model, bool everywhere) const;
  void reject(const ArmTrace::Rejected& one) const;

  const CandidateFits& fits_;
  const Motions& fitted_;
  const Motions& judged_;
  std::vector<ArmTrace::Rejected>& rejected_;
};

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

std::optional<Candidate> EffectSteps::next(const Candidate& model, bool everywhere) const {
  const ArmTraceSettings& settings = fits_.settings;
  const std::vector<FittedMotion> motions = everywhere ? fits_.motions(fitted_) : as_fitted(fitted_, true);
  int tried = 0;
  for (const EffectGuess& guess : guess_effects(model.fit, model.freedom, motions, everywhere)) {
    if (guess.share < settings.least_at_joint / 2 || tried++ == settings.most_tried) break;
    Candidate c = model;
    c.alike = guess.alike;
    c.freedom.effects.push_back(guess.effect);
    c.freedom.effects.back().everywhere = everywhere;
    fits_.fit(c, fitted_);
    // From where it has come to, so that what is found next does not gain by settling this one.
    for (std::size_t i = 0; i < c.freedom.effects.size(); ++i)
      c.freedom.effects[i].effect = c.fit.effects[i].effect;
    fits_.fit(c, fitted_);
    c.freedom.effects.back().effect.shape = guess.effect.effect.shape;
    judge(c, model, judged_, fits_.rig, settings);
    const std::string reason = effect_refusal(c, model, judged_, settings);
    if (reason.empty()) return c;
    reject({guess.effect.effect.id, reason, fits_.rig.joints[c.joint].name});
  }
  return std::nullopt;
}

/// Each effect of a joint once, with the last reason.
void EffectSteps::reject(const ArmTrace::Rejected& one) const {
  const auto known = std::find_if(rejected_.begin(), rejected_.end(), [&](const ArmTrace::Rejected& r) {
    return r.effect == one.effect && r.joint == one.joint;
  });
  if (known != rejected_.end())
    *known = one;
  else
    rejected_.push_back(one);
}

}  // namespace

std::vector<Candidate> joint_effects(const Candidate& model, const CandidateFits& fits, const Motions& fitted,
                                     const Motions& judged, std::vector<ArmTrace::Rejected>& rejected) {
  const EffectSteps steps(fits, fitted, judged, rejected);
  std::vector<Candidate> found;
  while (int(found.size()) < fits.settings.most_effects) {
    std::optional<Candidate> next = steps.next(found.empty() ? model : found.back());
    if (!next) break;
    found.push_back(std::move(*next));
  }
  return found;
}

}  // namespace backlash::arm
