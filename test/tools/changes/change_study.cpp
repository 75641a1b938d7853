// SPDX-License-Identifier: BSD-3-Clause
// How often a healthy joint is called changed, and how often the intervals of a change's onset and size hold:
// draws joints of one inertia, writes down their torque along random tasks, and looks as `change_watch` does.
// Deterministic for its arguments.
//
// Joints are inverse dynamics with gravity, friction that warms up and wanders by some percent, white noise;
// tasks are sums of three sines, with rests. Shares no code with the search but the record.
#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cmath>
#include <iostream>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "backlash_diagnosis/identification/changes/changes.h"

namespace backlash::change_study {
namespace {

using Random = std::mt19937_64;

constexpr double kLearn = 300, kWindow = 300, kInterval = 60;  // s
constexpr double kStream = 1800;                               // s, of one joint

struct Options {
  double hours = 0, rate = 1.0 / 720;  // h, 1/h
  int onsets = 0;
  unsigned long seed = 1;
  double sampling = 50;  // Hz
  double wander = 0.02;  // - of friction, up and down in ten minutes
};

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Torque that begins at a time.
struct Added {
  std::string effect;
  double since = 1e300, size = 0;
};

struct Joint {
  double inertia, viscous, coulomb, gravity, warm, cooling, noise, wander;
  Joint(Random& random, double wandering)
      : inertia(uniform(random, 0.3, 0.6)),
        viscous(uniform(random, 0.6, 1.5)),
        coulomb(uniform(random, 0.5, 1)),
        gravity(uniform(random, 1, 4)),
        warm(uniform(random, 0, 0.35)),
        cooling(uniform(random, 60, 150)),
        noise(uniform(random, 0.02, 0.06)),
        wander(wandering) {}

