// SPDX-License-Identifier: BSD-3-Clause
#include "sampled_motion.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::changes {
namespace {

constexpr double kThinned = 0.25;  // - of the rate that is kept, where its filter ends. Theory: below a half

constexpr double kLongSince = 1e3;  // rad, since a reversal that was before the record

struct EvenSamples {
  std::vector<double> torque, position, deflection, chain;
  std::vector<char> there;
};

bool needs_load(const MotionSampling& sampling) {
  return sampling.behind > 0 || sampling.channel == ChangeChannel::deflection;
}

void check_record(const record::Record& record, bool load, const ChangeSettings& settings) {
  std::vector<record::Channel> channels = {record::Channel::motor_torque, record::Channel::motor_position};
  if (load) channels.push_back(record::Channel::load_position);
  for (const record::Channel channel : channels)
    if (!record.has(channel)) throw BadData(record.name, "has no " + record::channel_name(channel));
  for (std::size_t k = 1; k < record.size(); ++k)
    if (const double step = record.time[k] - record.time[k - 1]; !(step > 0) || step > settings.longest_gap)
      throw BadData(record.name, "the time jumps by " + to_text(step) +
                                     " s after t = " + to_text(record.time[k - 1]) + " s: at most " +
                                     to_text(settings.longest_gap) +
                                     " s; give the parts as records of their own");
}

/// The value before, where there is none.
void hold(std::vector<double>& values, double next) {
  values.push_back(std::isfinite(next) ? next : values.empty() ? 0 : values.back());
}

EvenSamples even_samples(const record::Record& record, double interval, const MotionSampling& sampling,
                         const ChangeSettings& settings) {
  const auto& torque = record.column(record::Channel::motor_torque);
  const auto& position = record.column(record::Channel::motor_position);
  const auto& load_position = needs_load(sampling) ? record.column(record::Channel::load_position) : position;
  const auto& chain = record.column(record::Channel::output_torque);
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
    const double d = q - (1 - u) * load_position[j] - u * load_position[j + 1];
    hold(out.torque, x);
    hold(out.position, q);
    hold(out.deflection, d);
    hold(out.chain, sampling.chain ? (1 - u) * chain[j] + u * chain[j + 1] : 0);
    out.there.push_back(step <= gap && std::isfinite(x) && std::isfinite(q) && std::isfinite(d));
  }
  return out;
}

