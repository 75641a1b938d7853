// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/push.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::arm {
namespace {

/// One joint at rest: its signal as means of a few samples.
struct Hold {
  const std::vector<double>& time;
  std::vector<double> smooth;
  double noise = 0;  // deviation of `smooth` in the quiet beginning
  std::size_t quiet = 0;
};

std::vector<double> means(const std::vector<double>& s, std::size_t count) {
  std::vector<double> out(s.size());
  double sum = 0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    sum += s[k] - (k >= count ? s[k - count] : 0);
    out[k] = sum / double(std::min(k + 1, count));
  }
  return out;
}

double mean(const std::vector<double>& s, std::size_t from, std::size_t to) {
  return std::accumulate(s.begin() + long(from), s.begin() + long(to), 0.0) / double(to - from);
}

Hold hold_of(const record::Record& joint, record::Channel channel, const PushSettings& settings) {
  Hold h{joint.time, means(joint.column(channel), std::size_t(settings.samples)), 0, 0};
  while (h.quiet < h.time.size() && h.time[h.quiet] < h.time.front() + settings.quiet) ++h.quiet;
  const double level = mean(h.smooth, 0, h.quiet);
  double square = 0;
  for (std::size_t k = 0; k < h.quiet; ++k) square += (h.smooth[k] - level) * (h.smooth[k] - level);
  h.noise = std::sqrt(square / double(h.quiet));
  return h;
}

/// Whether the signal changes faster around each sample than a drive at rest does.
std::vector<char> activity(const Hold& h, const PushSettings& settings) {
  std::vector<char> active(h.time.size(), 0);
  std::size_t from = 0;
  for (std::size_t k = 0; k < h.time.size(); ++k) {
    while (h.time[from] < h.time[k] - settings.window) ++from;
    const signal::Extent extent = signal::extent(h.smooth, from, k + 1);
    active[k] = extent.size() / 2 > settings.active * h.noise;
  }
  return active;
}

/// Where the signal is at rest for long enough from `k` on; the end of the record where it never is.
std::size_t rest_from(const Hold& h, const std::vector<char>& active, std::size_t k, double between) {
  std::size_t start = k;
  for (; k < active.size(); ++k) {
    if (active[k])
      start = k + 1;
    else if (h.time[k] - h.time[start] >= between)
      return start;
  }
  return active.size();
}

/// s, when a mean before `k` was last within the noise; all samples of that mean are before.
double last_within(const Hold& h, std::size_t k, double level, const PushSettings& settings) {
  while (k > 0 && std::fabs(h.smooth[k] - level) > settings.within * h.noise) --k;
  return h.time[k - std::min(k, std::size_t(settings.samples))];
}

std::vector<PushEvent> events(const Hold& h, std::size_t joint, double constant,
                              const PushSettings& settings) {
  const std::vector<char> active = activity(h, settings);
  std::vector<PushEvent> found;
  double level = mean(h.smooth, 0, h.quiet);
  std::size_t level_from = 0;
  for (std::size_t k = h.quiet; k < h.time.size(); ++k) {
    while (h.time[level_from] < h.time[k] - settings.quiet - settings.window) ++level_from;
    std::size_t level_to = level_from + 1;
    while (level_to < k && h.time[level_to] < h.time[k] - settings.window) ++level_to;
    if (level_to > level_from + 1) level = mean(h.smooth, level_from, level_to);
    if (!(std::fabs(h.smooth[k] - level) > settings.onset * h.noise) || !active[k]) continue;
    const std::size_t end = rest_from(h, active, k, settings.between);
    PushEvent e;
    e.joint = joint;
    e.begin =
        h.time[k - std::min(k, std::size_t(settings.samples / 2))];  // a mean is late by half of its samples
    e.earliest = last_within(h, k, level, settings);
    e.clear = std::fabs(h.smooth[k] - level) / h.noise;
    e.released = end < h.time.size();
    e.end = e.released ? h.time[end] : h.time.back();
    for (std::size_t i = k; i < end; ++i)
      if (std::fabs(h.smooth[i] - level) > std::fabs(e.torque)) e.torque = h.smooth[i] - level;
    std::size_t after = end;
    while (after < h.time.size() && h.time[after] < e.end + settings.between) ++after;
    e.left = e.released ? constant * (mean(h.smooth, end, after) - level) : 0;
    e.torque *= constant;
    e.torque_error = std::hypot(constant * h.noise, e.left);
    found.push_back(e);
    if (!e.released) break;
    level_from = end;
    k = after;
    if (k < h.time.size()) level = mean(h.smooth, end, after);
  }
  return found;
}

bool holds(const record::Record& joint, const PushSettings& settings) {
  const double interval = joint.sampling_interval();
  const std::vector<double>& speed = joint.column(record::Channel::motor_velocity);
  const std::vector<double> v =
      speed.empty() ? signal::derivative(joint.column(record::Channel::motor_position), interval) : speed;
  return std::all_of(v.begin(), v.end(), [&](double x) { return std::fabs(x) < settings.rest; });
}

}  // namespace

bool holds_pose(const ArmRecord& record, const PushSettings& settings) {
  return std::all_of(record.joints.begin(), record.joints.end(),
                     [&](const record::Record& joint) { return holds(joint, settings); });
}

std::vector<PushEvent> pushes(const ArmRecord& record, const ArmRig& rig, const PushSettings& settings) {
  std::vector<PushEvent> all;
  for (std::size_t j = 0; j < record.joints.size(); ++j) {
    const record::Record& joint = record.joints[j];
    if (!holds(joint, settings) || joint.time.back() - joint.time.front() < 3 * settings.quiet) continue;
    const Hold h = hold_of(joint, rig.channel, settings);
    if (!(h.noise > 0)) continue;  // a constant: no sensor
    const JointDrive& drive = rig.joints[j];
    const double scale = std::hypot(rig.common_error, drive.constant_error);
    for (PushEvent e : events(h, j, drive.constant, settings)) {
      e.torque_error = std::hypot(e.torque_error, scale * e.torque);
      all.push_back(e);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const PushEvent& a, const PushEvent& b) {
    return a.begin != b.begin ? a.begin < b.begin : a.clear > b.clear;
  });
  return all;
}

}  // namespace backlash::arm
