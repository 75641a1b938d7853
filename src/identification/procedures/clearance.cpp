// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/clearance.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/clearance_flanks.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust_mean.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kCutoff = 3.85;      // simulation: times the frequency of the load on a flank
constexpr double kFineCutoff = 11.5;  // simulation: the same
constexpr double kStray = 0.02;       // choice: of the travel, deviation of a passage that fits
constexpr double kOutlier = 3;        // choice: of the median deviation
constexpr int kPushes[] = {2, 3};     // choice: degrees of the push over J
constexpr double kSlow = 0.2;         // choice: of the fastest: below it friction changes
constexpr double kSensitive = 0.05;   // choice: of the gap, between the two pushes: worth a warning
constexpr double kUncertain = 0.25;   // choice: of the gap: beyond which none is reported
constexpr double kFlanks = 1.3;       // simulation: by which flanks must better the fit
constexpr int kLeastSamples = 20;     // choice: of a passage

using Values = std::vector<double>;

/// From one turning point to the next.
struct Stretch {
  int begin, end;
};

struct Run {
  Values time, motor, relative, smooth, fine;  // load minus motor: raw and low-passed
  double interval = 0;
};

Run prepare(const record::Record& given, const ClearanceSettings& settings) {
  if (!given.has(record::Channel::motor_position) || !given.has(record::Channel::load_position))
    throw CannotIdentify("the clearance needs the positions of motor and load");
  const record::Record record = record::evenly_sampled(given);
  Run run;
  run.time = record.time;
  run.motor = record.column(record::Channel::motor_position);
  run.interval = record.sampling_interval();
  const Values& load = record.column(record::Channel::load_position);
  for (std::size_t i = 0; i < load.size(); ++i) run.relative.push_back(load[i] - run.motor[i]);
  run.smooth = signal::low_pass(run.relative, run.interval, std::min(settings.cutoff, 0.2 / run.interval));
  run.fine = signal::low_pass(run.relative, run.interval, std::min(settings.fine_cutoff, 0.4 / run.interval));
  return run;
}

/// The middle half of the travel with the contact time before and after it, inside the turning points;
/// `change` lies in the middle half, the travel reaches from `before` to `after`.
Stretch around(const Run& run, int change, int before, int after, double sign, double contact_time) {
  const auto at = [&](int i) { return sign * run.smooth[i]; };
  int first = change, last = change;
  for (int i = change; i >= before; --i)
    if (at(i) < at(first)) first = i;
  for (int i = change; i < after; ++i)
    if (at(i) > at(last)) last = i;
  const double travel = at(last) - at(first);
  int leaves = change, arrives = change;
  while (leaves > first && at(leaves) > at(first) + 0.25 * travel) --leaves;
  while (arrives < last && at(arrives) < at(last) - 0.25 * travel) ++arrives;
  double fastest = 0;
  for (int i = leaves; i < arrives; ++i) fastest = std::max(fastest, at(i + 1) - at(i));
  int begin = leaves, end = arrives;
  const int contact = int(contact_time / run.interval);
  while (begin > std::max(first, leaves - contact) && at(begin) - at(begin - 1) > kSlow * fastest) --begin;
  while (end < std::min(last, arrives + contact) && at(end + 1) - at(end) > kSlow * fastest) ++end;
  return {begin, end + 1};
}

/// Passages of the middle of the travel.
std::vector<Stretch> find_passages(const Run& run, double contact_time) {
  const double low = signal::quantile(run.smooth, 0.02), high = signal::quantile(run.smooth, 0.98);
  std::vector<int> changes;
  int side = 0;
  for (std::size_t i = 0; i < run.smooth.size(); ++i) {
    const double x = run.smooth[i];
    const int now = x > 0.3 * low + 0.7 * high ? 1 : x < 0.7 * low + 0.3 * high ? -1 : side;
    if (side != 0 && now != side) changes.push_back(int(i));
    side = now;
  }
  std::vector<Stretch> stretches;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    const int before = k > 0 ? changes[k - 1] : 0;
    const int after = k + 1 < changes.size() ? changes[k + 1] : int(run.smooth.size());
    const double sign = run.smooth[changes[k]] > 0.5 * (low + high) ? 1 : -1;  // upwards
    stretches.push_back(around(run, changes[k], before, after, sign, contact_time));
  }
  return stretches;
}

FlankPassage passage_of(const Run& run, const Stretch& s, int push) {
  const int n = s.end - s.begin;
  return {Eigen::Map<const Eigen::VectorXd>(run.relative.data() + s.begin, n),
          Eigen::Map<const Eigen::VectorXd>(run.fine.data() + s.begin, n), run.interval, push};
}

