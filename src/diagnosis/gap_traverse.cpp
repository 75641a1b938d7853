// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/gap_traverse.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"
#include "traverse_search.h"
#include "traverse_waves.h"

namespace backlash::diagnosis {
namespace {

// Choices, tried on joints of test/campaigns/robot_joints and tests, but where another origin is given.
constexpr int kFewest = 20,
              kFewestFirst = 8;  // crossings by the motor alone, for the answer and to know the motor
constexpr int kMostWide = 45;    // of them, in which both flanks are seen
constexpr double kWide = 0.5;    // of the range in most windows: both flanks are seen
constexpr double kShares[] = {0.3, 0.5, 0.7, 0.85, 1};  // of the range of motor minus load position
constexpr double kFirstNoise = 0.05;                    // of the width, of what is left at first
constexpr double kUnsureFriction = 0.5;  // of the declared dry friction of the motor, as the fit has it
constexpr double kUnsureTorque = 2;      // theory: 95 % of what nothing explains
// The gates.
constexpr double kLeastShare = 0.35;  // of all crossings: simulation, see require_most()
constexpr int kFewestPressed = 5;     // windows, for each flank
constexpr double kPressed = 0.1;      // of the usual torque, in one of them
constexpr double kLong = 0.1;         // of its samples
constexpr double kMoved =
    1e-3;  // spreads: a fit that moves no value of the machine at all found nowhere to go
constexpr double kFarFromDeclared = 4;  // spreads of a declared value
constexpr double kLeft = 0.35;          // of the deflection or the torque, that is not explained
constexpr double kVague = 4;            // upper over lower end of an interval, by which it says too little
// The interval.
constexpr double kPlaces = 5;  // times the place that is unknown while a time is, 95 %: simulation
// Of the play: what moves it beside the declared, by the motor alone and with the load's encoder, whose error
// follows the place; 95 %: simulation.
constexpr double kModel = 0.15, kModelByLoad = 0.04;

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid || !std::isfinite(value)) throw InvalidParameter(name, value, limit);
}

void check(const GapTraverseSettings& s) {
  require(s.motor_inertia > 0, "motor_inertia", s.motor_inertia, "must be > 0");
  require(s.load_inertia > 0, "load_inertia", s.load_inertia, "must be > 0");
  if (!s.flank_under) {
    require(s.flank.stiffness > 0, "stiffness", s.flank.stiffness, "must be > 0");
    require(s.flank.damping > 0, "damping", s.flank.damping, "must be > 0");
  }
  require(s.motor_damping >= 0, "motor_damping", s.motor_damping, "must be >= 0");
  require(s.motor_friction >= 0, "motor_friction", s.motor_friction, "must be >= 0");
  require(s.load_damping >= 0, "load_damping", s.load_damping, "must be >= 0");
  require(s.motor_turn > 0, "motor_turn", s.motor_turn, "must be > 0");
  require(s.load_friction >= 0, "load_friction", s.load_friction, "must be >= 0");
  require(s.gap >= 0, "gap", s.gap, "must be >= 0");
}

void check_channels(const record::Record& record, bool load) {
  for (const auto channel : {record::Channel::motor_position,
                             load ? record::Channel::load_position : record::Channel::motor_torque}) {
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "needs " + record::channel_name(channel)};
    for (const double value : record.column(channel))
      if (!std::isfinite(value))
        throw Refusal{Status::insufficient_data, record::channel_name(channel) + " has gaps"};
  }
}

/// [rad] Of a flank under the usual torque.
double deflection(const TraverseFit& fit, const TraverseData& data) {
  return data.level / fit.fit.value(kTraverseStiffness);
}

