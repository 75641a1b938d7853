// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/changes/changes_of_rig.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "channel_changes.h"
#include "rig_scan.h"

namespace backlash::changes {
namespace {

using record::Channel;

constexpr std::size_t kFewest = 4;     // stretches that must fit. Choice
constexpr double kLeftByName = 0.2;    // of what all values together explain, that a name may leave. Choice
constexpr double kSureOfLeft = 0.999;  // chance that the others together explain no more than this of nothing
constexpr double kMostUnexplained = 1.0 / 3;   // of the stretches, beside those that are reported. Choice
constexpr std::size_t kFewestUnexplained = 3;  // in a row, that are a change. Choice: one may be odd

/// Stretches in a row that no machine explains, and what is before them.
struct UnknownRun {
  std::size_t first = 0, last = 0;
};

class RigChanges {
 public:
  RigChanges(const HealthyRig& rig, const record::Record& record, const ChangeSettings& settings,
             const Progress& progress)
      : rig_(rig), record_(record), settings_(settings), progress_(progress), cutter_(record) {}

  Changes find() {
    fit(cutter_.spread(settings_.rig_stretches));
    for (int i = 0; i < settings_.rig_refinements; ++i) {
      const std::optional<Stretch> next = next_stretch();
      if (!next) break;
      fit({*next});
    }
    return result();
  }

 private:
  void fit(const std::vector<Stretch>& at) {
    for (const Stretch& s : at) {
      ++done_;
      if (progress_ &&
          !progress_(std::min(0.99, done_ / double(settings_.rig_stretches + settings_.rig_refinements)),
                     "fitting"))
        throw Cancelled();
      all_.push_back(fit_stretch(record_, s, rig_));
    }
    std::sort(all_.begin(), all_.end(),
              [](const FittedStretch& a, const FittedStretch& b) { return a.at.from < b.at.from; });
  }

  std::vector<FittedStretch> judged() const {
    std::vector<FittedStretch> out;
    for (const FittedStretch& s : all_)
      if (s.judged) out.push_back(s);
    if (out.size() >= kFewest) return out;
    std::string reason;
    for (const FittedStretch& s : all_)
      if (!s.reason.empty()) reason = ": " + s.reason;
    throw CannotIdentify(fmt::format("{}: {} of {} stretches determine the machine, {} are needed{}",
                                     record_.name, out.size(), all_.size(), kFewest, reason));
  }

  RigScan scan() const {
    const double hours = (record_.time.back() - record_.time.front()) / 3600;
    return {rig_, judged(), settings_.false_alarms_per_hour * hours, settings_};
  }

  std::vector<UnknownRun> unknown_runs() const {
    std::vector<UnknownRun> runs;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (!all_[i].unexplained) continue;
      if (i > 0 && all_[i - 1].unexplained)
        runs.back().last = i;
      else
        runs.push_back({i, i});
    }
    const auto few = [](const UnknownRun& r) { return r.last - r.first + 1 < kFewestUnexplained; };
    runs.erase(std::remove_if(runs.begin(), runs.end(), few), runs.end());
    return runs;
  }

  /// A stretch in the widest room between two others around an onset; nothing where none fits any more.
  std::optional<Stretch> next_stretch() const {
    const RigScan s = scan();
    std::vector<Stretch> edges;
    const auto around = [&](double t) { edges.push_back({s.before(t).at.from, s.after(t).at.to}); };
    const RigScan::Found found = s.run();
    for (const RigChange& c : found.changes) {
      if (!c.shape.ramp) around(c.shape.since);
      if (std::isfinite(c.shape.until)) around(c.shape.until);
    }
    if (const auto unexplained = s.unexplained(found)) around(unexplained->since);
    for (const UnknownRun& r : unknown_runs()) {
      if (r.first > 0) edges.push_back({all_[r.first - 1].at.from, all_[r.first].at.to});
      if (r.last + 1 < all_.size()) edges.push_back({all_[r.last].at.from, all_[r.last + 1].at.to});
    }
    std::optional<Stretch> best;
    double widest = 0;
    for (const Stretch& edge : edges)
      for (std::size_t i = 1; i < all_.size(); ++i) {
        const double from = all_[i - 1].at.to, to = all_[i].at.from;
        if (all_[i - 1].at.from < edge.from || all_[i].at.to > edge.to || to - from <= widest) continue;
        const Stretch cut = cutter_.nearest((from + to) / 2);
        if (cut.from < from || cut.to > to) continue;
        widest = to - from, best = cut;
      }
    return best;
  }