signal::Extent extent_of(const Values& values, const Stretch& s) {
  return signal::extent(values, static_cast<std::size_t>(s.begin), static_cast<std::size_t>(s.end));
}

/// One passage, with the contact that all passages share.
std::optional<GapPassage> measure(const Run& run, const Stretch& s, const FlankContact& contact, int push) {
  GapPassage p;
  p.time.assign(run.time.begin() + s.begin, run.time.begin() + s.end);
  p.measured.assign(run.relative.begin() + s.begin, run.relative.begin() + s.end);
  const auto [low, high] = extent_of(run.smooth, s);
  p.travel = high - low;
  p.motor_travel = extent_of(run.motor, s).size();
  try {
    const PassageFit fit = fit_flanks({passage_of(run, s, push)}, low, high, contact);
    p.lower = fit.flanks.lower;
    p.upper = fit.flanks.lower + fit.flanks.gap;
    p.gap = fit.gap;
    p.deviation = fit.deviation;
    for (std::size_t i = 0; i < p.measured.size(); ++i)
      p.fitted.push_back(p.measured[i] - fit.residuals[Eigen::Index(i)]);
    for (int i = s.begin + 1; i < s.end; ++i) {
      const double v = (run.smooth[i] - run.smooth[i - 1]) / run.interval;
      if (std::fabs(v) > std::fabs(p.speed)) p.speed = v;
    }
    const bool flies = low < p.lower && high > p.upper;  // a flank that is not touched is a guess
    return flies && p.deviation < kStray * p.travel ? std::optional(p) : std::nullopt;
  } catch (const CannotIdentify&) {
    return std::nullopt;
  }
}

double held_frequency(const ClearanceSettings& s) {
  const bool stiffness = std::isfinite(s.stiffness), inertia = std::isfinite(s.load_inertia);
  if (stiffness != inertia)
    throw InvalidParameter("load_inertia", s.load_inertia, "and stiffness must be given both or not at all");
  if (stiffness && s.stiffness <= 0) throw InvalidParameter("stiffness", s.stiffness, "must be > 0");
  if (inertia && s.load_inertia <= 0) throw InvalidParameter("load_inertia", s.load_inertia, "must be > 0");
  if (!(s.most_motor_travel > 0 && s.most_motor_travel < 1))
    throw InvalidParameter("most_motor_travel", s.most_motor_travel, "must be > 0 and < 1");
  if (s.least_passages < 2) throw InvalidParameter("least_passages", s.least_passages, "must be >= 2");
  return std::sqrt(s.stiffness / s.load_inertia);
}

void require_brake(const Run& run, const std::vector<Stretch>& stretches, double most) {
  int moving = 0;
  for (const Stretch& s : stretches)
    moving += extent_of(run.motor, s).size() > most * extent_of(run.smooth, s).size();
  if (2 * moving > int(stretches.size()))
    throw CannotIdentify(fmt::format(
        "the motor is not braked: in {} of {} passages it moves more than {:.4g} % of the load's travel",
        moving, stretches.size(), 100 * most));
}

struct Passages {
  std::vector<Stretch> stretches;
  std::vector<GapPassage> measured;
  PassageFit fit;
};

PassageFit fit_all(const Run& run, const std::vector<Stretch>& stretches, double stiffness, int push) {
  std::vector<FlankPassage> passages;
  Values lows, highs;
  for (const Stretch& s : stretches) {
    passages.push_back(passage_of(run, s, push));
    const auto [low, high] = extent_of(run.smooth, s);
    lows.push_back(low);
    highs.push_back(high);
  }
  FlankContact known;
  known.stiffness = stiffness;
  return fit_flanks(passages, signal::quantile(lows, 0.5), signal::quantile(highs, 0.5), known);
}

/// Fits all passages, leaves out those that do not fit, fits again.
Passages fit_without_outliers(const Run& run, std::vector<Stretch> stretches, double stiffness, int push,
                              int least) {
  Passages p;
  for (int round = 0;; ++round) {
    if (int(stretches.size()) < least)
      throw CannotIdentify(fmt::format("only {} passages are a free flight between two flanks; {} are needed",
                                       stretches.size(), least));
    p.fit = fit_all(run, stretches, stiffness, push);
    p.stretches.clear();
    p.measured.clear();
    Values deviations;
    std::vector<std::optional<GapPassage>> measured;
    for (const Stretch& s : stretches) {
      measured.push_back(measure(run, s, p.fit.contact, push));
      if (measured.back()) deviations.push_back(measured.back()->deviation);
    }
    const double most = deviations.empty() ? 0 : kOutlier * signal::quantile(deviations, 0.5);
    for (std::size_t i = 0; i < stretches.size(); ++i)
      if (measured[i] && measured[i]->deviation <= most) {
        p.stretches.push_back(stretches[i]);
        p.measured.push_back(*measured[i]);
      }
    const bool enough = int(p.stretches.size()) >= least;
    if (enough && (p.stretches.size() == stretches.size() || round == 3)) return p;
    stretches = p.stretches;
  }
}

