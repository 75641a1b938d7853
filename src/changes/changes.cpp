// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/changes.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "change_search.h"

namespace backlash::changes {
namespace {

std::string whole_seconds(double time) {
  return to_text(std::round(time)) + " s";
}

double rounded(double x) {
  return std::round(10 * x) / 10;
}

/// What one channel shows.
struct ChannelChanges {
  std::vector<FoundChange> found;
  std::vector<signal::Measured> beside;  // columns of what stood beside
  Changes told;
};

/// How the scores of effects scatter in the healthy records.
class HealthyScores {
 public:
  HealthyScores(const HealthyModel& model, const std::vector<record::Record>& healthy,
                const ChangeSettings& settings)
      : variance_(model.noise * model.noise), window_(settings.window) {
    for (const record::Record& r : healthy) {
      motions_.push_back(motion_by(model, r, settings));
      residuals_.push_back(residual_of(model, motions_.back(), settings).residual);
    }
  }
  double inflation(const ChangeEffect& effect) const {
    double most = 1;
    for (std::size_t r = 0; r < motions_.size(); ++r)
      most = std::max(most, score_inflation(motions_[r], residuals_[r], effect_columns(motions_[r], effect),
                                            variance_, window_));
    return most;
  }
  std::vector<ScannedEffect> of(const std::vector<ChangeEffect>& effects) const {
    std::vector<ScannedEffect> all;
    for (const ChangeEffect& e : effects) all.push_back({e, inflation(e)});
    for (const SampledMotion& m : motions_) m.known_columns.clear();  // asked for once
    return all;
  }