  /// The change that a gain stands for.
  std::vector<ChangeSize> size_of(const RigChange& c) const {
    const RigEffect& effect = rig_.effects[c.effect];
    const bool gap = effect.value == 0;
    static const RigValue gain{"", "", true, 1, 1};
    const RigValue& v = effect.value < 0 ? gain : rig_.values[static_cast<std::size_t>(effect.value)];
    double value = v.spread * c.size, slope = v.spread;  // in the unit, and its derivative by the size
    if (gap) {
      value = v.value * c.size, slope = v.value;
    } else if (v.factor) {
      const double mean = effect.value < 0 ? 0 : rig_.mean[effect.value];
      const double healthy = v.value * std::exp(v.spread * mean), factor = std::exp(v.spread * c.size);
      value = healthy * (factor - 1), slope = healthy * factor * v.spread;
    }
    const double error =
        std::hypot(slope * std::sqrt(c.variance), std::hypot(settings_.model_error, v.scale_error) * value);
    std::vector<ChangeSize> out;
    const double radius = rig_.settings.base_radius;
    if (gap && !rig_.settings.angular) out.push_back({"backlash", effect.unit, {value, error}});
    if (gap)
      out.push_back({"angle", "rad", {value / radius, error / radius}});
    else
      out.push_back({effect.name, effect.unit, {value, error}});
    if (c.shape.ramp) {
      const double span = record_.time.back() - c.shape.since;
      out.push_back({"span", "s", {span, settings_.onset_least}});
    }
    return out;
  }

  Change change_of(const RigScan& scan, const RigChange& c, const std::vector<RigChange>& others) const {
    Change change;
    change.gain = c.gain;
    change.since = c.shape.since;
    const Stretch onset = scan.onset_interval(c, others);
    change.since_from = onset.from, change.since_to = onset.to;
    if (std::isfinite(c.shape.until)) change.until = c.shape.until;
    change.error_before = change.error_after = rig_.residual[0];
    const std::string& name = rig_.effects[c.effect].name;
    const double all = scan.all_gain(c.shape, others), own = rig_.effects[c.effect].inflation * c.gain;
    const double chance =
        rig_.inflation_of_all * signal::chi_square_quantile(kSureOfLeft, double(rig_.values.size()));
    if (all - own > kLeftByName * all + chance) {
      change.effect = "unknown";
      change.alike = {name};
      return change;
    }
    change.effect = name;
    change.size = size_of(c);
    for (std::size_t e = 0; e < rig_.effects.size(); ++e)
      if (e != c.effect && scan.scored(e, c.shape, others).gain >= settings_.alike * c.gain)
        change.alike.push_back(rig_.effects[e].name);
    return change;
  }

  /// Stretches in a row that no machine explains.
  void report_unknown(Changes& out) const {
    for (const UnknownRun& r : unknown_runs()) {
      const FittedStretch& first = all_[r.first];
      if (r.first == 0) {
        out.cannot_tell = "from its beginning the record does not follow the machine: " + first.reason;
        continue;
      }
      Change change;
      change.effect = "unknown";
      change.since_from = all_[r.first - 1].at.from, change.since_to = first.at.to;
      change.since = (all_[r.first - 1].at.to + first.at.from) / 2;
      if (r.last + 1 < all_.size()) change.until = (all_[r.last].at.to + all_[r.last + 1].at.from) / 2;
      change.error_before = rig_.residual[0], change.error_after = first.residual[0];
      out.changes.push_back(change);
      out.warnings.push_back(fmt::format("since {:.1f} s: {}", change.since, first.reason));
    }
  }

