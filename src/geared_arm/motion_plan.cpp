// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/motion_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/base/random.h"
#include "gap_view.h"
#include "motion_shape.h"

namespace backlash::geared_arm {
namespace {

constexpr std::uint32_t kMotions = 3, kChanges = 4;  // streams of the seed
constexpr Eigen::Index kInformationStep = 4;         // every which time of the grid; choice (time)
// Gaps come first: one missing stay weighs more than any information. Theory: information changes by less
// than this over motions of one arm, per base parameter.
constexpr double kGapWeight = 100;
constexpr double kConditionWeight = 0.2;  // choice: a condition that is half counts as 15 % smaller errors
constexpr double kWorstCondition = 1e10;  // beyond it numbers are rounding; choice
constexpr double kTorqueWeight = 1000;    // over the limit, relative: comes before all
constexpr double kTorqueShare = 0.98;     // of the limit at the grid; choice: what may be between its times
constexpr double kFirstChange = 0.3;      // of the present size; choice
constexpr double kSmallestChange = 0.01;  // choice

/// Of values at even times of a period.
Eigen::MatrixXd rate_of(const Eigen::MatrixXd& values, double interval) {
  const Eigen::Index n = values.rows();
  Eigen::MatrixXd rate(n, values.cols());
  for (Eigen::Index i = 0; i < n; ++i)
    rate.row(i) = (values.row((i + 1) % n) - values.row((i + n - 1) % n)) / (2 * interval);
  return rate;
}

struct Rated {
  Shape shape;
  double value = -INFINITY;     // the larger, the better
  double over = 0;              // of the torque limits, relative
  std::vector<double> lacking;  // of each joint, see GapViews
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
        noise_known_(arm.simulated && arm.sensors.of(arm.rig.channel).noise > 0),
        information_(arm.rig, limits, noise(true), settings.seed),
        gaps_(arm, chain_, limits, settings, noise(false)) {
    for (std::size_t j = 0; j < limits.size(); ++j)
      if (limits[j].lower < limits[j].upper) moving_.push_back(Eigen::Index(j));
  }

  MotionPlan run(const Progress& progress);

 private:
  std::vector<double> noise(bool for_weights) const;
  Rated rated(const Shape& shape, const Sought& sought) const;
  std::pair<long, double> rank(const Rated& r) const;
  Rated found(const Progress& progress);
  Shape drawn(Random& random) const;
  Shape changed(const Shape& from, double size, Random& random) const;
  Rated bettered(Rated best, const Sought& sought, Random& random, const Progress& progress) const;
  bool holds_torques(const Shape& shape) const;
  double worth_of(const MotionInformation& information) const;
  std::vector<JointPlan> joints_of(const Shape& shape) const;

  const GearedArm& arm_;
  const std::vector<MotionLimits>& limits_;
  const PlanSettings& settings_;
  arm::Chain chain_;
  MotionShaper shaper_;
  bool noise_known_;
  BaseInformation information_;
  GapViews gaps_;
  Sought sought_;  // without those whose gap no motion can show
  MotionInformation reference_;
  std::vector<Eigen::Index> moving_;
};

/// Of the torques [N m]. Where the file says nothing: 0, and as a weight in proportion to the torque limits.
std::vector<double> Planner::noise(bool for_weights) const {
  std::vector<double> noise;
  for (std::size_t j = 0; j < limits_.size(); ++j)
    noise.push_back(noise_known_  ? arm_.sensors.of(arm_.rig.channel).noise * arm_.rig.joints[j].constant
                    : for_weights ? limits_[j].torque
                                  : 0);
  return noise;
}

/// Volume for the mean of the parameters, condition so that none is left out.
double Planner::worth_of(const MotionInformation& information) const {
  return information.log_volume / double(information_.unknowns()) -
         kConditionWeight * std::log(std::fmin(information.condition, kWorstCondition));
}

Rated Planner::rated(const Shape& shape, const Sought& sought) const {
  Rated r;
  r.shape = shape;
  const JointMotions motion = shaper_.motion(shape);
  const MotionTorques torques = torques_of(arm_, chain_, motion);
  const double interval = settings_.period / double(shaper_.grid_size());
  double lacking = 0;
  for (std::size_t j = 0; j < limits_.size(); ++j) {
    const auto c = Eigen::Index(j);
    const double share = torques.motor.col(c).cwiseAbs().maxCoeff() / limits_[j].torque;
    r.over += std::fmax(0, share - kTorqueShare);
    r.lacking.push_back(sought[j] ? gaps_.lacking(j, torques, interval) : 0);
    lacking += r.lacking.back();
  }
  r.information = information_.of(motion, rate_of(torques.motor, interval), kInformationStep);
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
  const double step = gaps_.row_interval();
  const double begin = series.front().approach, end = begin + settings_.period;
  const JointMotions all = sampled_motion(series, 0, end, step),
                     period = sampled_motion(series, begin, end, step);
  const Eigen::MatrixXd motor = torques_of(arm_, chain_, all).motor;
  const MotionTorques torques = torques_of(arm_, chain_, period);
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
    gaps_.describe(plan, j, shape.offsets, torques);
    plans.push_back(std::move(plan));
  }
  return plans;
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
  for (std::size_t j = 0; j < limits_.size(); ++j) sought_.push_back(gaps_.possible(j));
  const Rated best = found(progress);
  MotionPlan plan;
  plan.rig = arm_.rig.name;
  plan.settings = settings_;
  plan.base_parameters = information_.parameters();
  plan.noise_known = noise_known_;
  plan.planned = best.information;
  plan.reference = reference_;
  plan.gain =
      std::isfinite(reference_.log_volume)
          ? std::exp((plan.planned.log_volume - reference_.log_volume) / double(information_.unknowns()))
          : kNaN;
  plan.joints = joints_of(best.shape);
  return plan;
}

void check(const PlanSettings& s) {
  const auto require = [](const char* name, double value, const Range& range) {
    if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
  };
  require("period", s.period, Range::positive());
  require("periods", s.periods, Range::between(1, 1e6));
  require("harmonics", s.harmonics, Range::between(2, 20));
  require("motions", s.motions, Range::between(1, 1e6));
  require("bettered", s.bettered, Range::between(1, s.motions));
  require("steps", s.steps, Range::between(0, 1e6));
  require("margin", s.margin, Range::between(1, 10));
}

}  // namespace

const char* to_string(GapView view) {
  switch (view) {
    case GapView::shown:
      return "shown";
    case GapView::unconfirmed:
      return "unconfirmed";
    case GapView::not_found:
      return "not_found";
    case GapView::impossible:
      break;
  }
  return "impossible";
}

bool MotionPlan::none_hidden() const {
  return std::all_of(joints.begin(), joints.end(), [](const JointPlan& joint) {
    return joint.view == GapView::shown || joint.view == GapView::unconfirmed;
  });
}

MotionPlan plan_motion(const GearedArm& arm, const std::vector<MotionLimits>& limits,
                       const PlanSettings& settings, const Progress& progress) {
  check(settings);
  return Planner(arm, limits, settings).run(progress);
}

}  // namespace backlash::geared_arm