 private:
  std::vector<SampledMotion> motions_;
  std::vector<Eigen::VectorXd> residuals_;
  double variance_, window_;
};

/// What the load of the teeth may be other by: what the motor's torque shows, on whichever side of the gap.
std::function<double(const Moment&)> other_load(const std::vector<FoundChange>& changes, double block) {
  if (changes.empty()) return {};
  return [changes, block](const Moment& m) {
    double sum = 0;
    for (const FoundChange& f : changes) {
      if (m.time < block * double(f.from) || m.time >= block * double(f.to)) continue;
      if (f.effect.ramp)
        sum += f.score.values[0] * f.effect.columns[0](m, f.effect.shape) * (m.time - block * double(f.from));
      for (std::size_t i = 0; !f.effect.ramp && i < f.effect.columns.size(); ++i)
        sum += f.score.values[static_cast<Eigen::Index>(i)] * f.effect.columns[i](m, f.effect.shape);
    }
    return sum;
  };
}

/// Where the record is louder than the healthy machine. Of two inertias another task alone may do that, up to
/// a limit: their teeth cross the gap more often or harder.
void tell_loud(const ChangeSearch& search, const LoudStretch& loud, std::vector<std::string> nearest,
               bool of_two, const ChangeSettings& settings, Changes& out) {
  Change unknown = search.unknown(loud);
  if (!loud.from_beginning && (!of_two || loud.times >= settings.unknown_of_two)) {
    unknown.alike = std::move(nearest);
    out.changes.push_back(unknown);
    return;
  }
  const std::string since =
                        loud.from_beginning ? "from its beginning" : "since " + whole_seconds(unknown.since),
                    until = unknown.until ? " to " + whole_seconds(*unknown.until) : "";
  out.cannot_tell =
      since + until + " the record follows no effect, " + to_text(rounded(std::sqrt(loud.times))) +
      " times as far from it as the healthy records; if its task is another one, commission with "
      "motion of this kind";
}

/// Where it is louder than in the rest, though less than that. More than the changes explain is no shape of
/// theirs.
void tell_louder(const ChangeSearch& search, const std::vector<FoundChange>& found, double explained,
                 Changes& out) {
  const std::optional<LoudStretch> louder = search.louder(found);
  if (!louder || louder->excess < explained) return;
  const Change unknown = search.unknown(*louder);
  const std::string until = unknown.until ? " to " + whole_seconds(*unknown.until) : "";
  out.cannot_tell =
      "since " + whole_seconds(unknown.since) + until + " the record is " +
      to_text(rounded(std::sqrt(louder->times))) +
      " times as far from the healthy ones, farther than in the rest of it in motion alike, and "
      "follows no effect";
  for (const FoundChange& f : found) out.cannot_tell += ", nearest: " + f.effect.id;
  out.changes.clear();
}

/// What no effect explains is no health.
void tell_unexplained(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                      const ChangeSettings& settings, Changes& out) {
  std::optional<LoudStretch> loud = search.loud(found);
  double explained = 0;
  std::vector<std::string> nearest;
  for (const FoundChange& f : found) {
    explained += f.score.gain;
    nearest.push_back(f.effect.id);
  }
  if (search.like_fault()) nearest.emplace_back("local_fault");
  if (search.explained(found) && !(loud && loud->excess > explained)) {
    if (loud && !found.empty())
      out.warnings.push_back("since " + whole_seconds(search.unknown(*loud).since) +
                             " the record follows no effect, beside " + joined(nearest));
    else if (loud)
      tell_loud(search, *loud, {}, of_two, settings, out);
    else
      tell_louder(search, found, explained, out);
    return;
  }
  out.changes.clear();
  loud = search.loud({});
  if (loud)
    tell_loud(search, *loud, nearest, of_two, settings, out);
  else
    out.cannot_tell = "the record differs from the healthy ones in a way that no effect explains (nearest: " +
                      joined(nearest) + "): commission with more motion of this kind";
}

/// What is over soon is no change of the machine, whatever it looks like: a push, or a fault that few passes
/// show.
void take_out_short(const ChangeSettings& settings, Changes& out) {
  const double shortest = double(settings.least_windows) * settings.window;
  const auto is_short = [&](const Change& c) { return c.until && *c.until - c.since < shortest; };
  for (const Change& c : out.changes)
    if (is_short(c) && out.cannot_tell.empty())
      out.cannot_tell =
          "from " + whole_seconds(c.since) + " to " + whole_seconds(*c.until) +
          " the record differs from the healthy ones, too short to tell by what (nearest: " + c.effect + ")";
  out.changes.erase(std::remove_if(out.changes.begin(), out.changes.end(), is_short), out.changes.end());
}

ChannelChanges changes_in(const HealthyModel& model, const std::vector<record::Record>& healthy,
                          const record::Record& record, const std::vector<FoundChange>& beside, bool linear,
                          const ChangeSettings& settings, const Progress& progress) {
  HealthyModel of_record = model;
  of_record.sampling.other_load = other_load(beside, settings.block);
  const SampledMotion motion = motion_by(of_record, record, settings);
  const HealthyScores scores(model, healthy, settings);
  ChangeSearch search(
      model, motion, scores.of(change_effects(model.sampling)),
      [&](const ChangeEffect& e) { return scores.inflation(e); }, beside, settings, progress);
  ChannelChanges result;
  const std::vector<FoundChange>& found = result.found = search.run();
  result.beside = search.beside(found);
  Changes& out = result.told;
  out.windows = search.windows();
  out.threshold = search.threshold(1);
  out.noise = model.noise;
  for (const ChangeEffect& e : model.further) out.healthy_terms.push_back(e.name());
  for (const FoundChange& f : found) out.changes.push_back(search.told(f, found, linear));
  tell_unexplained(search, found, model.sampling.mesh.has_value(), settings, out);
  take_out_short(settings, out);
  out.different = search.different();
  for (const std::string& name : search.different())
    out.warnings.push_back("from its beginning the record differs from the healthy ones by " + name +
                           ": that is no change within it");
  return result;
}

/// The share of its inertia that is behind the gap. Throws CannotIdentify for what is not of two inertias.
double share_behind(const model::Rig& rig) {
  if (!model::has_two_inertias(rig))
    throw CannotIdentify(
        "changes are told of machines of one inertia (mesh: rigid) and of two (rigid couplings, a free "
        "link)");
  if (rig.motor_side && rig.reduction_ratio != 1)
    throw CannotIdentify("changes of two inertias are told from records at the load's side of the reduction");
  const double behind = rig.gear.inertia + rig.output_coupling.inertia + rig.link.inertia;
  return behind / (rig.motor.inertia + rig.input_coupling.inertia + rig.pinion.inertia + behind);
}

/// On which side of the gap friction is that the motor's torque shows as another: behind it, it loads the
/// teeth and deflects them by `compliance`. 1: behind, 0: before; NaN: not told.
double side_of(const signal::Measured& torque, const signal::Measured& deflection, double compliance,
               const ChangeSettings& settings) {
  const double all = compliance * torque.value, share = deflection.value / all;
  const double error = settings.errors_of_side * std::fabs(deflection.standard_error / all);
  const double side = share > 0.5 ? 1 : 0;
  return std::fabs(share - side) + error < settings.worst_side ? side : kNaN;
}

/// Names friction by its side of the gap; where that is not told, both are named.
void tell_sides(const ChannelChanges& torque, const ChannelChanges* deflection, double compliance,
                const ChangeSettings& settings, Changes& told) {
  constexpr std::pair<const char*, const char*> kSides[] = {{"motor_coulomb", "load_coulomb"},
                                                            {"motor_viscous", "load_viscous"}};
  std::size_t column = 0;
  for (const FoundChange& f : torque.found) {
    const std::size_t at = column;
    column += f.effect.ramp ? 1 : f.effect.columns.size();
    for (const auto& [before, behind] : kSides)
      for (Change& c : told.changes) {
        if (f.effect.id != before || c.effect != before || c.size.empty() || c.gain != f.gain) continue;
        const double side =
            deflection ? side_of(c.size[0].measured, deflection->beside[at], compliance, settings) : kNaN;
        if (std::isnan(side)) c.alike.emplace_back(behind);
        if (side == 1) c.effect = c.size[0].name = behind;
      }
  }
}

void add_deflection(const Changes& more, Changes& all) {
  all.changes.insert(all.changes.end(), more.changes.begin(), more.changes.end());
  all.healthy_terms.insert(all.healthy_terms.end(), more.healthy_terms.begin(), more.healthy_terms.end());
  all.different.insert(all.different.end(), more.different.begin(), more.different.end());
  all.warnings.insert(all.warnings.end(), more.warnings.begin(), more.warnings.end());
  all.deflection_noise = more.noise;
  if (all.cannot_tell.empty()) all.cannot_tell = more.cannot_tell;
}

/// What one channel cannot name while the other names it, or cannot either, is told once.
void unite_unknown(const ChangeSettings& settings, Changes& all) {
  std::vector<Change> kept;
  for (std::size_t i = 0; i < all.changes.size(); ++i) {
    const Change& c = all.changes[i];
    const auto told_by = [&](const Change& o) {
      const bool together = o.since_from - settings.same_event <= c.since_to &&
                            c.since_from - settings.same_event <= o.since_to;
      return together && (o.effect != "unknown" || &o < &c);
    };
    const auto other = std::find_if(all.changes.begin(), all.changes.end(), told_by);
    if (c.effect != "unknown" || other == all.changes.end())
      kept.push_back(c);
    else if (other->effect != "unknown")
      all.warnings.push_back("since " + whole_seconds(c.since) + " the record follows no effect, beside " +
                             other->effect);
  }
  all.changes = kept;
}

/// Two inertias: the torque first, whose changes may load the teeth otherwise; then the deflection.
Changes changes_of_two(const model::Rig& rig, double behind, const std::vector<record::Record>& healthy,
                       const record::Record& record, MotionSampling sampling, ChangeSettings settings,
                       const Progress& progress) {
  bool load = record.has(record::Channel::load_position);
  for (const record::Record& r : healthy) load = load && r.has(record::Channel::load_position);
  if (load) {
    sampling.behind = behind;
    settings.false_alarms_per_hour /= 2;  // two channels may be wrong
  }
  const HealthyModel whole = commission_healthy(healthy, sampling, settings);
  sampling.mesh = mesh_load(whole, rig.link, behind, healthy, settings);
  const auto search = [&](const HealthyModel& model, const std::vector<FoundChange>& beside) {
    return changes_in(model, healthy, record, beside, rig.linear, settings, progress);
  };
  const ChannelChanges torque = search(commission_healthy(healthy, sampling, settings), {});
  Changes all = torque.told;
  if (!load) {
    tell_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.emplace_back("without load_position changes of the backlash cannot be told");
    return all;
  }
  sampling.channel = ChangeChannel::deflection;
  try {
    const HealthyModel model = commission_healthy(healthy, sampling, settings);
    const ChannelChanges deflection = search(model, torque.found);
    tell_sides(torque, &deflection, compliance_of(model), settings, all);
    add_deflection(deflection.told, all);
  } catch (const CannotIdentify& error) {
    tell_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.push_back("changes of the backlash cannot be told: " + std::string(error.what()));
  }
  return all;
}

}  // namespace

Changes detect_changes(const model::Rig& rig, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings,
                       const Progress& progress) {
  const double behind = rig.mesh.rigid ? 0 : share_behind(rig);
  std::vector<const record::Record*> all = {&record};
  for (const record::Record& r : healthy) all.push_back(&r);
  const MotionSampling sampling = sampling_of(all, settings);
  Changes out;
  if (rig.mesh.rigid) {
    const HealthyModel model = commission_healthy(healthy, sampling, settings);
    out = changes_in(model, healthy, record, {}, rig.linear, settings, progress).told;
  } else {
    out = changes_of_two(rig, behind, healthy, record, sampling, settings, progress);
    unite_unknown(settings, out);
  }
  std::sort(out.changes.begin(), out.changes.end(),
            [](const Change& a, const Change& b) { return a.since < b.since; });
  return out;
}

}  // namespace backlash::changes
