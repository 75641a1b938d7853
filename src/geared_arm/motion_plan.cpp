// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/motion_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/random.h"
#include "flank_stays.h"
#include "motion_loads.h"
#include "motion_shape.h"

namespace backlash::geared_arm {
namespace {

constexpr std::uint32_t kMotions = 3, kChanges = 4;  // streams of the seed
constexpr Eigen::Index kInformationStep = 4;         // every which time of the grid; choice (time)
// Gaps come first: one stay that lacks weighs more than information can. Theory: it changes by less than this
// over motions of one arm, per base parameter.
constexpr double kGapWeight = 100;
constexpr double kConditionWeight = 0.2;  // choice: a condition that is half counts as 15 % smaller errors
constexpr double kWorstCondition = 1e10;  // beyond it numbers are rounding; choice
constexpr double kTorqueWeight = 1000;    // over the limit, relative: comes before all
constexpr double kTorqueShare = 0.98;     // of the limit at the grid; choice: what may be between its times
constexpr double kFirstChange = 0.3;      // of the present size; choice
constexpr double kSmallestChange = 0.01;  // choice

struct Rated {
  Shape shape;
  double value = -INFINITY;     // the larger, the better
  double over = 0;              // of the torque limits, relative
  std::vector<double> lacking;  // of each joint, see GapScore
  MotionInformation information;
};

/// Joints whose gap is looked for.
using Sought = std::vector<char>;

class Planner {
 public:
  Planner(const GearedArm& arm, const std::vector<MotionLimits>& limits, const PlanSettings& settings)
      : arm_(arm),
        limits_(limits),
        settings_(settings),
        chain_(arm::loaded_chain(arm.rig)),
        shaper_(limits, settings),
        information_(arm.rig, limits, noise(), settings.seed) {
    for (std::size_t j = 0; j < limits.size(); ++j) {
      const GearedJoint& joint = arm.joints[j];
      friction_.push_back({joint.link_coulomb, joint.link_viscous});
      gap_.push_back(!joint.held && (joint.gear || !arm.simulated));
      if (limits[j].lower < limits[j].upper) moving_.push_back(Eigen::Index(j));
    }
  }

  MotionPlan run(const Progress& progress);

 private:
  std::vector<double> noise();
  Rated rated(const Shape& shape, const Sought& sought) const;
  std::pair<long, double> rank(const Rated& r) const;
  Rated found(const Progress& progress);
  Shape drawn(Random& random) const;
  Shape changed(const Shape& from, double size, Random& random) const;
  Rated bettered(Rated best, const Sought& sought, Random& random, const Progress& progress) const;
  bool holds_torques(const Shape& shape) const;
  double least_reach(std::size_t joint) const;
  double worth_of(const MotionInformation& information) const;
  std::vector<JointPlan> joints_of(const Shape& shape) const;
  void set_gap(JointPlan& plan, std::size_t joint, const arm::Joints& offsets,
               const Eigen::MatrixXd& mesh) const;

