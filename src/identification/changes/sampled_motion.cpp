// SPDX-License-Identifier: BSD-3-Clause
#include "sampled_motion.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

struct EvenSamples {
  std::vector<double> torque, position;
  std::vector<char> there;
};

void check_stamps(const record::Record& record, const ChangeSettings& settings) {
  for (const record::Channel channel : {record::Channel::motor_torque, record::Channel::motor_position})
    if (!record.has(channel)) throw BadData(record.name, "has no " + record::channel_name(channel));
  for (std::size_t k = 1; k < record.size(); ++k)
    if (const double step = record.time[k] - record.time[k - 1]; !(step > 0) || step > settings.longest_gap)
      throw BadData(record.name, "the time jumps by " + to_text(step) +
                                     " s after t = " + to_text(record.time[k - 1]) + " s: at most " +
                                     to_text(settings.longest_gap) +
                                     " s; give the parts as records of their own");
}

EvenSamples even_samples(const record::Record& record, double interval, const ChangeSettings& settings) {
  const auto& torque = record.column(record::Channel::motor_torque);
  const auto& position = record.column(record::Channel::motor_position);
  const double gap = settings.gap * std::max(interval, record.sampling_interval());
  EvenSamples out;
  std::size_t j = 0;
  for (std::size_t i = 0;; ++i) {
    const double t = record.time.front() + double(i) * interval;
    if (t > record.time.back()) break;
    while (j + 2 < record.size() && record.time[j + 1] < t) ++j;
    const double step = record.time[j + 1] - record.time[j], u = (t - record.time[j]) / step;
    const double x = (1 - u) * torque[j] + u * torque[j + 1];
    const double q = (1 - u) * position[j] + u * position[j + 1];
    const bool there = step <= gap && std::isfinite(x) && std::isfinite(q);
    out.torque.push_back(std::isfinite(x) ? x : out.torque.empty() ? 0 : out.torque.back());
    out.position.push_back(std::isfinite(q) ? q : out.position.empty() ? 0 : out.position.back());
    out.there.push_back(there);
  }
  return out;
}

double median_of_three(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

/// Takes out single values that stick out of both neighbours as noise never does: one wrong reading would
/// outweigh an hour of right ones. What is taken out is not there.
void take_out_spikes(std::vector<double>& values, std::vector<char>& there, const ChangeSettings& settings) {
  const std::vector<double> raw = values;
  const auto middle = [&](std::size_t k) { return median_of_three(raw[k - 1], raw[k], raw[k + 1]); };
  double sum = 0;
  for (std::size_t k = 1; k + 1 < raw.size(); ++k) sum += std::fabs(raw[k] - middle(k));
  const double limit = settings.spike * sum / double(std::max<std::size_t>(raw.size(), 1));
  for (std::size_t k = 1; k + 1 < raw.size(); ++k)
    if (std::fabs(raw[k] - middle(k)) > limit) {
      values[k] = middle(k);
      there[k] = 0;
    }
}

/// Samples that are there and move, and have such about them for `guard`.
std::vector<char> usable(const SampledMotion& motion, const std::vector<char>& there, std::size_t guard,
                         const ChangeSettings& settings) {
  const std::size_t n = there.size();
  const double slow = settings.slow * motion.sampling.speed, fast = motion.sampling.fastest;
  std::vector<char> good(n, 1);
  for (std::size_t k = 0; k < n; ++k) {
    const double speed = std::fabs(motion.moments[k].speed);
    if (there[k] && speed > slow && (fast == 0 || speed < fast)) continue;
    // Filters ring for long after a jump of the position, which no motion is.
    const bool jump = fast > 0 && speed > settings.jump * fast;
    const std::size_t reach = jump ? settings.jump_guard * guard : guard;
    const std::size_t last = std::min(n, k + reach + 1);
    for (std::size_t i = k > reach ? k - reach : 0; i < last; ++i) good[i] = 0;
  }
  return good;
}

}  // namespace

MotionSampling sampling_of(const std::vector<const record::Record*>& records,
                           const ChangeSettings& settings) {
  MotionSampling s;
  for (const record::Record* r : records) {
    if (r->size() < 100)
      throw CannotIdentify(r->name + " has only " + std::to_string(r->size()) + " samples");
    s.interval = std::max(s.interval, r->sampling_interval());
  }
  s.cutoff = std::min(settings.cutoff, settings.cutoff_share / s.interval);
  s.position_cutoff = std::min(settings.position_cutoff, settings.position_cutoff_share / s.interval);
  return s;
}

SampledMotion sampled_motion(const record::Record& record, const MotionSampling& sampling,
                             const ChangeSettings& settings) {
  check_stamps(record, settings);
  const double dt = sampling.interval;
  EvenSamples even = even_samples(record, dt, settings);
  take_out_spikes(even.torque, even.there, settings);
  take_out_spikes(even.position, even.there, settings);
  const std::vector<double> position = signal::low_pass(even.position, dt, sampling.position_cutoff);
  const std::vector<double> speed = signal::derivative(position, dt);
  const std::vector<double> acceleration = signal::derivative(speed, dt);
  SampledMotion motion;
  motion.sampling = sampling;
  motion.start = record.time.front();
  const double turn = settings.friction_speed * sampling.speed;
  for (std::size_t k = 0; k < position.size(); ++k)
    motion.moments.push_back(
        {double(k) * dt, position[k], speed[k], acceleration[k], std::tanh(speed[k] / turn), 0});
  const auto guard = static_cast<std::size_t>(std::ceil(settings.guard / sampling.cutoff / dt));
  const std::vector<char> good = usable(motion, even.there, guard, settings);
  const auto stride =
      static_cast<std::size_t>(std::max(1.0, 1 / (dt * settings.rate_share * sampling.cutoff)));
  for (std::size_t k = 2; k + 2 < good.size(); k += stride)
    if (good[k]) motion.rows.push_back(k);
  motion.row_interval = dt * double(stride);
  if (double(motion.rows.size()) * motion.row_interval < settings.shortest)
    throw CannotIdentify(record.name + " moves for " +
                         to_text(double(motion.rows.size()) * motion.row_interval) +
                         " s in a way that can be judged; " + to_text(settings.shortest) + " s are needed");
  const std::vector<double> torque = signal::low_pass(even.torque, dt, sampling.cutoff);
  motion.torque.resize(motion.size());
  for (Eigen::Index i = 0; i < motion.size(); ++i)
    motion.torque[i] = torque[motion.rows[static_cast<std::size_t>(i)]];
  return motion;
}

Eigen::VectorXd column(const SampledMotion& motion, const std::function<double(const Moment&)>& f) {
  std::vector<double> all;
  all.reserve(motion.moments.size());
  for (const Moment& m : motion.moments) all.push_back(f(m));
  all = signal::low_pass(all, motion.sampling.interval, motion.sampling.cutoff);
  Eigen::VectorXd out(motion.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = all[motion.rows[static_cast<std::size_t>(i)]];
  return out;
}

}  // namespace backlash::identification
