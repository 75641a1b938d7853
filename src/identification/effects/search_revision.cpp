// SPDX-License-Identifier: BSD-3-Clause
// What the search takes back: effects that others explain as well, that stood in for another or for what has
// no name.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "contact_shape.h"
#include "search.h"

namespace backlash {
namespace {

constexpr double kClearlyLess = 0.9;  // of a residual: worth another set of effects
constexpr double kAsGood = 1.02;      // of a residual: then fewer parameters are better

/// Friction below 0, of one direction or of both: it would drive the body.
bool friction_drives(const FitParameter& p, const Rig& rig) {
  const RigParameter& friction = servo_parameter(p.name);
  if (!friction.is_friction() || friction.is_asymmetry()) return false;
  const RigParameter* asymmetry = asymmetry_of(friction);
  return p.get(rig) < (asymmetry ? std::fabs(asymmetry->get(rig)) : 0);
}

}  // namespace

void Search::drop_superfluous() {
  for (std::size_t i = 0; effects_.size() > 1 && i < effects_.size();) {
    report("doing without " + effects_[i].candidate.id);
    std::vector<Accepted> fewer = effects_;
    fewer.erase(fewer.begin() + long(i));
    const Machine start = with_effects(fewer);
    Machine again;
    const auto fit = attempted([&] {
      again = fit_machine(start, stage_->records, fit_options(kRoughTolerance)).machine;
      return fit_machine(again, stage_->records, fit_options(kFineTolerance));
    });
    const bool needed = !fit || convinces(compare(held_out(*fit, again, stage_->records),
                                                  held_out(stage_->fit, stage_->start, stage_->records)),
                                          stage_->fit.machine);
    if (needed || !dropped(i)) ++i;
  }
}

/// Tried when hardening is found and once more beside all other effects, without which their shape may not
/// show.
bool Search::try_other_teeth() {
  std::vector<Accepted> others = effects_;
  others.erase(
      std::remove_if(others.begin(), others.end(),
                     [](const Accepted& effect) { return stands_in_for_contact_law(effect.candidate.id); }),
      others.end());
  const auto teeth =
      with_hertzian_teeth(base_->fit.machine.rig, range_.torque);  // hardening has its own stiffness
  const bool news = others.size() < effects_.size() && teeth_tried_with_ != effects_.size();
  const bool right = stage_->leftover.torque < kClearlyRight && stage_->leftover.deflection < kClearlyRight;
  if (teeth_settled_ || !news || right || !teeth) return false;
  teeth_tried_with_ = effects_.size();
  report("trying other teeth");
  const Machine declared = declared_;
  const Stage base = *base_, stage = *stage_;
  const std::vector<Accepted> effects = effects_;
  const bool fits = attempted([&] {
                      put_on(*teeth);
                      if (others.empty() || !adopt(std::move(others))) effects_.clear();
                      const std::vector<Accepted> kept = effects_;
                      const Stage with_them = *stage_;
                      fit_base();
                      if (!kept.empty()) {
                        effects_ = kept;
                        stage_ = with_them;
                      }
                      return size(stage_->leftover) < kClearlyLess * size(stage.leftover);
                    }).value_or(false);
  if (fits) return other_teeth_ = true;
  declared_ = declared;
  base_ = base;
  stage_ = stage;
  effects_ = effects;
  return false;
}

/// Declares a machine with other teeth; fits start with them.
void Search::put_on(const Rig& teeth) {
  Mesh& mesh = stage_->fit.machine.rig.mesh;
  mesh.contact_spec = teeth.mesh.contact_spec;
  mesh.contact = teeth.mesh.contact;
  const Rig declared = declared_.rig;
  declared_.rig = teeth;
  for (const RigParameter& p : servo_parameters()) {
    // Without the effects that it lacks the machine may have wanted less friction than none.
    if (p.is_friction() && p.get(teeth) <= 0) p.set(declared_.rig, p.get(declared));
  }
  declare_parameters();
}

/// Takes an effect out for good. Learned maps do not always find their way back from the machine without it:
/// where that shows it stays.
bool Search::dropped(std::size_t effect) {
  const std::vector<Accepted> effects = effects_;
  const Stage stage = *stage_;
  drop(effect);
  const bool learned = std::any_of(effects.begin(), effects.end(),
                                   [](const Accepted& e) { return is_learned(e.candidate.id); });
  if (!learned || size(stage_->leftover) * (1 - settings_.least_gain_unclear) < size(stage.leftover))
    return true;
  effects_ = effects;
  stage_ = stage;
  return false;
}

void Search::reconsider() {
  for (std::size_t i = 0; effects_.size() > 1 && i < effects_.size();) {
    const Leftover left = stage_->leftover;
    if (left.torque < kClearlyRight && left.deflection < kClearlyRight) return;
    const std::vector<Accepted> effects = effects_;
    const Stage stage = *stage_;
    report("reconsidering " + effects_[i].candidate.id);
    drop(i);
    add_effects();
    drop_superfluous();
    if (size(stage_->leftover) < kClearlyLess * size(left)) {
      i = 0;
      continue;
    }
    effects_ = effects;
    stage_ = stage;
    ++i;
  }
}

void Search::try_equivalents() {
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    for (const Candidate& other : std::vector<Candidate>(effects_[i].alternatives)) {
      const std::vector<Accepted> effects = effects_;
      const Stage stage = *stage_;
      report("trying " + other.id + " instead of " + effects_[i].candidate.id);
      std::vector<Accepted> swapped = effects_;
      std::swap(swapped[i].candidate,
                *std::find_if(swapped[i].alternatives.begin(), swapped[i].alternatives.end(),
                              [&](const Candidate& c) { return c.id == other.id; }));
      std::replace(swapped[i].equivalent_to.begin(), swapped[i].equivalent_to.end(), other.id,
                   effects_[i].candidate.id);
      if (adopt(std::move(swapped))) drop_superfluous();
      const bool fewer = stage_->start.parameters.size() < stage.start.parameters.size();
      if (size(stage_->leftover) < (fewer ? kAsGood : kClearlyLess) * size(stage.leftover)) break;
      effects_ = effects;
      stage_ = stage;
    }
  }
}