  const GearedArm& arm_;
  const std::vector<MotionLimits>& limits_;
  const PlanSettings& settings_;
  arm::Chain chain_;
  MotionShaper shaper_;
  bool noise_known_ = true;
  BaseInformation information_;
  std::vector<JointLoad> friction_;
  std::vector<char> gap_;
  Sought sought_;  // without those whose gap no motion can show
  MotionInformation reference_;
  std::vector<Eigen::Index> moving_;
  std::vector<std::array<double, 2>> reach_;
};

std::vector<double> Planner::noise() {
  const double declared = arm_.sensors.of(arm_.rig.channel).noise;
  noise_known_ = arm_.simulated && declared > 0;
  std::vector<double> noise;
  for (std::size_t j = 0; j < limits_.size(); ++j)
    noise.push_back(noise_known_ ? declared * arm_.rig.joints[j].constant : limits_[j].torque);
  return noise;
}

/// Volume for the mean of the parameters, condition so that none is left out.
double Planner::worth_of(const MotionInformation& information) const {
  return information.log_volume / double(information_.parameters()) -
         kConditionWeight * std::log(std::fmin(information.condition, kWorstCondition));
}

Rated Planner::rated(const Shape& shape, const Sought& sought) const {
  Rated r;
  r.shape = shape;
  const JointMotions motion = shaper_.motion(shape);
  const MotionTorques torques = torques_of(arm_, chain_, motion);
  const double interval = settings_.period / double(shaper_.grid_size());
  const double hold = hold_time(arm_.rig, settings_.play);
  double lacking = 0;
  for (std::size_t j = 0; j < limits_.size(); ++j) {
    const auto c = Eigen::Index(j);
    const double share = torques.motor.col(c).cwiseAbs().maxCoeff() / limits_[j].torque;
    r.over += std::fmax(0, share - kTorqueShare);
    r.lacking.push_back(
        sought[j] ? gap_score(torques.mesh.col(c), interval, hold, friction_[j], settings_).lacking : 0);
    lacking += r.lacking.back();
  }
  r.information = information_.of(motion, kInformationStep);
  r.value = worth_of(r.information) - kGapWeight * lacking - kTorqueWeight * r.over;
  return r;
}

Shape Planner::drawn(Random& random) const {
  const auto n = Eigen::Index(limits_.size());
  Shape shape{Eigen::VectorXd(n), Eigen::MatrixXd::Zero(2 * settings_.harmonics, n)};
  for (Eigen::Index j = 0; j < n; ++j) {
    const MotionLimits& l = limits_[std::size_t(j)];
    shape.offsets[j] = random.uniform(l.lower, l.upper);
    const double size = (l.upper - l.lower) / 2;
    for (Eigen::Index i = 0; i < shape.coefficients.rows(); ++i)
      shape.coefficients(i, j) = size * random.normal() / double(1 + i % settings_.harmonics);
  }
  return shaper_.within_limits(shape);
}

/// One joint in two of three cases, else all of them.
Shape Planner::changed(const Shape& from, double size, Random& random) const {
  Shape shape = from;
  const bool all = random.below(3) == 0;
  const Eigen::Index one = moving_[random.below(moving_.size())];
  for (const Eigen::Index j : moving_) {
    if (!all && j != one) continue;
    const MotionLimits& l = limits_[std::size_t(j)];
    const double turn = std::fmin((l.upper - l.lower) / 2, M_PI);
    const double length = shape.coefficients.col(j).norm();
    shape.offsets[j] += size * turn * random.normal();
    for (Eigen::Index i = 0; i < shape.coefficients.rows(); ++i)
      shape.coefficients(i, j) += size * length * random.normal() / double(1 + i % settings_.harmonics);
  }
  return shaper_.within_limits(shape);
}

/// After half of the steps gaps that are still not shown are given up, so that they do not stand in the way
/// of the rest.
Rated Planner::bettered(Rated best, const Sought& sought, Random& random, const Progress& progress) const {
  Sought left = sought;
  double size = kFirstChange;
  for (int i = 0; i < settings_.steps; ++i) {
    if (progress && i % 10 == 0 && !progress(double(i) / settings_.steps, "bettering the motion"))
      throw Cancelled();
    if (i == settings_.steps / 2) {
      for (std::size_t j = 0; j < left.size(); ++j)
        if (best.lacking[j] > 0) left[j] = 0;
      best = rated(best.shape, left);
      size = kFirstChange;
    }
    Rated next = rated(changed(best.shape, size, random), left);
    if (next.value > best.value) {
      best = std::move(next);
      size = std::fmin(1, 1.3 * size);
    } else {
      size = std::fmax(kSmallestChange, 0.97 * size);
    }
  }
  return rated(best.shape, sought);
}

/// As often as the diagnosis looks, from rest at the start to the end of a period.
std::vector<JointPlan> Planner::joints_of(const Shape& shape) const {
  const std::vector<simulation::FourierMotion> series = shaper_.series(shape);
  const double step = 1 / (kRowsPerCycle * arm_.rig.identification.torque_cutoff);
  const double begin = series.front().approach, end = begin + settings_.period;
  const JointMotions all = sampled_motion(series, 0, end, step),
                     period = sampled_motion(series, begin, end, step);
  const Eigen::MatrixXd motor = torques_of(arm_, chain_, all).motor,
                        mesh = torques_of(arm_, chain_, period).mesh;
  std::vector<JointPlan> plans;
  for (std::size_t j = 0; j < series.size(); ++j) {
    const auto c = Eigen::Index(j);
    JointPlan plan;
    plan.joint = arm_.rig.joints[j].name;
    plan.motion = series[j];
    plan.lower = all.q.col(c).minCoeff(), plan.upper = all.q.col(c).maxCoeff();
    plan.speed = all.v.col(c).cwiseAbs().maxCoeff();
    plan.acceleration = all.a.col(c).cwiseAbs().maxCoeff();
    plan.torque = motor.col(c).cwiseAbs().maxCoeff();
    plan.least_load = mesh.col(c).minCoeff(), plan.largest_load = mesh.col(c).maxCoeff();
    plan.gap = gap_[j] != 0;
    if (plan.gap) set_gap(plan, j, shape.offsets, mesh);
    plans.push_back(std::move(plan));
  }
  return plans;
}

std::string flank_text(int flank) {
  return flank > 0 ? "positive" : "negative";
}

std::string hidden_text(const JointPlan& plan) {
  std::string text;
  for (const HiddenRange& range : plan.hidden)
    text += fmt::format("{}{:.2f} to {:.2f} rad on the {} flank", text.empty() ? "" : ", ", range.lower,
                        range.upper, flank_text(range.flank));
  return text.empty() ? "gravity holds it on a flank nowhere"
                      : "gravity holds it from " + text + " (other joints at their offsets)";
}

/// Of a flank that at most `reach` [N m] presses.
std::string missing_text(int flank, double reach, double needed) {
  const std::string which = flank_text(flank);
  if (reach < 0)
    return fmt::format(
        "no pose and motion that was looked at takes the load off the {} flank, {:.3g} N m stay",
        flank_text(-flank), -reach);
  if (reach == 0) return "no pose and motion loads the " + which + " flank";
  return fmt::format(
      "no pose and motion that was looked at presses the {} flank with more than {:.3g} N m, and "
      "friction behind the gap hides what is below {:.3g} N m",
      which, reach, needed);
}

std::string gap_text(const JointPlan& plan, const std::vector<std::string>& missing, double hold,
                     std::size_t wanted) {
  if (plan.view == GapView::shown)
    return fmt::format("shown: {} and {} stays on the two flanks in each period; {}", plan.stays[1],
                       plan.stays[0], hidden_text(plan));
  if (plan.view == GapView::not_found)
    return fmt::format(
        "cannot be shown by any motion that was tried: {} and {} stays of {:.2g} s beyond {:.3g} N m on the "
        "two "
        "flanks in each period, {} on each are needed, and no motion within the limits gives more than "
        "{:.3g} and "
        "{:.3g} N m; {}",
        plan.stays[1], plan.stays[0], hold, plan.certain, wanted, plan.reach[1], plan.reach[0],
        hidden_text(plan));
  std::string text = "cannot be shown within the limits: ";
  for (const std::string& each : missing) text += each + "; ";
  return text + hidden_text(plan);
}

/// In each of many periods; the load's last value is its first. A stay that lasts from one to the next counts
/// once.
void count_stays(const Eigen::VectorXd& load, double certain, std::size_t guard, std::size_t count[2]) {
  std::vector<double> rows(load.data(), load.data() + load.size() - 1);
  const auto counted = [&](std::size_t into[2]) {
    std::vector<bool> first(rows.size(), false);
    first.front() = true;
    stays_of(sides_of(rows, first, certain, guard), into);
  };
  std::size_t once[2], twice[2];
  counted(once);
  rows.insert(rows.end(), load.data(), load.data() + load.size() - 1);
  counted(twice);
  for (const int side : {0, 1})
    count[side] =
        std::max(twice[side] - std::min(twice[side], once[side]), std::min<std::size_t>(1, once[side]));
}

void Planner::set_gap(JointPlan& plan, std::size_t joint, const arm::Joints& offsets,
                      const Eigen::MatrixXd& mesh) const {
  const Eigen::VectorXd load = mesh.col(Eigen::Index(joint));
  plan.certain = certain_load(friction_[joint], load.cwiseAbs().maxCoeff(), settings_.play);
  count_stays(load, plan.certain, guard_rows(settings_.play), plan.stays);
  plan.hidden = hidden_ranges(chain_, limits_, offsets, joint, plan.certain - friction_[joint].link_coulomb);
  std::vector<std::string> missing;
  for (const int side : {0, 1}) {
    plan.reach[side] = reach_[joint][std::size_t(side)];
    const double needed = least_reach(joint);
    if (plan.reach[side] > needed) continue;
    missing.push_back(missing_text(2 * side - 1, plan.reach[side], needed));
  }
  const std::size_t wanted = settings_.play.least_stays;
  plan.view = std::min(plan.stays[0], plan.stays[1]) >= wanted ? GapView::shown
              : missing.empty()                                ? GapView::not_found
                                                               : GapView::impossible;
  plan.message = gap_text(plan, missing, hold_time(arm_.rig, settings_.play), wanted);
}

/// What a flank must be pressed with to be told for certain, where the other flank is pressed no more.
double Planner::least_reach(std::size_t joint) const {
  return friction_[joint].link_coulomb / (1 - settings_.play.least_load);
}

/// At all times that are looked at, the approach among them.
bool Planner::holds_torques(const Shape& shape) const {
  const std::vector<JointPlan> joints = joints_of(shape);
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (joints[j].torque > limits_[j].torque) return false;
  return true;
}

/// How many of the gaps that are sought a motion shows, and how good it is else.
std::pair<long, double> Planner::rank(const Rated& r) const {
  return {std::count(r.lacking.begin(), r.lacking.end(), 0.0), worth_of(r.information)};
}

Rated Planner::found(const Progress& progress) {
  Random motions(settings_.seed, kMotions);
  std::vector<Rated> all;
  reference_ = {kNaN, -INFINITY};
  for (int i = 0; i < settings_.motions; ++i) {
    all.push_back(rated(drawn(motions), sought_));
    if (all.back().over == 0 && all.back().information.log_volume > reference_.log_volume)
      reference_ = all.back().information;
  }
  std::sort(all.begin(), all.end(), [](const Rated& a, const Rated& b) { return a.value > b.value; });
  std::optional<Rated> best;
  for (int i = 0; i < settings_.bettered; ++i) {
    Random changes(settings_.seed, kChanges + std::uint32_t(i));
    const Progress part = [&](double fraction, const std::string& phase) {
      return progress((i + fraction) / settings_.bettered, phase);
    };
    Rated next = bettered(std::move(all[std::size_t(i)]), sought_, changes, progress ? part : Progress());
    if ((!best || rank(next) > rank(*best)) && holds_torques(next.shape)) best = std::move(next);
  }
  if (!best) throw BadData(arm_.rig.source, "no motion was found that holds the torque limits");
  return *best;
}

MotionPlan Planner::run(const Progress& progress) {
  if (moving_.empty()) throw BadData(arm_.rig.source, "all joints are held: nothing can move");
  reach_ = reachable_loads(arm_, chain_, limits_, settings_.seed);
  for (std::size_t j = 0; j < limits_.size(); ++j)
    sought_.push_back(gap_[j] && std::min(reach_[j][0], reach_[j][1]) > least_reach(j));
  const Rated best = found(progress);
  MotionPlan plan;
  plan.rig = arm_.rig.name;
  plan.settings = settings_;
  plan.base_parameters = information_.parameters();
  plan.noise_known = noise_known_;
  plan.planned = best.information;
  plan.reference = reference_;
  plan.gain = std::isfinite(reference_.log_volume)
                  ? std::exp((plan.planned.log_volume - reference_.log_volume) / double(plan.base_parameters))
                  : kNaN;
  plan.joints = joints_of(best.shape);
  return plan;
}

void check(const PlanSettings& s) {
  const auto require = [](const char* name, double value, const Range& range) {
    if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
  };
  require("period", s.period, Range::positive());
  require("harmonics", s.harmonics, Range::between(2, 20));
  require("motions", s.motions, Range::between(1, 1e6));
  require("bettered", s.bettered, Range::between(1, s.motions));
  require("steps", s.steps, Range::between(0, 1e6));
  require("margin", s.margin, Range::between(1, 10));
}

}  // namespace

bool MotionPlan::all_shown() const {
  return std::all_of(joints.begin(), joints.end(),
                     [](const JointPlan& joint) { return joint.view == GapView::shown; });
}

MotionPlan plan_motion(const GearedArm& arm, const std::vector<MotionLimits>& limits,
                       const PlanSettings& settings, const Progress& progress) {
  check(settings);
  return Planner(arm, limits, settings).run(progress);
}

}  // namespace backlash::geared_arm
