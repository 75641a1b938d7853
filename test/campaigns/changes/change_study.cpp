// SPDX-License-Identifier: BSD-3-Clause
// How often a healthy joint is called changed, and how often the intervals of a change's onset and size hold:
// draws joints of one inertia or two, writes down their torque along random tasks, and looks as
// `change_watch` does. Deterministic for its arguments.
#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "arm_study.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes.h"
#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "made_joint.h"
#include "onset_study.h"
#include "rig_study.h"
#include "window_study.h"

namespace backlash::change_study {
namespace {

constexpr double kLearn = 300, kWindow = 300, kInterval = 60;  // s
constexpr double kStream = 1800;                               // s, of one joint

struct Options {
  double hours = 0, rate = 1.0 / 720;  // h, 1/h
  bool apart = false;
  OnsetOptions onsets;
  int arms = 0;
  bool rough = false;
  long windows = 0;
  unsigned long seed = 1;
  MadeOptions made;
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

/// Healthy joints, looked at each minute: how many changes one look found, how many were reported.
void healthy(const Options& options) {
  Random random(options.seed);
  long looks = 0, cannot = 0, suspected = 0, reported = 0, different = 0;
  double seconds = 0;
  const double rate = diagnosis::rate_of_look(options.rate, kWindow, kInterval, 1);
  while (seconds < 3600 * options.hours) {
    const Joint joint(random, options.made);
    const std::vector<record::Record> learned = {joint.record(random, kLearn, true, false)};
    const record::Record stream = joint.record(random, kStream, false, true);
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
    for (const diagnosis::KnownChange& c : ledger.reported()) {
      ++reported;
      const double size = c.found.size.empty() ? 0 : c.found.size.front().value;
      fmt::print(
          "reported: {} {:.3g}, gain {:.3g}, of a joint with {:.2g} N m dry and {:.2g} N m s/rad viscous "
          "friction\n",
          c.found.effect, size, c.found.gain, joint.coulomb, joint.viscous);
    }
  }
  fmt::print(
      "healthy: {:.1f} h, {} looks, {} cannot tell; {:.3g} false alarms allowed; looks that found one {}, "
      "changes reported {}, looks with an unexplained difference {}\n",
      seconds / 3600, looks, cannot, options.rate * seconds / 3600, suspected, reported, different);
}

/// The samples of so much motion, rests among them.
record::Record slice_of_motion(const record::Record& stream, double from, double sampling) {
  const auto first = static_cast<std::size_t>(std::lround(from * sampling));
  const auto last =
      std::min(stream.size(), first + static_cast<std::size_t>(std::lround(kWindow * sampling))) - 1;
  return stream.slice(stream.time[first], stream.time[last]);
}

/// Looks at healthy joints that share no sample, six to a joint, each by itself: what one look finds is an
/// alarm. A look may be wrong `rate` times an hour.
void healthy_apart(const Options& options) {
  Random random(options.seed);
  long looks = 0, wrong = 0, cannot = 0, windows = 0;
  while (double(looks) * kWindow < 3600 * options.hours) {
    const Joint joint(random, options.made);
    const std::vector<record::Record> learned = {joint.record(random, kLearn, true, false)};
    const record::Record stream = joint.record(random, kStream, true, true);
    for (double from = 0; from + kWindow <= kStream; from += kWindow) {
      const record::Record look = slice_of_motion(stream, from, options.made.sampling);
      const changes::Changes found =
          changes::detect_changes(joint.rig(), learned, look, settings_of(options.rate));
      ++looks;
      windows += static_cast<long>(found.windows);
      wrong += !found.changes.empty();
      cannot += found.changes.empty() && !found.cannot_tell.empty();
      for (const changes::Change& c : found.changes)
        fmt::print("look {}: {} since {:.1f} s, gain {:.3g} of {:.3g}\n", looks, c.effect, c.since, c.gain,
                   found.threshold);
    }
    if (looks % 60 == 0) {
      fmt::print("{} looks, {} wrong, {} cannot tell\n", looks, wrong, cannot);
      std::fflush(stdout);
    }
  }
  fmt::print(
      "healthy, looks that share nothing: {} looks at {} windows; {:.4g} false alarms allowed, {} found, {} "
      "cannot tell\n",
      looks, windows, options.rate * kWindow / 3600 * double(looks), wrong, cannot);
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
  add("apart", po::bool_switch(&options.apart), "looks that share no samples, each an alarm by itself");
  add("onsets", po::value(&options.onsets.count), "joints that change once");
  add("arms", po::value(&options.arms), "of six joints, healthy, and as many for each kind of change");
  add("only", po::value(&options.onsets.only), "this kind of change");
  add("look-alikes", po::bool_switch(&options.onsets.look_alikes),
      "changes that might be taken for a local fault");
  add("rough", po::bool_switch(&options.rough),
      "of arms: noise half of which is coloured (0.2 s), friction that wanders by 3 % (2 min), delays that "
      "swing "
      "by 1 ms (7 s)");
  add("windows", po::value(&options.windows), "of scores: false alarms, and delays beside a CUSUM");
  add("rate", po::value(&options.made.sampling), "of the samples [Hz]; default 50");
  add("two", po::bool_switch(&options.made.two), "inertias, with an encoder on either side, of each joint");
  add("wander", po::value(&options.made.wander),
      "of friction, share up and down in ten minutes; default 0.02");
  add("coloured", po::value(&options.made.coloured), "noise of first order, share of the white; default 0.5");
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
      rigs.changes = options.onsets.count, rigs.healthy_hours = options.hours, rigs.rate = options.rate;
      rigs.position = !torque_alone, rigs.seed = options.seed;
      study_rigs(rigs);
      return 0;
    }
    if (options.hours > 0) options.apart ? healthy_apart(options) : healthy(options);
    if (options.onsets.count > 0) {
      options.onsets.rate_of_look = backlash::diagnosis::rate_of_look(options.rate, kWindow, kInterval, 1);
      study_onsets(options.onsets, options.seed + 1000, options.made);
    }
    if (options.arms > 0) study_arms(options.arms, options.seed, options.rate, options.rough);
    if (options.windows > 0) study_windows(options.windows, options.seed);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "change_study: " << error.what() << '\n';
    return 64;
  }
}
