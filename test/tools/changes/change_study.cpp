// SPDX-License-Identifier: BSD-3-Clause
// How often a healthy joint is called changed, and how often the intervals of a change's onset and size hold:
// draws joints of one inertia or two, writes down their torque along random tasks, and looks as
// `change_watch` does. Deterministic for its arguments.
//
// Joints are inverse dynamics with gravity, friction that warms up and wanders by some percent, white noise;
// tasks are sums of three sines, with rests. Shares no code with the search but the record.
#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cmath>
#include <iostream>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes.h"
#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "rig_study.h"
#include "window_study.h"

namespace backlash::change_study {
namespace {

using Random = std::mt19937_64;

constexpr double kLearn = 300, kWindow = 300, kInterval = 60;  // s
constexpr double kStream = 1800;                               // s, of one joint

struct Options {
  double hours = 0, rate = 1.0 / 720;  // h, 1/h
  int onsets = 0;
  long windows = 0;
  unsigned long seed = 1;
  double sampling = 50;  // Hz
  bool two = false;      // inertias
  double wander = 0.02;  // - of friction, up and down in ten minutes
};

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// A value that is larger from a time on.
struct Added {
  std::string effect;
  double since = 1e300, size = 0;

  double of(const char* value, double t) const { return t >= since && effect == value ? size : 0; }
};

/// Sums of sines.
class Task {
 public:
  explicit Task(Random& random)
      : f_{uniform(random, 0.09, 0.13), uniform(random, 0.15, 0.2), uniform(random, 0.25, 0.33)},
        phase_(uniform(random, 0, 2 * M_PI)) {}
  double phase() const { return phase_; }
  /// Position or a derivative of it.
  double operator()(double t, int order = 0) const {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      const double w = 2 * M_PI * f_[i];
      sum += kAmplitudes[i] * std::pow(w, order) * std::sin(w * t + phase_ * (i + 1) + order * M_PI / 2);
    }
    return sum;
  }

 private:
  static constexpr double kAmplitudes[] = {0.8, 0.6, 0.3};  // rad
  double f_[3], phase_;
};

double sign(double w) {
  return std::tanh(w / 0.01);
}

/// Of one inertia, or of two: then these are the load's, and a motor is before the gap, which is crossed
/// smoothly while the torque of the teeth turns.
struct Joint {
  double inertia, viscous, coulomb, gravity, warm, cooling, noise, wander;
  bool two = false;
  double motor_inertia = 0, motor_coulomb = 0, backlash = 0, compliance = 0;

  Joint(Random& random, const Options& options)
      : inertia(uniform(random, 0.3, 0.6)),
        viscous(uniform(random, 0.6, 1.5)),
        coulomb(uniform(random, 0.5, 1)),
        gravity(uniform(random, 1, 4)),
        warm(uniform(random, 0, 0.35)),
        cooling(uniform(random, 60, 150)),
        noise(uniform(random, 0.02, 0.06)),
        wander(options.wander),
        two(options.two) {
    if (!two) return;
    inertia *= 3;
    motor_inertia = inertia * uniform(random, 0.1, 0.6);
    motor_coulomb = coulomb * uniform(random, 1, 3);
    backlash = uniform(random, 2e-4, 1.5e-3);
    compliance = uniform(random, 2e-5, 1e-4);
  }

  /// `cold`: whether it begins so. Friction wanders up and down in ten minutes.
  record::Record record(Random& random, double duration, double rate, bool cold, bool rests,
                        const Added& added = {}) const {
    std::normal_distribution<double> white(0, noise), encoder(0, kEncoderNoise);
    const Task task(random);
    record::Record r;
    r.name = "made";
    double stamp = 0, next_rest = rests ? uniform(random, 200, 600) : 1e300;
    for (int k = 0; k < int(duration * rate); ++k) {
      const double t = k / rate;
      const double temperature = 1 + (cold ? warm * std::exp(-stamp / cooling) : 0) +
                                 wander * std::sin(2 * M_PI * stamp / 600 + task.phase());
      r.time.push_back(stamp);
      r.column(record::Channel::motor_position)
          .push_back(motor(task, t, temperature, added) + encoder(random));
      r.column(record::Channel::motor_torque).push_back(torque(task, t, temperature, added) + white(random));
      if (two) r.column(record::Channel::load_position).push_back(task(t) + encoder(random));
      stamp += 1 / rate;
      if (t > next_rest) {  // nothing is published
        stamp += uniform(random, 20, 120);
        next_rest = t + uniform(random, 200, 600);
      }
    }
    return r;
  }

  model::Rig rig() const {
    model::Rig rig;
    rig.mesh.rigid = !two;
    rig.motor.inertia = motor_inertia;
    rig.link.inertia = inertia;
    rig.link.coulomb_friction = coulomb;
    rig.link.viscous_damping = viscous;
    return rig;
  }

  /// What a change of an effect is measured by.
  double value(const std::string& effect) const {
    return effect == "motor_coulomb"    ? motor_coulomb + (two ? 0 : coulomb)
           : effect == "motor_viscous"  ? viscous
           : effect == "load_coulomb"   ? coulomb
           : effect == "gravity"        ? gravity
           : effect == "backlash"       ? backlash
           : effect == "mesh_stiffness" ? compliance
                                        : inertia;
  }

 private:
  static constexpr double kEncoderNoise = 2e-6, kTurn = 0.05;  // rad; N m over which the gap is crossed
  static constexpr double kStep = 1e-3;                        // s, of differences