double median_of_three(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

/// Takes out single values that stick out of both neighbours as noise never does: one wrong reading would
/// outweigh an hour of right ones. Such a value becomes a lost sample.
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

/// Whether the teeth rest on the flank that they rested on before.
bool rests_on_flank(const SampledMotion& motion, std::size_t k) {
  if (!motion.sampling.mesh || k == 0) return true;
  const Moment &now = motion.moments[k], &before = motion.moments[k - 1];
  if (now.side() != before.side()) return false;
  return motion.sampling.channel == ChangeChannel::torque ||
         std::fabs(now.mesh) > motion.sampling.mesh->least;
}

/// Samples that are present, move and rest on a flank, as do those within `guard` about them.
std::vector<char> usable(const SampledMotion& motion, const std::vector<char>& there, std::size_t guard,
                         const ChangeSettings& settings) {
  const std::size_t n = there.size();
  const double slow = settings.slow * motion.sampling.speed, fast = motion.sampling.fastest;
  const double hard = motion.sampling.hardest;
  std::vector<char> good(n, 1);
  for (std::size_t k = 0; k < n; ++k) {
    const double speed = std::fabs(motion.moments[k].speed);
    const double pull = std::fabs(motion.moments[k].acceleration);
    const bool known = fast == 0 || (speed < fast && pull < hard);
    if (there[k] && speed > slow && known && rests_on_flank(motion, k)) continue;
    // Filters ring for long after a jump of the position that no motion makes.
    const bool jump = fast > 0 && (speed > settings.jump * fast || pull > settings.jump * hard);
    const std::size_t reach = jump ? settings.jump_guard * guard : guard;
    const std::size_t last = std::min(n, k + reach + 1);
    for (std::size_t i = k > reach ? k - reach : 0; i < last; ++i) good[i] = 0;
  }
  return good;
}

/// Every n-th sample, after a filter that takes away what they would show as slower motion.
void thin(std::vector<double>& values, std::size_t n, double interval) {
  const std::vector<double> slow = signal::low_pass(values, interval, kThinned / (double(n) * interval));
  values.clear();
  for (std::size_t k = 0; k < slow.size(); k += n) values.push_back(slow[k]);
}

void thin(EvenSamples& even, std::size_t n, double interval) {
  if (n == 1) return;
  for (std::vector<double>* values : {&even.torque, &even.position, &even.deflection, &even.chain})
    thin(*values, n, interval);
  std::vector<char> there;
  for (std::size_t k = 0; k < even.there.size(); k += n) {
    const std::size_t from = k > n ? k - n : 0, to = std::min(even.there.size(), k + n);
    there.push_back(std::all_of(&even.there[from], &even.there[0] + to, [](char c) { return c != 0; }));
  }
  even.there = there;
}

void add_moments(const EvenSamples& even, const ChangeSettings& settings, SampledMotion& motion) {
  const MotionSampling& sampling = motion.sampling;
  const double dt = sampling.interval, turn = settings.friction_speed * sampling.speed;
  const auto filtered = [&](const std::vector<double>& values) {
    return signal::low_pass(values, dt, sampling.position_cutoff);
  };
  const std::vector<double> position = filtered(even.position), speed = signal::derivative(position, dt),
                            acceleration = signal::derivative(speed, dt),
                            jerk = signal::derivative(acceleration, dt);
  const std::vector<double> parting =
      signal::derivative(signal::derivative(filtered(even.deflection), dt), dt);
  double way = kLongSince;
  for (std::size_t k = 0; k < position.size(); ++k) {
    if (k > 0) way = speed[k] * speed[k - 1] < 0 ? 0 : way + std::fabs(position[k] - position[k - 1]);
    Moment m = {double(k) * dt,
                position[k],
                speed[k],
                acceleration[k] - sampling.behind * parting[k],
                jerk[k],
                std::tanh(speed[k] / turn),
                way,
                0,
                0,
                0,
                0,
                0,
                even.chain[k],
                0,
                {}};
    if (const auto& mesh = sampling.mesh)
      m.mesh = mesh->inertia * (acceleration[k] - parting[k]) + mesh->viscous * m.speed +
               mesh->coulomb * m.direction + mesh->cosine * std::cos(m.position) +
               mesh->sine * std::sin(m.position) + m.chain;
    motion.moments.push_back(m);
  }
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
  s.thinned = static_cast<std::size_t>(std::max(1.0, std::floor(1 / (s.interval * settings.most_rate))));
  s.interval *= double(s.thinned);
  s.cutoff = std::min(settings.cutoff, settings.cutoff_share / s.interval);
  s.position_cutoff = std::min(settings.position_cutoff, settings.position_cutoff_share / s.interval);
  return s;
}

SampledMotion sampled_motion(const record::Record& record, const MotionSampling& sampling,
                             const ChangeSettings& settings) {
  const bool load = needs_load(sampling);
  check_record(record, load, settings);
  const double dt = sampling.interval;
  const double own = dt / double(sampling.thinned);
  EvenSamples even = even_samples(record, own, sampling, settings);
  take_out_spikes(even.torque, even.there, settings);
  take_out_spikes(even.position, even.there, settings);
  if (load) take_out_spikes(even.deflection, even.there, settings);
  thin(even, sampling.thinned, own);
  SampledMotion motion;
  motion.sampling = sampling;
  motion.start = record.time.front();
  if (record.unsure_time > 0) motion.unsure_time = record.unsure_time;
  add_moments(even, settings, motion);
  const auto guard = static_cast<std::size_t>(std::ceil(settings.guard / sampling.cutoff / dt));
  const std::vector<char> good = usable(motion, even.there, guard, settings);
  const auto stride =
      static_cast<std::size_t>(std::max(1.0, 1 / (dt * settings.rate_share * sampling.cutoff)));
  for (std::size_t k = guard; k + guard < good.size(); k += stride)
    if (good[k]) motion.rows.push_back(k);
  motion.row_interval = dt * double(stride);
  const bool torque = sampling.channel == ChangeChannel::torque;
  const double usable_time = double(motion.rows.size()) * motion.row_interval;
  const double shortest = !torque          ? settings.shortest_pressed
                          : sampling.chain ? settings.shortest_of_arm
                          : sampling.mesh  ? settings.shortest_of_two
                                           : settings.shortest;
  if (usable_time < shortest)
    throw CannotIdentify(
        record.name + " moves for " + to_text(usable_time) + " s in a way that can be judged" +
        (torque ? "" : ", its teeth pressed for certain") + "; " + to_text(shortest) + " s are needed");
  const auto target = signal::low_pass(torque ? even.torque : even.deflection, dt, sampling.cutoff);
  motion.target.resize(motion.size());
  for (Eigen::Index i = 0; i < motion.size(); ++i)
    motion.target[i] = target[motion.rows[static_cast<std::size_t>(i)]];
  return motion;
}

Eigen::MatrixXd filtered(const SampledMotion& motion, Eigen::MatrixXd columns) {
  signal::low_pass_columns(columns, motion.sampling.interval, motion.sampling.cutoff);
  Eigen::MatrixXd out(motion.size(), columns.cols());
  for (Eigen::Index c = 0; c < out.cols(); ++c)
    for (Eigen::Index r = 0; r < out.rows(); ++r)
      out(r, c) = columns(static_cast<Eigen::Index>(motion.rows[static_cast<std::size_t>(r)]), c);
  return out;
}

Eigen::MatrixXd columns(const SampledMotion& motion,
                        const std::vector<std::function<double(const Moment&)>>& f) {
  Eigen::MatrixXd all(motion.moments.size(), f.size());
  for (std::size_t c = 0; c < f.size(); ++c)
    for (std::size_t k = 0; k < motion.moments.size(); ++k)
      all(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(c)) = f[c](motion.moments[k]);
  return filtered(motion, std::move(all));
}

Eigen::VectorXd column(const SampledMotion& motion, const std::function<double(const Moment&)>& f) {
  return columns(motion, {f});
}

}  // namespace backlash::changes
