// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/gap_traverse.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "refusal.h"
#include "traverse_fit.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines, but where another origin is given.
constexpr double kModel = 0.2;                 // of the play, see gap_traverse.h: simulation
constexpr double kAlike = 0.2;                 // of the play, between fits that tell the same: choice
constexpr double kUnsureFriction = 0.5;        // of the declared dry friction of the motor, as the fit has it
constexpr double kUnsureTorque = 2;            // theory: 95 % of what nothing tells
constexpr int kFewest = 20, kFewestFirst = 8;  // crossings, for the answer and to know the motor
constexpr int kMost = 60;                      // beyond them the errors do not shrink: the equations limit
constexpr int kSearched = 24;                  // for the first guesses
// Spreads of the gap: 0.3 to 3.3 times the declared one.
constexpr double kGuesses[] = {-0.4, -0.2, 0, 0.2, 0.4};
constexpr double kBeside[] = {0.6, 1.6};  // times the gap of a fit, from which others begin
constexpr std::size_t kGoneOn = 2;        // of the guesses, the cheapest that differ: choice (time)
constexpr int kRounds = 3;
constexpr double kCheaper = 1;          // of the cost, to go on
constexpr int kSearch = 20, kFit = 40;  // steps
constexpr double kMisfit = 1.6;         // noises, of the median crossing
constexpr double kFewOf = 0.54;         // of all crossings: simulation, see require_most()
constexpr double kFar = 4;              // spreads of a declared value
constexpr double kMostLeftOut = 0.2;    // of the crossings
constexpr double kVague = 0.7;          // half width of the interval of the logarithm: a factor of two
constexpr double kRivalCost = 9;        // theory: three standard errors
constexpr double kSteepest = 1.55;      // power of the deflection: Hertz's 1.5 and what is told wrong of it
constexpr double kHidden = 1;           // deflections under the noise, that a play must exceed
constexpr double kLaw = 0.1;            // of the deflection: teeth that yield by no power of it, 95 %

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid || !std::isfinite(value)) throw InvalidParameter(name, value, limit);
}

void check(const GapTraverseSettings& s) {
  require(s.motor_inertia > 0, "motor_inertia", s.motor_inertia, "must be > 0");
  require(s.load_inertia > 0, "load_inertia", s.load_inertia, "must be > 0");
  require(s.stiffness > 0, "stiffness", s.stiffness, "must be > 0");
  require(s.damping > 0, "damping", s.damping, "must be > 0");
  require(s.motor_damping >= 0, "motor_damping", s.motor_damping, "must be >= 0");
  require(s.motor_friction >= 0, "motor_friction", s.motor_friction, "must be >= 0");
  require(s.load_friction >= 0, "load_friction", s.load_friction, "must be >= 0");
  require(s.gap >= 0, "gap", s.gap, "must be >= 0");
}

void check_channels(const record::Record& record) {
  for (const auto channel : {record::Channel::motor_torque, record::Channel::motor_position}) {
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "needs " + record::channel_name(channel)};
    for (const double value : record.column(channel))
      if (!std::isfinite(value))
        throw Refusal{Status::insufficient_data, record::channel_name(channel) + " has gaps"};
  }
}

/// Spread evenly over the record.
std::vector<TraverseWindow> some(const std::vector<TraverseWindow>& all, int most) {
  if (int(all.size()) <= most) return all;
  std::vector<TraverseWindow> chosen;
  for (int i = 0; i < most; ++i)
    chosen.push_back(all[static_cast<std::size_t>(i) * all.size() / static_cast<std::size_t>(most)]);
  return chosen;
}

struct Solution {
  TraverseFit fit;
  double rival_gap, rival_cost;  // rad; more than the best's
};

double cost_of(const TraverseFit& fit) {
  return fit.cost() + fit.left_out() * kFar * kFar * 64;  // left out is no way to be better
}

const TraverseFit& cheapest(const std::vector<TraverseFit>& fits) {
  return *std::min_element(fits.begin(), fits.end(),
                           [](const auto& a, const auto& b) { return cost_of(a) < cost_of(b); });
}

bool alike(const TraverseFit& a, const TraverseFit& b) {
  return std::fabs(std::log(a.value(kTraverseGap) / b.value(kTraverseGap))) < kAlike;
}

/// Steps of each on its crossings, side by side.
void search(std::vector<TraverseFit>& fits) {
  for_each_in_parallel(static_cast<int>(fits.size()),
                       [&](int i) { fits[static_cast<std::size_t>(i)].run(kSearch); });
}