/// Pushes that are no such polynomial show in the scatter of the passages, not in the noise.
signal::Measured gap_of(const Passages& p) {
  std::vector<signal::Measured> gaps;
  for (const GapPassage& passage : p.measured) gaps.push_back(passage.gap);
  return {p.fit.gap.value, std::max(p.fit.gap.standard_error, signal::robust_mean(gaps).standard_error)};
}

}  // namespace

ClearanceSettings clearance_settings(double stiffness, double load_inertia) {
  ClearanceSettings settings;
  settings.stiffness = stiffness;
  settings.load_inertia = load_inertia;
  const double contact = std::sqrt(stiffness / load_inertia) / (2 * M_PI);  // Hz
  settings.cutoff = kCutoff * contact;
  settings.fine_cutoff = kFineCutoff * contact;
  return settings;
}

Clearance identify_clearance(const record::Record& record, const ClearanceSettings& settings) {
  const double held = held_frequency(settings);
  const Run run = prepare(record, settings);
  std::vector<Stretch> stretches = find_passages(run, settings.contact_time);
  require_brake(run, stretches, settings.most_motor_travel);
  Clearance c;
  c.found = int(stretches.size());
  const auto unusable = [&](const Stretch& s) {
    return s.end - s.begin < kLeastSamples ||
           extent_of(run.motor, s).size() > settings.most_motor_travel * extent_of(run.smooth, s).size();
  };
  stretches.erase(std::remove_if(stretches.begin(), stretches.end(), unusable), stretches.end());
  std::vector<Passages> by_push;
  for (const int push : kPushes)
    by_push.push_back(fit_without_outliers(run, stretches, held * held, push, settings.least_passages));
  const signal::Measured gaps[] = {gap_of(by_push[0]), gap_of(by_push[1])};
  const double difference = std::fabs(gaps[0].value - gaps[1].value);
  const double noise = std::max(gaps[0].standard_error, gaps[1].standard_error);
  if (by_push[1].fit.without_flanks < kFlanks * by_push[1].fit.deviation)
    throw CannotIdentify(
        fmt::format("the load meets no flanks: its passages fit a slow push alone to {:.4g} rad, with flanks "
                    "to {:.4g} rad",
                    by_push[1].fit.without_flanks, by_push[1].fit.deviation));
  c.gap = {0.5 * (gaps[0].value + gaps[1].value), std::hypot(noise, difference)};
  if (c.gap.standard_error > kUncertain * c.gap.value)
    throw CannotIdentify(fmt::format(
        "the passages do not distinguish flank from push: {:.4g} rad with a parabola, {:.4g} rad with a "
        "cubic, error {:.4g} rad",
        gaps[0].value, gaps[1].value, noise));
  const Passages& p = by_push[1];
  c.passages = p.measured;
  c.lower = p.fit.flanks.lower;
  c.upper = c.lower + p.fit.flanks.gap;
  c.contact_frequency = std::sqrt(p.fit.contact.stiffness);
  c.damping_ratio = p.fit.contact.damping / (2 * c.contact_frequency);
  std::vector<signal::Measured> travels;
  for (const GapPassage& passage : c.passages) travels.push_back({passage.travel, passage.deviation});
  c.travel = signal::robust_mean(travels);
  if (2 * c.passages.size() < std::size_t(c.found))
    c.warnings.push_back(fmt::format("only {} of {} passages fit", c.passages.size(), c.found));
  if (p.fit.contact.damping == 0)
    c.warnings.emplace_back(
        "the load seems to meet no damping on the flanks: they are touched too softly, distrust the gap");
  if (difference > kSensitive * c.gap.value)
    c.warnings.push_back(fmt::format(
        "the gap depends on how the push is modelled: {:.4g} rad with a parabola, {:.4g} rad with a cubic",
        gaps[0].value, gaps[1].value));
  return c;
}

}  // namespace backlash::identification