/// What the record is explained by must be a machine like the declared one.
void require_declared(const TraverseFit& fit) {
  if (fit.fit.shared.tail(kTraverseValues - 1).cwiseAbs().maxCoeff() < kMoved)  // the gap comes first
    throw Refusal{Status::out_of_domain,
                  "the load's motion in the gap cannot be followed: it bounces from flank to flank "
                  "faster than the declared machine; slower moves would do"};
  for (const int k : {kTraverseStiffness, kTraverseLoadInertia, kTraverseMotorInertia})
    if (std::fabs(fit.fit.shared[k]) > kFarFromDeclared)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the record fits only a machine far from that of the rig file: {} {:.3g}",
                                fit.windows->shared()[std::size_t(k)].name, fit.fit.value(k))};
}

/// Share of what the machine should explain that is left beyond noise: of the deflection where the load is
/// seen, else of the torque.
double left_of(const TraverseFit& fit, const TraverseData& data) {
  const double times = std::sqrt(std::max(0.0, std::pow(fit.misfit(), 2) - 1));
  return data.load.empty() ? times * data.torque_noise / data.level : times * data.load_noise / data.width;
}

/// A flank that is never pressed may be anywhere: each must be, whatever the declared torque on the load is
/// within two standard errors, and without the torque that nothing explains.
void require_both_flanks(const TraverseFit& fit, const TraverseData& data) {
  const fit::Prior& terms = fit.windows->shared()[kTraverseLoadTerms];
  const double found = fit.fit.shared[kTraverseLoadTerms],
               error = std::sqrt(
                   std::max(fit.fit.covariance()(kTraverseLoadTerms, kTraverseLoadTerms),
                            fit.fit.clustered_covariance()(kTraverseLoadTerms, kTraverseLoadTerms)));
  int forward = 0, backward = 0;
  for (int w = 0; w < fit.windows->count(); ++w) {
    const Eigen::VectorXd& own = fit.fit.own[std::size_t(w)];
    const Eigen::VectorXd teeth = fit.windows->teeth(w, fit.fit.shared, own);
    const std::vector<double> torque(teeth.begin(), teeth.end());
    const double most = signal::quantile(torque, 1 - kLong), least = signal::quantile(torque, kLong);
    const double unexplained = fit.windows->own()[kOwnLoadTorque].value(own[kOwnLoadTorque]);
    double highest = kNaN, lowest = kNaN;  // of the torque that presses for sure
    for (const double z : {found - 2 * error, found + 2 * error}) {
      const double other =
          (terms.value(z) - fit.fit.value(kTraverseLoadTerms)) * fit.windows->load_torque(w) - unexplained;
      highest = std::fmin(highest, most + other), lowest = std::fmax(lowest, least + other);
    }
    forward += highest > kPressed * data.level, backward += -lowest > kPressed * data.level;
  }
  if (std::min(forward, backward) < kFewestPressed)
    throw Refusal{
        Status::insufficient_data,
        fmt::format(
            "one flank is pressed in {} of {} windows, the other for sure in {}: moves that reverse under "
            "load would do",
            std::max(forward, backward), fit.windows->count(), std::min(forward, backward))};
}