void Search::drop(std::size_t effect) {
  std::vector<Accepted> rest(effects_.begin() + long(effect) + 1, effects_.end());
  effects_.resize(effect);
  stage_ = base_;
  if (effect > 0) {
    std::vector<Accepted> before = effects_;
    adopt(std::move(before));
  }
  for (const Accepted& one : rest) {
    std::vector<Accepted> more = effects_;
    more.push_back(one);
    adopt(std::move(more));
  }
}

/// Friction of a machine with one channel is never quite what a term says, and its residual never at the
/// floor; there what was found stands, and what remains is told beside it.
void Search::drop_stand_ins() {
  if (!load_moves_freely(declared_.rig)) return;
  const Leftover &left = stage_->leftover, &first = base_->leftover;
  if (effects_.empty() || std::max(left.torque, left.deflection) < kNearFloor) return;
  const bool telling = std::any_of(effects_.begin(), effects_.end(),
                                   [](const Accepted& effect) { return effect.gain.evidence.gain >= kHalf; });
  if (telling && size(left) < kHalf * size(first)) return;
  effects_.clear();
  stage_ = base_;
}

/// A machine that lacks an effect may want friction below 0, of one direction or both, the final one may not.
void Search::hold_friction() {
  for (bool negative = true; negative;) {
    const Machine& now = stage_->fit.machine;
    auto at = std::find_if(declared_.parameters.begin(), declared_.parameters.end(),
                           [&](const FitParameter& p) { return friction_drives(p, now.rig); });
    negative = at != declared_.parameters.end();
    if (!negative) return;
    const auto asymmetry =
        std::find_if(declared_.parameters.begin(), declared_.parameters.end(),
                     [&](const FitParameter& p) { return servo_parameter(p.name).mean == at->name; });
    if (asymmetry != declared_.parameters.end()) at = asymmetry;
    held_.push_back(at->name);
    at->set(stage_->fit.machine.rig, 0);
    declared_.parameters.erase(at);
    if (effects_.empty())
      stage_ = fit_stage(data_, with_effects({}), cutoff_, kFineTolerance);
    else if (!adopt(effects_))
      throw CannotIdentify(held_.back() + " comes out below 0, and with 0 the machine cannot be fitted");
  }
}

}  // namespace backlash