/// What fits begin with: guesses that some of the crossings have improved, cheapest first, without those that
/// came to the same.
std::vector<TraverseFit> guesses_of(const TraverseData& data, const TraversePriors& priors) {
  std::vector<TraverseFit> guesses;
  for (const double guess : kGuesses)
    guesses.emplace_back(data, priors, some(data.windows, kSearched), guess);
  search(guesses);
  std::vector<const TraverseFit*> by_cost;
  for (const TraverseFit& guess : guesses) by_cost.push_back(&guess);
  std::sort(by_cost.begin(), by_cost.end(),
            [](const auto* a, const auto* b) { return cost_of(*a) < cost_of(*b); });
  std::vector<TraverseFit> kept;
  for (const TraverseFit* guess : by_cost)
    if (std::none_of(kept.begin(), kept.end(), [&](const auto& other) { return alike(*guess, other); }))
      kept.push_back(*guess);
  return kept;
}

/// Another fit's machine on all windows.
TraverseFit gone_on(const TraverseFit& from, const TraverseData& data) {
  TraverseFit fit(from, data, some(data.windows, kMost));
  fit.run(kFit);
  return fit;
}

/// A fit stops where it is cheapest nearby: others begin with what is declared and gaps about the cheapest
/// one's, on some of the crossings, and go on where they are not dearer there, as long as that finds a
/// cheaper one.
void look_beside(std::vector<TraverseFit>& fits, const TraverseData& data, const TraversePriors& priors) {
  const std::vector<TraverseWindow> few = some(data.windows, kSearched);
  for (int round = 0; round < kRounds; ++round) {
    const TraverseFit best = cheapest(fits);
    std::vector<TraverseFit> tried = {TraverseFit(best, data, few)};
    for (const double factor : kBeside) {
      const TraversePrior& gap = priors[kTraverseGap];
      tried.emplace_back(data, priors, few,
                         std::log(factor * best.value(kTraverseGap) / gap.value) / gap.spread);
    }
    search(tried);
    for (std::size_t i = 1; i < tried.size(); ++i) {
      const double dearer = cost_of(tried[i]) - cost_of(tried[0]);
      if (dearer < -kCheaper || (dearer < kRivalCost && !alike(tried[i], tried[0])))
        fits.push_back(gone_on(tried[i], data));
    }
    if (!(cost_of(cheapest(fits)) < cost_of(best) - kCheaper)) return;
  }
}

/// Each leaves out other crossings: all are compared on all.
Solution solve(const TraverseData& data, const TraversePriors& priors,
               const std::vector<TraverseFit>& guesses) {
  std::vector<TraverseFit> fits;
  for (std::size_t i = 0; i < std::min(kGoneOn, guesses.size()); ++i)
    fits.push_back(gone_on(guesses[i], data));
  look_beside(fits, data, priors);
  const TraverseFit& best = cheapest(fits);
  Solution solution{best, best.value(kTraverseGap), std::numeric_limits<double>::infinity()};
  for (const TraverseFit& other : fits)
    if (!alike(other, best) && cost_of(other) - cost_of(best) < solution.rival_cost)
      solution.rival_gap = other.value(kTraverseGap), solution.rival_cost = cost_of(other) - cost_of(best);
  return solution;
}

/// [rad] Of a flank under the usual torque.
double deflection(const TraverseFit& fit, const TraverseData& data) {
  return data.level / fit.value(kTraverseStiffness);
}

void refuse(const TraverseFit& fit, const TraverseData& data) {
  if (!(fit.misfit() < kMisfit) || fit.left_out() > kMostLeftOut * fit.windows())
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the machine of the rig file, whatever its values, does not explain the torque: "
                    "{:.2g} times the noise are left, {} of {} crossings left out",
                    fit.misfit(), fit.left_out(), fit.windows())};
  static const char* const names[] = {"gap",
                                      "stiffness of the mesh",
                                      "damping of the mesh",
                                      "inertia of the load",
                                      "inertia of the motor",
                                      "damping of the motor",
                                      "dry friction of the motor",
                                      "dry friction of the load",
                                      "power of the torque of the teeth over the deflection"};
  for (int k = kTraverseStiffness; k < kTraverseEarlier; ++k)
    if (std::fabs(fit.deviation(k)) > kFar)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the record fits only a machine far from that of the rig file: {} {:.3g}",
                                names[k], fit.value(k))};
  if (const double power = fit.value(kTraversePower); power > kSteepest)
    throw Refusal{Status::out_of_domain,
                  fmt::format("the record fits only teeth whose torque goes with the power {:.3g} of their "
                              "deflection, steeper than any contact: they yield otherwise, or there are more "
                              "gaps than one",
                              power)};
  const double hidden =
      std::max(kHidden * data.noise / fit.value(kTraverseStiffness), 2 * kLaw * deflection(fit, data));
  if (fit.value(kTraverseGap) < hidden)
    throw Refusal{
        Status::below_range,
        fmt::format("less than {:.2g} rad, which noise and the yielding of the teeth hide", hidden)};
}

