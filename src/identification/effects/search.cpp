// SPDX-License-Identifier: BSD-3-Clause
#include "search.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/interruption.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "learned.h"

namespace backlash {
namespace {

constexpr double kRoughCutoff = 15;  // Hz, of the first round: what moves slowly has fewer wrong minima
constexpr double kAtFloor = 1.03;    // times the floor: nothing can be found
constexpr double kNoise =
    0.01;  // of the signal: a floor above may hide something, what is left below may stay
constexpr double kLeastInNoise = 0.012;  // gain
constexpr double kSure = 5.5;  // standard deviations, that noise alone does not reach in a thousand trials
constexpr double kLessThanNoise = 0.8;   // times the floor: a residual cannot be that small
constexpr double kLeastPredicted = 0.3;  // of the least gain, for a candidate to be fitted
constexpr std::size_t kTrials = 6;       // candidates that are fitted with the machine
constexpr double kWorthTrying = 0.2;     // of the best predicted gain
constexpr double kAlike = 0.8;           // of the best gain: another name for the same
constexpr double kTie = 0.005;  // of the misfit: then the term with the fewest shapes, gravity before cogging
constexpr double kMostBlocks = 0.6;      // of the blocks must get better
constexpr double kSomethingLeft = 1.25;  // times the floor: worth a learned map
constexpr std::size_t kMapTrials = 2;
constexpr std::size_t kNearest = 3;
constexpr double kHopeless = 1.2;  // times a misfit, after the rough half of a fit
constexpr int kOtherStarts = 4;
constexpr double kBeside = 0.4;  // of the logarithm of a parameter
constexpr double kSame = 0.03;   // relative difference of what two starts leave in the same minimum

/// Another start not far away, the same for the same number.
Machine beside(Machine machine, int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  for (const FitParameter& p : machine.parameters) {
    const double share = double(random()) / double(std::mt19937::max());
    if (p.positive) p.set(machine.rig, p.get(machine.rig) * std::exp(kBeside * (2 * share - 1)));
  }
  return machine;
}

/// What the terms of a candidate have from their grids, in rising order.
std::vector<std::vector<double>> places(const Candidate& candidate) {
  std::vector<std::vector<double>> all;
  for (const ParameterValues& term : candidate.terms) {
    all.emplace_back();
    for (const TermShape& shape : term_type(candidate.id).search->shapes)
      if (!shape.refined) all.back().push_back(term.at(shape.name));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// A map over the recorded torque may take it away, and all inertia with it: no residual, less than noise.
bool takes_noise_away(const std::vector<Accepted>& effects, const Leftover& left) {
  return left.torque < kLessThanNoise &&
         std::any_of(effects.begin(), effects.end(), [](const Accepted& effect) {
           return is_learned(effect.candidate.id) &&
                  kind_of(effect.candidate.terms.front()).coordinate == channel_name(Channel::motor_torque);
         });
}

}  // namespace

bool is_learned(const std::string& id) {
  return term_type(id).map.has_value();
}

bool is_delay(const std::string& id) {
  return term_type(id).calibrates == Calibrates::torque_delay;
}

bool stands_in_for_contact_law(const std::string& id) {
  return term_type(id).stands_in_for_contact_law;
}

bool is_friction(const std::string& parameter) {
  return servo_parameter(parameter).is_friction();
}

Search::Search(const Rig& declared, const std::vector<ServoData>& train, double cutoff,
               const TraceSettings& settings, const Progress& progress)
    : data_(train), cutoff_(cutoff), settings_(settings), progress_(progress), range_(motion_range(train)) {
  declared_.rig = declared;
  declared_.calibrations.resize(train.size());
  if (declared.link_locked) start_in_travel();
  declare_parameters();
}

void Search::declare_parameters() {
  const Rig& rig = declared_.rig;
  declared_.parameters.clear();
  for (const std::string& name : parameter_names()) {
    FitParameter p = machine_parameter(name, rig);
    // Without an effect that it lacks a machine may want friction below 0; a logarithm would not come back.
    if (p.positive && is_friction(name) &&
        !rig.link_locked) {  // there damping is hardly told and stays where it is
      p.positive = false;
      p.scale = p.get(rig);
    }
    declared_.parameters.push_back(p);
  }
}

/// Play and the wind-up of both sides are about the middle of the travel, and both flanks must have touched.
void Search::start_in_travel() {
  double& gap = declared_.rig.mesh.backlash;
  for (std::size_t i = 0; i < data_.size(); ++i) {
    const auto [low, high] = std::minmax_element(data_[i].motor.begin(), data_[i].motor.end());
    declared_.calibrations[i].encoder_offset = -0.5 * (*low + *high);
    gap = std::min(gap, 0.5 * (*high - *low) * declared_.rig.mesh.lever());
  }
}

void Search::run() {
  // Fits of minutes have nothing new to report, but end when asked to.
  const Interruption interruption([this] { return !progress_ || progress_(share_done(), phase_); });
  fit_base();
  declared_base_ = base_;
  add_effects();
  if (try_other_teeth()) add_effects();
  teeth_settled_ = true;  // what follows may be taken back, and other teeth are not
  drop_superfluous();
  reconsider();
  try_equivalents();
  add_learned();
  drop_stand_ins();
  hold_friction();
}

/// Effects that are taken back do not turn it back.
double Search::share_done() const {
  const double share = (double(effects_.size()) + (stage_ ? 1 : 0)) / double(settings_.most_effects + 1);
  done_ = std::max(done_, std::min(1.0, share));
  return done_;
}

void Search::report(const std::string& phase) const {
  phase_ = phase;
  if (progress_ && !progress_(share_done(), phase)) throw Cancelled();
}

/// All that the rig declares and such records can tell.
std::vector<std::string> Search::parameter_names() const {
  const Rig& rig = declared_.rig;
  std::vector<std::string> names;
  for (const RigParameter& p : servo_parameters()) {
    if (p.kind == ParameterKind::start_in_gap || !p.known_to(rig)) continue;
    if (p.part == RigPart::link && !load_moves_freely(rig)) continue;
    if (p.get(rig) != 0) names.push_back(p.name);
  }
  return names;
}

Machine Search::with_effects(const std::vector<Accepted>& effects) const {
  Machine machine = stage_ ? stage_->fit.machine : base_->fit.machine;
  machine.rig.terms = declared_.rig.terms;
  machine.parameters = declared_.parameters;
  machine.beliefs = declared_.beliefs;
  machine.largest_delay = base_->fit.machine.largest_delay;
  for (const Accepted& effect : effects) machine = extended(machine, effect.candidate);
  return machine;
}

double Search::share(const std::string& id) const {
  Machine without = stage_->fit.machine;
  auto& terms = without.rig.terms;
  terms.erase(std::remove_if(terms.begin() + long(declared_.rig.terms.size()), terms.end(),
                             [&](const auto& term) { return term->id == id; }),
              terms.end());
  const Leftover with = stage_->leftover, less = stage_->records.leftover(without);
  const auto change = [](double before, double after) {
    return std::sqrt(std::max(0.0, before * before - after * after));
  };
  return std::max(change(less.torque_share, with.torque_share),
                  change(less.deflection_share, with.deflection_share));
}

Machine Search::extended(Machine machine, const Candidate& candidate) const {
  if (!is_learned(candidate.id)) return with_candidate(std::move(machine), candidate, range_);
  return with_map(std::move(machine), {candidate.terms.front(), candidate.smoothness, 0}, range_);
}

/// Other starts are tried until two end alike: then that is the minimum, and what is left the machine has and
/// the rig has not.
Stage Search::rough_base() const {
  std::optional<Stage> best;
  for (int i = 0; i <= kOtherStarts; ++i) {
    report("fit of the declared machine");
    try {
      Stage other = fit_stage(data_, i == 0 ? declared_ : beside(declared_, i),
                              std::min(kRoughCutoff, cutoff_), kRoughTolerance);
      const double least = best ? size(best->leftover) : INFINITY, left = size(other.leftover);
      if (left < least) best = std::move(other);
      if (left < kNearFloor || std::fabs(left / least - 1) < kSame) break;
    } catch (const CannotIdentify&) {
      if (i == kOtherStarts && !best) throw;
    }
  }
  return std::move(*best);
}

void Search::fit_base() {
  Machine machine = rough_base().fit.machine;
  tell_held(machine);
  machine = fit_stage(data_, machine, cutoff_, kRoughTolerance).fit.machine;
  tell_held(machine);
  limit_delay(machine);
  base_ = fit_stage(data_, machine, cutoff_, kRoughTolerance);
  base_ = fit_stage(data_, base_->fit.machine, cutoff_, kFineTolerance);
  stage_ = base_;
  tell_best();
}

void Search::tell_best() const {
  if (!settings_.best_so_far) return;
  std::string names;
  for (const Accepted& effect : effects_) names += (names.empty() ? "" : " + ") + effect.candidate.id;
  char left[96];
  std::snprintf(left, sizeof left, ": torque %.3g, deflection %.3g times the noise floor",
                stage_->leftover.torque, stage_->leftover.deflection);
  settings_.best_so_far((names.empty() ? "the declared machine" : names) + left);
}

/// Fits machine and candidate together, with the weights of the present stage so that fits can be compared.
/// Nothing where that fails or is far from the misfit that it should have.
std::optional<Search::Trial> Search::tried(const Candidate& candidate, double wanted) const {
  Trial trial{candidate, {}, {}, 0};
  const auto fit = attempted([&] {
    trial.start = extended(stage_->fit.machine, candidate);
    if (is_delay(candidate.id)) take_over_calibration(trial.start, data_.front().interval);
    const bool map = !trial.start.beliefs.empty();
    const MachineFit rough = fit_machine(trial.start, stage_->records, fit_options(kRoughTolerance, map));
    if (rough.fit.residuals.norm() > kHopeless * wanted) throw CannotIdentify("far from what was wanted");
    trial.start = rough.machine;
    return fit_machine(trial.start, stage_->records, fit_options(kFineTolerance, map));
  });
  if (!fit) return std::nullopt;
  trial.fit = *fit;
  trial.misfit = trial.fit.fit.residuals.norm();
  const auto& terms = trial.fit.machine.rig.terms;
  for (std::size_t i = 0; i < candidate.terms.size(); ++i)
    trial.candidate.terms[i] = terms[terms.size() - candidate.terms.size() + i]->values;
  return trial;
}

/// Best first.
std::vector<Search::Trial> Search::tried_best(const std::vector<Candidate>& candidates) const {
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < std::min(kTrials, candidates.size()); ++i) {
    if (candidates[i].gain <
        std::max(kWorthTrying * candidates.front().gain, kLeastPredicted * least_gain_in_noise()))
      break;
    char text[96];
    std::snprintf(text, sizeof text, "trying %s (predicted gain %.3g)", candidates[i].id.c_str(),
                  candidates[i].gain);
    report(text);
    if (auto trial = tried(candidates[i])) trials.push_back(std::move(*trial));
  }
  std::stable_sort(trials.begin(), trials.end(),
                   [](const Trial& a, const Trial& b) { return a.misfit < b.misfit; });
  const auto shapes = [](const Trial& t) { return term_type(t.candidate.id).search->shapes.size(); };
  const auto tied = std::find_if(trials.begin(), trials.end(), [&](const Trial& t) {
    return t.misfit > (1 + kTie) * trials.front().misfit;
  });
  std::stable_sort(trials.begin(), tied,
                   [&](const Trial& a, const Trial& b) { return shapes(a) < shapes(b); });
  return trials;
}

/// The same with its t-th term's shape some places farther in the grid; nothing where that ends or where two
/// terms become one.
std::optional<Candidate> Search::neighbour(const Candidate& candidate, std::size_t t, const TermShape& shape,
                                           long step) const {
  const std::vector<double> grid = shape.values(range_);
  const long at =
      std::find(grid.begin(), grid.end(), candidate.terms[t].at(shape.name)) - grid.begin() + step;
  if (at < 0 || at >= long(grid.size())) return std::nullopt;
  for (const ParameterValues& term : candidate.terms)
    if (term.at(shape.name) == grid[std::size_t(at)]) return std::nullopt;
  Candidate other = candidate;
  other.terms[t][shape.name] = grid[std::size_t(at)];
  return other;
}

/// Sensitivities of a model that lacks an effect may mislead about orders: their neighbours are fitted too,
/// unless what is left is noise.
Search::Trial Search::best_neighbour(Trial trial) const {
  const Leftover left = stage_->records.leftover(trial.fit.machine);
  if (left.torque < kClearlyRight && left.deflection < kClearlyRight) return trial;
  std::set<std::vector<std::vector<double>>> known;
  for (bool better = true; better;) {
    better = false;
    for (const TermShape& shape : term_type(trial.candidate.id).search->shapes) {
      if (shape.refined || shape.values(range_).size() < 2) continue;
      const Trial centre = trial;
      for (std::size_t t = 0; t < centre.candidate.terms.size(); ++t) {
        for (const long step : {-2L, -1L, 1L, 2L}) {
          const auto other = neighbour(centre.candidate, t, shape, step);
          if (!other || !known.insert(places(*other)).second) continue;
          report("trying " + trial.candidate.id);
          const auto fitted = tried(*other, trial.misfit);
          if (!fitted || fitted->misfit >= 0.999 * trial.misfit) continue;
          trial = *fitted;
          better = true;
        }
      }
    }
  }
  return trial;
}

/// Of a residual that is mostly noise a clear effect is a small part: as much as noise itself hardly ever
/// gains is enough.
double Search::least_gain_in_noise() const {
  const double rows = 0.5 * double(stage_->records.layout().size());  // of a channel
  return std::clamp(kSure * kSure / (2 * rows), std::min(kLeastInNoise, settings_.least_gain),
                    settings_.least_gain);
}

bool Search::convinces(const Gain& gain, const Machine& after) const {
  const Leftover left = stage_->records.leftover(after);
  const bool clear = (gain.deflection ? left.deflection : left.torque) < kNearFloor;
  const bool noise = (gain.deflection ? left.deflection_share : left.torque_share) > kNoise;
  const bool one_channel =
      !load_moves_freely(declared_.rig);  // friction is never quite what a term says, and shows
  const double least = !clear || one_channel ? settings_.least_gain_unclear
                       : noise               ? least_gain_in_noise()
                                             : settings_.least_gain;
  const Evidence& e = gain.evidence;
  return e.gain_held_out >= least && e.gain_forward >= 0.5 * least && gain.total > 0 &&
         e.blocks_better >= kMostBlocks * e.blocks;
}

bool Search::adopt(std::vector<Accepted> effects) {
  std::optional<Stage> fitted = attempted([&] {
    Machine machine = with_effects(effects);
    const bool delay = std::any_of(effects.begin(), effects.end(),
                                   [](const Accepted& effect) { return is_delay(effect.candidate.id); });
    if (delay)
      without_calibration(machine);
    else
      machine.largest_delay = Machine().largest_delay;  // it may have stood in for the effect
    Machine fitted = fit_stage(data_, machine, cutoff_, kRoughTolerance).fit.machine;
    if (!delay) {
      tell_held_again(fitted);
      limit_delay(fitted);
    }
    return fit_stage(data_, fitted, cutoff_, kFineTolerance);
  });
  if (!fitted || takes_noise_away(effects, fitted->leftover)) return false;
  Stage& stage = *fitted;
  std::size_t place = declared_.rig.terms.size();
  for (Accepted& effect : effects)
    for (ParameterValues& values : effect.candidate.terms)
      values = stage.fit.machine.rig.terms[place++]->values;
  effects.back().after = stage.fit.machine;
  stage_ = std::move(stage);
  effects_ = std::move(effects);
  tell_best();
  return true;
}

bool Search::add_one() {
  const Leftover& left = stage_->leftover;
  if (std::max(left.torque, left.deflection) < kAtFloor &&
      std::max(left.torque_share, left.deflection_share) < kNoise)
    return false;
  char text[96];
  std::snprintf(text, sizeof text, "screening (torque %.3g, deflection %.3g times the noise floor)",
                left.torque, left.deflection);
  report(text);
  const std::vector<Trial> trials = tried_best(screen(stage_->fit, stage_->records, range_));
  const HeldOut now = held_out(stage_->fit, stage_->start, stage_->records);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial best = best_neighbour(trials[i]);
    const Gain gain = compare(now, held_out(best.fit, best.start, stage_->records));
    if (!convinces(gain, best.fit.machine)) continue;
    Accepted effect{best.candidate, gain, {}, {}, {}, {}};
    for (const Trial& other : trials) {
      if (other.candidate.id == best.candidate.id) continue;
      const Gain its = compare(now, held_out(other.fit, other.start, stage_->records));
      if (its.total < kAlike * gain.total) continue;
      auto& names = effect.equivalent_to;
      if (std::find(names.begin(), names.end(), other.candidate.id) == names.end())
        names.push_back(other.candidate.id);
      effect.alternatives.push_back(other.candidate);
    }
    std::vector<Accepted> effects = effects_;
    effects.push_back(effect);
    if (adopt(std::move(effects))) return true;
  }
  return false;
}

bool Search::add_map() {
  report("learning maps");
  const std::vector<LearnedCandidate> maps = learn_maps(stage_->fit, stage_->records, range_);
  const HeldOut now = held_out(stage_->fit, stage_->start, stage_->records);
  for (std::size_t i = 0; i < std::min(kMapTrials, maps.size()); ++i) {
    if (maps[i].gain < kLeastPredicted * settings_.least_gain_unclear) break;
    const auto trial = tried({map_term().id, {maps[i].values}, maps[i].gain, maps[i].smoothness});
    if (!trial) continue;
    const Gain gain = compare(now, held_out(trial->fit, trial->start, stage_->records));
    if (gain.evidence.gain_held_out < settings_.least_gain_unclear || !convinces(gain, trial->fit.machine))
      continue;
    Accepted effect{trial->candidate, gain, {}, {}, {}, {}};
    for (const Candidate& named : screen(stage_->fit, stage_->records, range_))
      if (effect.nearest.size() < kNearest) effect.nearest.push_back(named.id);
    std::vector<Accepted> effects = effects_;
    effects.push_back(effect);
    if (adopt(std::move(effects))) return true;
  }
  return false;
}

/// Tried without the effects that explain less than half of their residual, which may be stand-ins, then with
/// named effects on top; the better of both remains.
void Search::add_learned() {
  const Leftover& left = stage_->leftover;
  const double before = size(left);
  if (std::max(left.torque, left.deflection) < kSomethingLeft ||
      std::max(left.torque_share, left.deflection_share) < kNoise)
    return;
  const std::vector<Accepted> named = effects_;
  const Stage stage = *stage_;
  for (std::size_t i = effects_.size(); load_moves_freely(declared_.rig) && i-- > 0;)
    if (effects_[i].gain.evidence.gain < kHalf) drop(i);
  bool helped = false;
  while (effects_.size() < settings_.most_effects && add_map()) helped = true;
  if (helped) {
    add_effects();
    drop_superfluous();
    if (size(stage_->leftover) < (1 - settings_.least_gain_unclear) * before) return;
  }
  effects_ = named;
  stage_ = stage;
}

void Search::add_effects() {
  while (effects_.size() < settings_.most_effects && add_one())
    if (stands_in_for_contact_law(effects_.back().candidate.id)) try_other_teeth();
}

}  // namespace backlash