  /// A stretch that was not judged is not healthy.
  void report_unjudged(Changes& out) const {
    std::size_t left = 0, count = 0;
    std::string reason;
    for (const FittedStretch& s : all_) {
      const auto covers = [&](const Change& c) {
        const bool within =
            c.effect == "unknown" && s.at.from >= c.since_from && (!c.until || s.at.to <= *c.until);
        return within || (s.at.to >= c.since_from && s.at.from <= c.since_to);  // it may hold the onset
      };
      if (std::any_of(out.changes.begin(), out.changes.end(), covers)) continue;
      ++count;
      if (s.judged) continue;
      ++left, reason = s.reason;
    }
    if (left == 0) return;
    const std::string text = fmt::format("{} of {} stretches cannot be judged: {}", left, count, reason);
    if (double(left) > kMostUnexplained * double(count) && out.cannot_tell.empty())
      out.cannot_tell = text;
    else
      out.warnings.push_back(text);
  }

  Changes result() const {
    const RigScan s = scan();
    const RigScan::Found found = s.run();
    Changes out;
    out.windows = s.size();
    out.threshold = s.threshold();
    out.noise = rig_.residual[0];
    for (std::size_t i = 0; i < found.changes.size(); ++i)
      out.changes.push_back(change_of(s, found.changes[i], found.beside(i)));
    for (const RigChange& d : found.different) add_different(rig_.effects[d.effect].name, out);
    if (const auto unexplained = s.unexplained(found)) {
      const std::string text =
          fmt::format("since {:.0f} s the values of the machine together are others, though none alone is",
                      unexplained->since);
      (out.changes.empty() ? out.cannot_tell : out.warnings.emplace_back()) = text;
    }
    report_unknown(out);
    report_unjudged(out);
    take_out_short(settings_, out);
    std::sort(out.changes.begin(), out.changes.end(),
              [](const Change& a, const Change& b) { return a.since < b.since; });
    return out;
  }

  const HealthyRig& rig_;
  const record::Record& record_;
  const ChangeSettings& settings_;
  const Progress& progress_;
  const StretchCutter cutter_;
  std::vector<FittedStretch> all_;
  int done_ = 0;
};

/// Why a machine with something elastic besides its teeth is not served.
std::string why_not(const rig_file::RigFile& file) {
  if (file.rig.input_coupling.rigid)
    return "it has no torque sensor before the gear (input_coupling: rigid) and an output that is locked or "
           "elastic";
  return "its equations are not those that `waveform` fits (a stiffness that varies, an asymmetric or linear "
         "axis, terms, a value of 0 that has to be known)";
}

}  // namespace

Changes changes_of_rig(const diagnosis::WaveformSettings& machine, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings,
                       const Progress& progress) {
  bool position = record.has(Channel::motor_position);
  for (const record::Record& r : healthy) position = position && r.has(Channel::motor_position);
  const auto used = [position](record::Record r) {
    if (!position) r.column(Channel::motor_position).clear();
    for (const Channel needed : {Channel::motor_torque, Channel::sensor_torque})
      if (!r.has(needed)) throw CannotIdentify(r.name + ": needs " + record::channel_name(needed));
    return r;
  };
  const record::Record looked_at = used(record);
  std::vector<record::Record> learned;
  for (const record::Record& r : healthy) learned.push_back(used(r));
  const HealthyRig rig = commission_rig(learned, machine, settings);
  return RigChanges(rig, looked_at, settings, progress).find();
}

Changes detect_changes(const rig_file::RigFile& file, const std::vector<record::Record>& healthy,
                       const record::Record& record, const ChangeSettings& settings,
                       const Progress& progress) {
  if (file.rig.mesh.rigid || model::has_two_inertias(file.rig))
    return detect_changes(file.rig, healthy, record, settings, progress);
  if (file.diagnosis.waveform)
    return changes_of_rig(*file.diagnosis.waveform, healthy, record, settings, progress);
  throw CannotIdentify(
      "the rig file declares neither one inertia (mesh: rigid) nor two (rigid couplings, a free link) nor a "
      "pinion with a torque sensor: changes are found of these only; " +
      why_not(file));
}

}  // namespace backlash::changes