void fill(Estimate& e, const Solution& solution, const TraverseData& data, const GapTraverseSettings& s) {
  const TraverseFit& fit = solution.fit;
  refuse(fit, data);
  const double gap = fit.value(kTraverseGap);
  if (solution.rival_cost < kRivalCost)
    throw Refusal{Status::ambiguous,
                  fmt::format("{:.4g} and {:.4g} rad fit the record alike", gap, solution.rival_gap)};
  const int used = fit.windows() - fit.left_out();
  const double error = std::max(fit.standard_error() * std::max(1.0, fit.misfit()), fit.clustered_error());
  const double half = std::hypot(signal::student_t_quantile(0.975, used - 1) * error, kModel,
                                 kLaw * deflection(fit, data) / gap);
  if (!(half < kVague))
    throw Refusal{Status::insufficient_data,
                  fmt::format("{} crossings of the gap tell it only from {:.2g} to {:.2g} rad", used,
                              gap * std::exp(-half), gap * std::exp(half))};
  e.status = Status::ok;
  e.backlash_angle = gap, e.angle_lower = gap * std::exp(-half), e.angle_upper = gap * std::exp(half);
  e.backlash = gap * s.base_radius, e.lower = e.angle_lower * s.base_radius;
  e.upper = e.angle_upper * s.base_radius;
  e.message =
      fmt::format("motor's side alone, {} of {} crossings of the gap; {:.2g} times the noise are left", used,
                  data.crossings, fit.misfit());
}

void require_crossings(const TraverseData& data, int fewest) {
  if (int(data.windows.size()) >= fewest) return;
  throw Refusal{Status::insufficient_data,
                fmt::format("the gap was crossed {} times, {} of them from a clear press on a flank, which "
                            "{} are needed of; moves that reverse with more than {:.2g} N m would do",
                            data.crossings, data.windows.size(), fewest, data.clear)};
}

/// Those that are left out take long, or begin in no clear press, as of a large play they do: where they are
/// many, what is left has been told of a play of half the size, with nothing but noise left.
void require_most(const TraverseData& data) {
  if (double(data.within) >= kFewOf * double(data.crossings)) return;
  throw Refusal{
      Status::insufficient_data,
      fmt::format("{} of {} crossings of the gap can be looked at, the others are too slow or begin "
                  "in no clear press on a flank, as those of a larger play: {:.0f} % are needed",
                  data.within, data.crossings, 100 * kFewOf)};
}

/// Crossings that begin in a clear press whatever is wrong with the declared friction of the motor.
TraverseData first_data(const record::Record& record, const GapTraverseSettings& s) {
  return traverse_data(
      record, s, {s.motor_inertia, s.motor_damping, s.motor_friction, kUnsureFriction * s.motor_friction});
}

/// Crossings by the motor that those have told.
TraverseData second_data(const record::Record& record, const GapTraverseSettings& s, const TraverseFit& fit) {
  return traverse_data(record, s,
                       {fit.value(kTraverseMotorInertia), fit.value(kTraverseMotorDamping),
                        fit.value(kTraverseMotorFriction), kUnsureTorque * fit.untold()});
}

}  // namespace

Estimate estimate_gap_traverse(const record::Record& record, const GapTraverseSettings& settings) {
  check(settings);
  return estimate_or_refusal("gap_traverse", [&](Estimate& estimate) {
    check_channels(record);
    const TraverseData first = first_data(record, settings);
    require_crossings(first, kFewestFirst);
    const TraversePriors priors = traverse_priors(first, settings);
    const std::vector<TraverseFit> guesses = guesses_of(first, priors);
    const TraverseData data = second_data(record, settings, guesses.front());
    require_crossings(data, kFewest);
    require_most(data);
    fill(estimate, solve(data, priors, guesses), data, settings);
  });
}

}  // namespace backlash::diagnosis