/// An interval that holds the plays that fit alike.
void fill(Estimate& e, const Fits& fits, const TraverseData& data, const GapTraverseSettings& s) {
  const TraverseFit& best = fits[0];
  require_declared(best);
  require_both_flanks(best, data);
  const int windows = best.windows->count();
  const double gap = best.gap(), left = left_of(best, data);
  if (!(left < kLeft))
    throw Refusal{Status::out_of_domain,
                  fmt::format("no machine like that of the rig file explains the {}: {:.0f} % of it are left",
                              data.load.empty() ? "torque" : "motor's position less the load's", 100 * left)};
  const double model = data.load.empty() ? kModel : kModelByLoad, unknown = unknown_law(data, s);
  double lower = gap, upper = gap;
  for (const TraverseFit& fit : fits) {
    const double half = std::hypot(
        signal::student_t_quantile(0.975, windows - 1) * TraverseErrors(fit).larger(), model, left);
    if (!(std::exp(2 * half) < kVague))
      throw Refusal{
          Status::insufficient_data,
          fmt::format("{} windows of the record show the play only from {:.2g} to {:.2g} rad: moves that "
                      "reverse, and press both flanks, would do",
                      windows, fit.gap() * std::exp(-half), fit.gap() * std::exp(half))};
    const double law = std::hypot(unknown * kUnknownLaw * deflection(fit, data), kPlaces * data.unsure_place);
    lower = std::min(lower, fit.gap() - std::hypot(fit.gap() * (1 - std::exp(-half)), law));
    upper = std::max(upper, fit.gap() + std::hypot(fit.gap() * (std::exp(half) - 1), law));
  }
  // Without a gap teeth are a spring: one flank may be pressed throughout as well.
  if (!(lower > 0))
    throw Refusal{
        Status::below_range,
        fmt::format(
            "no gap is seen: less than {:.2g} rad, or a torque on the load that the rig file does not "
            "declare (gravity) keeps one flank pressed",
            upper)};
  e.status = Status::ok;
  e.backlash_angle = gap, e.angle_lower = lower, e.angle_upper = upper;
  e.backlash = gap * s.base_radius, e.lower = e.angle_lower * s.base_radius;
  e.upper = e.angle_upper * s.base_radius;
  e.message = fmt::format("{}, {} windows of the record; {:.2g} % of the {} are not explained",
                          data.load.empty() ? "motor's side alone" : "both encoders", windows, 100 * left,
                          data.load.empty() ? "torque" : "deflection");
}

/// What `make` reads of the record, with the teeth as they are under the usual torque: that of the motor at
/// first, then the one through the teeth.
template <typename Make>
TraverseData with_teeth(GapTraverseSettings& s, const record::Record& record, const Make& make) {
  const auto press = [&](double torque) {
    if (!(torque > 0)) throw Refusal{Status::insufficient_data, "no torque goes through the teeth"};
    s.flank = s.flank_under(torque);
  };
  if (!s.flank_under) return make(s);
  if (!record.has(record::Channel::motor_torque))
    throw Refusal{Status::insufficient_data, "needs motor_torque, as the declared teeth are no spring"};
  double squares = 0;
  for (const double torque : record.column(record::Channel::motor_torque)) squares += torque * torque;
  press(std::sqrt(squares / double(record.size())));
  press(make(s).level);
  return make(s);
}

/// Load driven by the recorded motor, against its own encoder.
void by_load(Estimate& e, const record::Record& record, GapTraverseSettings s) {
  TraverseData data =
      with_teeth(s, record, [&](const auto& it) { return traverse_data_by_load(record, it); });
  std::vector<TraverseWindow> wide,
      narrow;  // where both flanks are seen, and others, which show what the encoders err
  for (const TraverseWindow& window : data.windows)
    (window.width > kWide * data.window_width ? wide : narrow).push_back(window);
  std::vector<TraverseWindow> chosen = spread_evenly(wide, kMostWide);
  for (const TraverseWindow& window : spread_evenly(narrow, kTraverseWindows - int(chosen.size())))
    chosen.push_back(window);
  std::vector<double> starts;
  for (const double share : kShares) starts.push_back(share * data.width);
  const Fits guesses = nearer(traverse_guesses(data, s, wide, Eigen::VectorXd::Zero(kTraverseValues), starts,
                                               kFirstNoise * data.width / data.load_noise));
  if (guesses.empty())
    throw Refusal{Status::out_of_domain, "no machine like that of the rig file follows the record"};
  fill(e, solve_traverse(data, s, chosen, guesses), data, s);
}

void require_crossings(const TraverseData& data, int fewest) {
  if (int(data.windows.size()) >= fewest) return;
  throw Refusal{Status::insufficient_data,
                fmt::format("the gap was crossed {} times, {} of them from a clear press on a flank, which "
                            "{} are needed of; moves that reverse with more than {:.2g} N m would do",
                            data.crossings, data.windows.size(), fewest, data.clear)};
}

