// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/changes.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "channel_changes.h"
#include "different_values.h"

namespace backlash::changes {
namespace {

/// What one channel shows.
struct ChannelChanges {
  std::vector<FoundChange> found;
  std::vector<signal::Measured> beside;  // columns of what stood beside
  Changes reported;
};

ChannelChanges changes_in(const HealthyModel& model, const record::Record& record,
                          const std::vector<FoundChange>& beside, bool linear, const ChangeSettings& settings,
                          const Progress& progress) {
  const SampledMotion motion = motion_by(model, record, settings);
  const HealthyScores scores(model, settings);
  ChangeSearch search(model, motion, change_effects(model.sampling), scores, beside, settings, progress);
  ChannelChanges result;
  const std::vector<FoundChange>& found = result.found = search.run();
  result.beside = search.beside(found);
  Changes& out = result.reported =
      reported_changes(search, found, model.sampling.mesh.has_value(), linear, settings);
  for (const DifferentValue& value :
       different_values(model, search.background(found), search.own(), linear)) {
    if (std::find(out.different.begin(), out.different.end(), value.name) != out.different.end()) continue;
    out.different.push_back(value.name);
    out.cannot_tell += (out.cannot_tell.empty() ? "" : "; ") +
                       ("from its beginning the record differs from the healthy ones: " + value.text);
  }
  return result;
}

/// The share of its inertia that is behind the gap. Throws CannotIdentify for what is not of two inertias.
double share_behind(const model::Rig& rig) {
  if (!model::has_two_inertias(rig))
    throw CannotIdentify(
        "the rig file declares neither one inertia (mesh: rigid) nor two (rigid couplings, a free link): "
        "changes are found of these only");
  if (rig.motor_side && rig.reduction_ratio != 1)
    throw CannotIdentify(
        "the record is at the motor's side of the reduction: changes of two inertias are found "
        "in records at the load's side only");
  const double behind = rig.gear.inertia + rig.output_coupling.inertia + rig.link.inertia;
  return behind / (rig.motor.inertia + rig.input_coupling.inertia + rig.pinion.inertia + behind);
}

/// On which side of the gap friction has changed, by the motor's torque: friction behind the gap loads the
/// teeth and deflects them by `compliance`. 1: behind, 0: before; NaN: not known.
double side_of(const signal::Measured& torque, const signal::Measured& deflection, double compliance,
               const ChangeSettings& settings) {
  const double all = compliance * torque.value, share = deflection.value / all;
  const double error = settings.errors_of_side * std::fabs(deflection.standard_error / all);
  const double side = share > 0.5 ? 1 : 0;
  return std::fabs(share - side) + error < settings.worst_side ? side : kNaN;
}

/// Names friction by its side of the gap; where that is not known, both are named.
void name_sides(const ChannelChanges& torque, const ChannelChanges* deflection, double compliance,
                const ChangeSettings& settings, Changes& all) {
  constexpr std::pair<const char*, const char*> kSides[] = {{"motor_coulomb", "load_coulomb"},
                                                            {"motor_viscous", "load_viscous"}};
  std::size_t column = 0;
  for (const FoundChange& f : torque.found) {
    const std::size_t at = column;
    column += f.effect.ramp ? 1 : f.effect.count;
    for (const auto& [before, behind] : kSides)
      for (Change& c : all.changes) {
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
  if (!all.cannot_tell.empty() && !more.cannot_tell.empty()) all.cannot_tell += "; ";
  all.cannot_tell += more.cannot_tell;
}

/// Two inertias: the torque first, as its changes may change the load of the teeth; then the deflection.
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
    return changes_in(model, record, beside, rig.linear, settings, progress);
  };
  const ChannelChanges torque = search(commission_healthy(healthy, sampling, settings), {});
  Changes all = torque.reported;
  if (!load) {
    name_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.emplace_back("without load_position changes of the backlash are not judged: record it");
    return all;
  }
  sampling.channel = ChangeChannel::deflection;
  try {
    const HealthyModel model = commission_healthy(healthy, sampling, settings);
    const ChannelChanges deflection = search(model, torque.found);
    name_sides(torque, &deflection, compliance_of(model), settings, all);
    add_deflection(deflection.reported, all);
  } catch (const CannotIdentify& error) {
    name_sides(torque, nullptr, kNaN, settings, all);
    all.warnings.push_back("changes of the backlash are not judged: " + std::string(error.what()));
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
    out = changes_in(model, record, {}, rig.linear, settings, progress).reported;
  } else {
    out = changes_of_two(rig, behind, healthy, record, sampling, settings, progress);
  }
  std::sort(out.changes.begin(), out.changes.end(),
            [](const Change& a, const Change& b) { return a.since < b.since; });
  return out;
}

}  // namespace backlash::changes
