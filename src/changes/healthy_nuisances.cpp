// SPDX-License-Identifier: BSD-3-Clause
// What a healthy machine may show to some degree: it wanders, warms up otherwise, and cools down at rest.
#include <algorithm>
#include <cmath>

#include "healthy_columns.h"
#include "healthy_model.h"

namespace backlash::changes {
namespace {

constexpr double kOtherWarmUp = 0.2;   // - of its time, by which another warm-up differs. Choice
constexpr double kMostBeside = 3;      // of dry friction, that another part of it may be. Choice: it is none
constexpr std::size_t kMostRests = 8;  // of a record, the longest. Choice
constexpr double kLeastSpread = 1e-9;  // so that all can be divided by

struct Rest {
  double from, to;  // s, without motion
};

/// The longest ones.
std::vector<Rest> rests_of(const SampledMotion& motion, const ChangeSettings& settings) {
  std::vector<Rest> rests;
  for (Eigen::Index r = 1; r < motion.size(); ++r)
    if (motion.time(r) - motion.time(r - 1) > settings.rest)
      rests.push_back({motion.time(r - 1), motion.time(r)});
  std::sort(rests.begin(), rests.end(),
            [](const Rest& a, const Rest& b) { return a.to - a.from > b.to - b.from; });
  if (rests.size() > kMostRests) rests.resize(kMostRests);
  return rests;
}

/// An effect that a healthy machine may show to some degree: its column, and the standard deviation of its
/// values.
struct Nuisances {
  std::vector<OfMoment> columns;
  std::vector<double> spread;
  Eigen::Index wanders = 0;  // how many of the columns, the first ones, are of what wanders

  void add(OfMoment column, double of_values) {
    columns.push_back(std::move(column));
    spread.push_back(std::max(of_values, kLeastSpread));
  }
};

/// Dry friction of the healthy machine over that of fast motion: what it shows beside is a part of it, and
/// comes and goes with the same temperature and oil.
OfMoment dry_friction(const HealthyModel& model) {
  std::vector<std::pair<double, OfMoment>> parts;
  Eigen::Index i = kWarmCoulomb + 1;
  for (const ChangeEffect& e : model.further)
    for (const OfMoment& f : e.columns()) {
      const double share = model.values[i++] / model.values[kCoulomb];
      if (e.rubs && std::fabs(share) < kMostBeside) parts.emplace_back(share, f);
    }
  return [parts](const Moment& m) {
    double sum = m.direction;
    for (const auto& [share, f] : parts) sum += share * f(m);
    return sum;
  };
}

/// What wanders, straight between knots: dry and viscous friction; both flanks and the gap between them.
void add_wander(const HealthyModel& model, double length, const ChangeSettings& settings, Nuisances& out) {
  const bool torque = model.sampling.channel == ChangeChannel::torque;
  const auto share = [&](int k) { return settings.wander * std::fabs(model.values[k]); };
  const double first = torque ? share(kCoulomb) : share(kHalfGap);
  const double second = torque ? share(kViscous) : first;
  const OfMoment flank = [](const Moment& m) { return m.side(); };
  const OfMoment rubbing = torque ? dry_friction(model) : flank;
  const int cells = std::max(1, static_cast<int>(std::lround(length / settings.wander_time)));
  for (int k = 0; k <= cells; ++k) {
    const auto hat = [=](const Moment& m) {
      return std::max(0.0, 1 - std::fabs(m.time / length * cells - k));
    };
    out.add([=](const Moment& m) { return rubbing(m) * hat(m); }, first);
    out.add([=](const Moment& m) { return (torque ? m.speed : 1) * hat(m); }, second);
  }
}

/// In the equation dry friction alone warms up, with one time constant. The rest warms up too, more or less,
/// and differently each day.
void add_warm_rest(const HealthyModel& model, Nuisances& out) {
  const double warm_up = model.warm_up;
  const double share = std::fabs(model.values[kWarmCoulomb] / model.values[kCoulomb]);
  const auto slower = [=](const Moment& m) { return m.time / warm_up * std::exp(-m.time / warm_up); };
  out.add([=](const Moment& m) { return m.direction * slower(m); },
          kOtherWarmUp * std::fabs(model.values[kWarmCoulomb]));
  out.add([=](const Moment& m) { return m.speed * slower(m); },
          kOtherWarmUp * std::fabs(model.values[kWarmViscous]));
  Eigen::Index i = kWarmCoulomb + 1;
  for (const ChangeEffect& e : model.further)
    for (const OfMoment& f : e.columns()) {
      const double spread = std::min(share, 1.0) * std::fabs(model.values[i++]);
      if (e.rubs) out.add([=](const Moment& m) { return f(m) * std::exp(-m.time / warm_up); }, spread);
    }
}

/// At rest the machine cools down, and warms up again after; or the clock was set.
void add_rest(const HealthyModel& model, const Rest& rest, Nuisances& out) {
  const double warm_up = model.warm_up, end = rest.to;
  const auto cooled = [=](const Moment& m) { return m.time < end ? 0 : std::exp(-(m.time - end) / warm_up); };
  const double share = 1 - std::exp(-(rest.to - rest.from) / warm_up);
  const OfMoment rubbing = dry_friction(model);
  out.add([=](const Moment& m) { return rubbing(m) * cooled(m); }, share * model.spread[kWarmCoulomb]);
  out.add([=](const Moment& m) { return m.speed * cooled(m); }, share * model.spread[kWarmViscous]);
}

Nuisances nuisances_of(const HealthyModel& model, const SampledMotion& motion,
                       const ChangeSettings& settings) {
  Nuisances out;
  const double length = motion.moments.back().time;
  const bool torque = motion.sampling.channel == ChangeChannel::torque;
  add_wander(model, length, settings, out);
  if (torque) out.add([=](const Moment& m) { return m.direction * (m.time / length - 0.5); }, model.drift);
  out.wanders = static_cast<Eigen::Index>(out.columns.size());
  if (!torque) return out;
  add_warm_rest(model, out);
  if (motion.sampling.chain) out.add([](const Moment& m) { return m.chain; }, settings.chain_share);
  for (const Rest& rest : rests_of(motion, settings)) add_rest(model, rest, out);
  return out;
}

}  // namespace

Whitened residual_of(const HealthyModel& model, const SampledMotion& motion, const ChangeSettings& settings) {
  Eigen::MatrixXd known = base_columns(motion, model.warm_up);
  for (const ChangeEffect& e : model.further) known = beside(known, *effect_columns(motion, e));
  Whitened out;
  out.residual = motion.target - known * model.values;
  const Nuisances more = nuisances_of(model, motion, settings);
  out.nuisances = beside(known, columns(motion, more.columns));
  out.wander = known.cols();
  out.wanders = more.wanders;
  const auto count = static_cast<Eigen::Index>(more.spread.size());
  out.spread.resize(model.spread.size() + count);
  out.spread << model.spread, Eigen::Map<const Eigen::VectorXd>(more.spread.data(), count);
  return out;
}

}  // namespace backlash::changes