  /// That the load takes.
  double load(const Task& task, double t, double temperature, const Added& a) const {
    const double q = task(t), w = task(t, 1);
    const double dry = coulomb + a.of("load_coulomb", t) + (two ? 0 : a.of("motor_coulomb", t));
    const double heavy = inertia + a.of("load_inertia", t) + a.of("motor_inertia", t);
    return heavy * task(t, 2) + temperature * (viscous * w + coulomb * sign(w)) +
           a.of("motor_viscous", t) * w + (dry - coulomb) * sign(w) +
           (gravity + a.of("gravity", t)) * std::sin(q);
  }
  double motor(const Task& task, double t, double temperature, const Added& a) const {
    if (!two) return task(t);
    const double bears = load(task, t, temperature, a);
    return task(t) + (backlash + a.of("backlash", t)) / 2 * std::tanh(bears / kTurn) +
           (compliance + a.of("mesh_stiffness", t)) * bears;
  }
  double torque(const Task& task, double t, double temperature, const Added& a) const {
    const double bears = load(task, t, temperature, a);
    if (!two) return bears;
    const double before = motor(task, t - kStep, temperature, a), now = motor(task, t, temperature, a),
                 after = motor(task, t + kStep, temperature, a);
    return bears + motor_inertia * (after - 2 * now + before) / (kStep * kStep) +
           (temperature * motor_coulomb + a.of("motor_coulomb", t)) * sign(task(t, 1));
  }
};

changes::ChangeSettings settings_of(double rate) {
  changes::ChangeSettings settings;
  settings.false_alarms_per_hour = rate;
  return settings;
}

diagnosis::ChangeLook look_of(const changes::Changes& found, double from, double to) {
  diagnosis::ChangeLook look;
  look.from = from;
  look.to = to;
  look.different = found.different;
  for (const changes::Change& c : found.changes) {
    diagnosis::FoundChange one;
    one.effect = c.effect;
    one.since = c.since;
    one.since_from = c.since_from;
    one.since_to = c.since_to;
    one.until = c.until;
    one.gain = c.gain;
    for (const changes::ChangeSize& s : c.size)
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
    const Joint joint(random, options);
    const std::vector<record::Record> learned = {joint.record(random, kLearn, options.sampling, true, false)};
    const record::Record stream = joint.record(random, kStream, options.sampling, false, true);
    diagnosis::ChangeLedger ledger;
    for (double to = kInterval; to < stream.time.back(); to += kInterval) {
      const double from = std::max(0.0, to - kWindow);
      ++looks;
      try {
        const auto found =
            changes::detect_changes(joint.rig(), learned, stream.slice(from, to), settings_of(rate));
        suspected += !found.changes.empty();
        cannot += found.changes.empty() && !found.cannot_tell.empty();
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
  const std::vector<std::string> effects =
      options.two ? std::vector<std::string>{"backlash", "motor_coulomb", "load_coulomb", "mesh_stiffness",
                                             "load_inertia"}
                  : std::vector<std::string>{"motor_coulomb", "motor_viscous", "motor_inertia", "gravity"};
  int found_any = 0, named = 0, onset = 0, size = 0, others = 0;
  double width = 0;
  for (int i = 0; i < options.onsets; ++i) {
    const Joint joint(random, options);
    const std::string& effect = effects[static_cast<std::size_t>(i) % effects.size()];
    const Added added{effect, uniform(random, 60, 240), joint.value(effect) * uniform(random, 0.15, 0.4)};
    const std::vector<record::Record> learned = {joint.record(random, kLearn, options.sampling, true, false)};
    const record::Record record = joint.record(random, kWindow, options.sampling, false, false, added);
    const auto found =
        changes::detect_changes(joint.rig(), learned, record,
                                settings_of(diagnosis::rate_of_look(options.rate, kWindow, kInterval, 1)));
    found_any += !found.changes.empty();
    others += found.changes.size() > 1;
    for (const changes::Change& c : found.changes)
      if (c.effect != effect)
        fmt::print("told {} ({}) at {:.1f} s, gain {:.3g}; true: {} at {:.1f} s\n", c.effect,
                   fmt::join(c.alike, " "), c.since, c.gain, effect, added.since);
    for (const changes::Change& c : found.changes) {
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
  RigStudy rigs;
  bool torque_alone = false;
  po::options_description all("change_study [options]");
  auto add = all.add_options();
  add("help,h", "this text");
  add("healthy-hours", po::value(&options.hours), "of healthy joints");
  add("false-alarms-per-hour", po::value(&options.rate), "that are allowed; default 1/720");
  add("onsets", po::value(&options.onsets), "joints that change once");
  add("windows", po::value(&options.windows), "of scores: false alarms, and delays beside a CUSUM");
  add("rate", po::value(&options.sampling), "of the samples [Hz]; default 50");
  add("two", po::bool_switch(&options.two), "inertias, with an encoder on either side, of each joint");
  add("wander", po::value(&options.wander), "of friction, share up and down in ten minutes; default 0.02");
  add("rig", po::value(&rigs.rig), "file of a rig with a torque sensor, instead: machines like it");
  add("rig-change", po::value(&rigs.only), "of such rigs, by its name; default: all");
  add("torque-alone", po::bool_switch(&torque_alone), "of such rigs, no position");
  add("seed", po::value(&options.seed), "default 1");
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, all), given);
    po::notify(given);
    if (given.count("help") != 0) {
      std::cout << all;
      return 0;
    }
    if (!rigs.rig.empty()) {
      rigs.changes = options.onsets, rigs.healthy_hours = options.hours, rigs.rate = options.rate;
      rigs.position = !torque_alone, rigs.seed = options.seed;
      study_rigs(rigs);
      return 0;
    }
    if (options.hours > 0) healthy(options);
    if (options.onsets > 0) onsets(options);
    if (options.windows > 0) study_windows(options.windows, options.seed);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "change_study: " << error.what() << '\n';
    return 64;
  }
}