  /// `cold`: whether it begins so. Friction wanders up and down in ten minutes.
  record::Record record(Random& random, double duration, double rate, bool cold, bool rests,
                        const Added& added = {}) const {
    std::normal_distribution<double> white(0, noise);
    const double f[] = {uniform(random, 0.09, 0.13), uniform(random, 0.15, 0.2), uniform(random, 0.25, 0.33)},
                 a[] = {0.8, 0.6, 0.3}, phase = uniform(random, 0, 2 * M_PI);
    record::Record r;
    r.name = "made";
    double stamp = 0, next_rest = rests ? uniform(random, 200, 600) : 1e300;
    for (int k = 0; k < int(duration * rate); ++k) {
      const double t = k / rate;
      double q = 0, w = 0, acceleration = 0;
      for (int i = 0; i < 3; ++i) {
        const double o = 2 * M_PI * f[i], p = phase * (i + 1);
        q += a[i] * std::sin(o * t + p);
        w += a[i] * o * std::cos(o * t + p);
        acceleration -= a[i] * o * o * std::sin(o * t + p);
      }
      const double temperature = 1 + (cold ? warm * std::exp(-stamp / cooling) : 0) +
                                 wander * std::sin(2 * M_PI * stamp / 600 + phase);
      const double sign = w < 0 ? -1 : 1;
      double extra = 0;
      if (t >= added.since)
        extra = added.effect == "motor_coulomb"   ? added.size * sign
                : added.effect == "motor_viscous" ? added.size * w
                : added.effect == "motor_inertia" ? added.size * acceleration
                                                  : added.size * std::sin(q);
      r.time.push_back(stamp);
      r.column(record::Channel::motor_position).push_back(q);
      r.column(record::Channel::motor_torque)
          .push_back(inertia * acceleration + temperature * (viscous * w + coulomb * sign) +
                     gravity * std::sin(q) + extra + white(random));
      stamp += 1 / rate;
      if (t > next_rest) {  // nothing is published
        stamp += uniform(random, 20, 120);
        next_rest = t + uniform(random, 200, 600);
      }
    }
    return r;
  }
};

model::Rig one_inertia() {
  model::Rig rig;
  rig.mesh.rigid = true;
  return rig;
}

identification::ChangeSettings settings_of(double rate) {
  identification::ChangeSettings settings;
  settings.false_alarms_per_hour = rate;
  return settings;
}

diagnosis::ChangeLook look_of(const identification::Changes& found, double from, double to) {
  diagnosis::ChangeLook look;
  look.from = from;
  look.to = to;
  look.different = found.different;
  for (const identification::Change& c : found.changes) {
    diagnosis::FoundChange one;
    one.effect = c.effect;
    one.since = c.since;
    one.since_from = c.since_from;
    one.since_to = c.since_to;
    one.until = c.until;
    one.gain = c.gain;
    for (const identification::ChangeSize& s : c.size)
      one.size.push_back({s.name, s.unit, s.measured.value, s.measured.standard_error});
    look.changes.push_back(one);
  }
  return look;
}

/// Healthy joints, looked at each minute: how many changes one look found, how many were told.
void healthy(const Options& options) {
  Random random(options.seed);
  long looks = 0, cannot = 0, suspected = 0, told = 0, different = 0;
  double seconds = 0;
  const double rate = diagnosis::rate_of_look(options.rate, kWindow, kInterval, 1);
  while (seconds < 3600 * options.hours) {
    const Joint joint(random, options.wander);
    const std::vector<record::Record> learned = {joint.record(random, kLearn, options.sampling, true, false)};
    const record::Record stream = joint.record(random, kStream, options.sampling, false, true);
    diagnosis::ChangeLedger ledger;
    for (double to = kInterval; to < stream.time.back(); to += kInterval) {
      const double from = std::max(0.0, to - kWindow);
      ++looks;
      try {
        const auto found =
            identification::detect_changes(one_inertia(), learned, stream.slice(from, to), settings_of(rate));
        suspected += !found.changes.empty();
        ledger.take(look_of(found, from, to));
        different += !ledger.unexplained_difference().empty();
      } catch (const CannotIdentify&) {
        ++cannot;
      }
    }
    seconds += stream.time.back();
    for (const diagnosis::KnownChange& c : ledger.told()) {
      ++told;
      const double size = c.found.size.empty() ? 0 : c.found.size.front().value;
      fmt::print(
          "told: {} {:.3g}, gain {:.3g}, of a joint with {:.2g} N m dry and {:.2g} N m s/rad viscous "
          "friction\n",
          c.found.effect, size, c.found.gain, joint.coulomb, joint.viscous);
    }
  }
  fmt::print(
      "healthy: {:.1f} h, {} looks, {} cannot tell; {:.3g} false alarms allowed; looks that found one {}, "
      "changes told {}, looks with an unexplained difference {}\n",
      seconds / 3600, looks, cannot, options.rate * seconds / 3600, suspected, told, different);
}

/// Joints that change once: whether it is named, and whether the intervals hold the truth.
void onsets(const Options& options) {
  Random random(options.seed + 1000);
  const std::string effects[] = {"motor_coulomb", "motor_viscous", "motor_inertia", "gravity"};
  int found_any = 0, named = 0, onset = 0, size = 0, others = 0;
  double width = 0;
  for (int i = 0; i < options.onsets; ++i) {
    const Joint joint(random, options.wander);
    const std::string effect = effects[i % 4];
    const double of = effect == "motor_coulomb"   ? joint.coulomb
                      : effect == "motor_viscous" ? joint.viscous
                      : effect == "motor_inertia" ? joint.inertia
                                                  : joint.gravity;
    const Added added{effect, uniform(random, 60, 240), of * uniform(random, 0.15, 0.4)};
    const std::vector<record::Record> learned = {joint.record(random, kLearn, options.sampling, true, false)};
    const record::Record record = joint.record(random, kWindow, options.sampling, false, false, added);
    const auto found = identification::detect_changes(
        one_inertia(), learned, record,
        settings_of(diagnosis::rate_of_look(options.rate, kWindow, kInterval, 1)));
    found_any += !found.changes.empty();
    others += found.changes.size() > 1;
    for (const identification::Change& c : found.changes) {
      if (c.effect != effect) continue;
      ++named;
      onset += c.since_from <= added.since && added.since <= c.since_to;
      width += c.since_to - c.since_from;
      const signal::Measured& m = c.size.front().measured;
      size += std::fabs(m.value - added.size) <= 1.96 * m.standard_error;
      break;
    }
  }
  fmt::print(
      "onsets: {} changes, {} found, {} by their name, {} with others beside; of those named the interval "
      "of the onset holds {} ({:.1f} s wide on average), that of the size {}\n",
      options.onsets, found_any, named, others, onset, width / std::max(named, 1), size);
}

}  // namespace
}  // namespace backlash::change_study

int main(int argc, char** argv) {
  using namespace backlash::change_study;
  namespace po = boost::program_options;
  Options options;
  po::options_description all("change_study [options]");
  auto add = all.add_options();
  add("help,h", "this text");
  add("healthy-hours", po::value(&options.hours), "of healthy joints");
  add("false-alarms-per-hour", po::value(&options.rate), "that are allowed; default 1/720");
  add("onsets", po::value(&options.onsets), "joints that change once");
  add("rate", po::value(&options.sampling), "of the samples [Hz]; default 50");
  add("wander", po::value(&options.wander), "of friction, share up and down in ten minutes; default 0.02");
  add("seed", po::value(&options.seed), "default 1");
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, all), given);
    po::notify(given);
    if (given.count("help") != 0) {
      std::cout << all;
      return 0;
    }
    if (options.hours > 0) healthy(options);
    if (options.onsets > 0) onsets(options);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "change_study: " << error.what() << '\n';
    return 64;
  }
}