/// Those that are left out take long, or begin in no clear press, as of a large play they do: where they are
/// many, the others have shown a play of half the size, with nothing but noise left.
void require_most(const TraverseData& data) {
  if (double(data.within) >= kLeastShare * double(data.crossings)) return;
  throw Refusal{
      Status::insufficient_data,
      fmt::format("{} of {} crossings of the gap can be looked at, the others are too slow or begin "
                  "in no clear press on a flank, as those of a larger play: {:.0f} % are needed",
                  data.within, data.crossings, 100 * kLeastShare)};
}

/// Crossings that begin in a clear press whatever is wrong with the declared friction of the motor.
TraverseData first_data(const record::Record& record, const GapTraverseSettings& s) {
  return traverse_data(
      record, s, {s.motor_inertia, s.motor_damping, s.motor_friction, kUnsureFriction * s.motor_friction});
}

/// Crossings by the motor that those have given.
TraverseData second_data(const record::Record& record, const GapTraverseSettings& s, const TraverseFit& fit) {
  return traverse_data(
      record, s,
      {fit.fit.value(kTraverseMotorInertia), fit.fit.value(kTraverseMotorDamping),
       fit.fit.value(kTraverseMotorFriction), kUnsureTorque * fit.rms_of_own(kOwnMotorTorque)});
}

/// Of the torque that a fit leaves, per rad of motor_position.
std::vector<double> orders_of_waves(const TraverseFit& fit, const TraverseData& data, double motor_turn) {
  std::vector<double> left, angle;
  for (int w = 0; w < fit.windows->count(); ++w) {
    std::vector<std::size_t> samples;
    const Eigen::VectorXd torque =
        fit.windows->torque_left(w, fit.fit.shared, fit.fit.own[std::size_t(w)], &samples);
    left.insert(left.end(), torque.begin(), torque.end());
    for (const std::size_t i : samples) angle.push_back(data.position[i] * 2 * M_PI / motor_turn);
  }
  std::vector<double> orders = wave_orders(std::move(left), angle, kTorqueWaves / 2);
  for (double& order : orders) order *= 2 * M_PI / motor_turn;
  return orders;
}

/// By the motor alone: torque that moves the load, in windows that begin in contact. The motor that the
/// surest of them give finds more of them.
void by_motor(Estimate& e, const record::Record& record, GapTraverseSettings s) {
  const TraverseData first = with_teeth(s, record, [&](const auto& it) { return first_data(record, it); });
  require_crossings(first, kFewestFirst);
  std::vector<double> starts;
  for (const double factor : kGapFactors)
    starts.push_back(factor * std::max(s.gap, first.level / s.flank.stiffness));
  const Fits early =
      traverse_guesses(first, s, first.windows, Eigen::VectorXd::Zero(kTraverseValues), starts, 1);
  if (early.empty())
    throw Refusal{Status::out_of_domain, "no machine like that of the rig file follows the record"};
  TraverseData data = second_data(record, s, early.front());
  require_crossings(data, kFewest);
  require_most(data);
  add_waves(data, orders_of_waves(early.front(), first, s.motor_turn));
  starts.clear();
  for (const TraverseFit& fit : early) starts.push_back(fit.gap());
  const Fits guesses = traverse_guesses(data, s, data.windows, early.front().fit.shared, starts, 1);
  if (guesses.empty())
    throw Refusal{Status::out_of_domain, "no machine like that of the rig file follows the record"};
  fill(e, solve_traverse(data, s, data.windows, guesses), data, s);
}

}  // namespace

Estimate estimate_gap_traverse(const record::Record& record, const GapTraverseSettings& settings) {
  check(settings);
  return estimate_or_refusal("gap_traverse", [&](Estimate& estimate) {
    const bool load = record.has(record::Channel::load_position);
    check_channels(record, load);
    (load ? by_load : by_motor)(estimate, record, settings);
  });
}

}  // namespace backlash::diagnosis
