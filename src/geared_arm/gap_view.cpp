// SPDX-License-Identifier: BSD-3-Clause
#include "gap_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flank_stays.h"

namespace backlash::geared_arm {
namespace {

// The unknown share of a motor's own torque (rotor, friction before the gap); choice: 0.2 to 2 % in simulated
// arms.
constexpr double kOwnTorque = 0.01;

/// The longest stays beyond `least` on one side, as shares of `wanted` [samples], over how many are needed.
/// The load is that of a period: its end and its begin are one stay.
double share_of_stays(const Eigen::VectorXd& load, int side, double least, double wanted, std::size_t count) {
  const Eigen::Index n = load.size();
  Eigen::Index begin = 0;
  while (begin < n && side * load[begin] > least) ++begin;
  std::vector<double> stays;
  double length = begin == n ? double(n) : 0;
  for (Eigen::Index k = 1; k <= n; ++k) {
    const bool inside = begin < n && side * load[(begin + k) % n] > least;
    if (inside) length += 1;
    if (inside || length == 0) continue;
    stays.push_back(std::fmin(1, (length - 1) / wanted));
    length = 0;
  }
  std::sort(stays.rbegin(), stays.rend());
  double sum = 0;
  for (std::size_t i = 0; i < std::min(count, stays.size()); ++i) sum += stays[i];
  return sum / double(count);
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

double rms(const Eigen::VectorXd& values) {
  return values.norm() / std::sqrt(double(values.size()));
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
std::string missing_flank(int flank, double reach, double needed) {
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

}  // namespace

GapViews::GapViews(const GearedArm& arm, const arm::Chain& chain, const std::vector<MotionLimits>& limits,
                   const PlanSettings& settings, std::vector<double> noise)
    : arm_(arm),
      chain_(chain),
      limits_(limits),
      settings_(settings),
      noise_(std::move(noise)),
      reach_(reachable_loads(arm, chain, limits, settings.seed)),
      hold_(2 * double(guard_rows(settings.play)) * row_interval()) {
  for (const GearedJoint& joint : arm.joints) {
    friction_.push_back({joint.link_coulomb, joint.link_viscous});
    has_gap_.push_back(!joint.held && (joint.gear || !arm.simulated));
  }
}

double GapViews::row_interval() const {
  return 1 / (kRowsPerCycle * arm_.rig.identification.torque_cutoff);
}

/// The load that shows a flank for certain, where the other flank is pressed no harder.
double GapViews::least_reach(std::size_t joint) const {
  return friction_[joint].link_coulomb / (1 - settings_.play.least_load);
}

/// How large a load must be (rms) for the motor's torque to confirm it, `own` being the motor's own torque
/// (rms) [N m]: what is not known of that, and of the variance of the noise in the rows of a record, within
/// `disagreement`.
double GapViews::unconfirmed(std::size_t joint, double own) const {
  const double rows = settings_.periods * settings_.period / row_interval();
  const double noise =
      noise_[joint] * std::sqrt(2 * arm_.rig.identification.torque_cutoff / arm_.sensors.sampling_rate);
  return std::hypot(kOwnTorque * own, noise * std::pow(2 / rows, 0.25)) / settings_.play.disagreement;
}

/// Whether the file says anything of the motor's own torque.
bool GapViews::knows_drive(std::size_t joint) const {
  const auto& terms = arm_.rig.joints[joint].terms;
  return std::any_of(terms.begin(), terms.end(), [](double each) { return each != 0; });
}

/// Why no motion can show a gap; empty: one may.
std::vector<std::string> GapViews::obstacles(std::size_t joint) const {
  std::vector<std::string> found;
  const std::array<double, 2>& reach = reach_[joint];
  for (const int side : {0, 1})
    if (!(reach[std::size_t(side)] > least_reach(joint)))
      found.push_back(missing_flank(2 * side - 1, reach[std::size_t(side)], least_reach(joint)));
  const double coulomb = arm_.rig.joints[joint].terms[std::size_t(arm::DriveTerm::coulomb)];
  const double least = unconfirmed(joint, coulomb), most = std::max(reach[0], reach[1]);
  if (found.empty() && most < least)
    found.push_back(fmt::format(
        "the motor's own friction and the noise of its torque hide a load below {:.3g} N m, and no pose "
        "and motion that was looked at gives more than {:.3g} N m",
        least, most));
  return found;
}

double GapViews::lacking(std::size_t joint, const MotionTorques& torques, double interval) const {
  const auto c = Eigen::Index(joint);
  const Eigen::VectorXd load = torques.mesh.col(c);
  const double most = load.cwiseAbs().maxCoeff(), wanted = settings_.margin * hold_ / interval;
  const double coulomb = friction_[joint].link_coulomb;
  const double least =
      coulomb + settings_.margin * (certain_load(friction_[joint], most, settings_.play) - coulomb);
  double lacking = 0;
  for (const int side : {-1, 1}) {
    const double largest = (side * load).maxCoeff();
    lacking += largest > least ? 1 - share_of_stays(load, side, least, wanted, settings_.play.least_stays)
                               : 1 + std::fmin(1, (least - largest) / std::fmax(most, 1e-300));
  }
  const double confirmed = settings_.margin * unconfirmed(joint, rms(torques.motor.col(c) - load));
  return lacking + std::fmax(0, 1 - rms(load) / confirmed);
}

void GapViews::describe(JointPlan& plan, std::size_t joint, const arm::Joints& offsets,
                        const MotionTorques& torques) const {
  plan.gap = has_gap(joint);
  const Eigen::VectorXd load = torques.mesh.col(Eigen::Index(joint));
  plan.least_load = load.minCoeff(), plan.largest_load = load.maxCoeff();
  if (!plan.gap) return;
  plan.certain = certain_load(friction_[joint], load.cwiseAbs().maxCoeff(), settings_.play);
  count_stays(load, plan.certain, guard_rows(settings_.play), plan.stays);
  plan.hidden = hidden_ranges(chain_, limits_, offsets, joint, plan.certain - friction_[joint].link_coulomb);
  for (const int side : {0, 1}) plan.reach[side] = reach_[joint][std::size_t(side)];
  const std::vector<std::string> found = obstacles(joint);
  const double least = unconfirmed(joint, rms(torques.motor.col(Eigen::Index(joint)) - load));
  const std::size_t wanted = settings_.play.least_stays;
  if (!found.empty()) {
    plan.view = GapView::impossible;
    plan.message = "cannot be shown within the limits: " + found.front();
    if (found.size() > 1) plan.message += "; " + found.back();
  } else if (std::min(plan.stays[0], plan.stays[1]) < wanted) {
    plan.view = GapView::not_found;
    plan.message = fmt::format(
        "not shown by any motion that was tried: {} and {} stays of {:.2g} s beyond {:.3g} N m on the two "
        "flanks in each period, {} on each are needed; the limits allow at most {:.3g} and {:.3g} N m",
        plan.stays[1], plan.stays[0], hold_, plan.certain, wanted, plan.reach[1], plan.reach[0]);
  } else if (rms(load) < least) {
    plan.view = GapView::not_found;
    plan.message = fmt::format(
        "not shown by any motion that was tried: a load of {:.3g} N m (rms), and the motor's own torque and "
        "the noise of it hide what is below {:.3g} N m",
        rms(load), least);
  } else {
    plan.message =
        fmt::format("shown: {} and {} stays on the two flanks in each period", plan.stays[1], plan.stays[0]);
    if (!knows_drive(joint)) {
      plan.view = GapView::unconfirmed;
      plan.message = fmt::format(
          "{}, unless the drive's own torque hides a load of {:.3g} N m (rms): the rig file states neither "
          "its rotor nor its friction; identify, and plan again with the fitted file",
          plan.message, rms(load));
    }
  }
  plan.message += "; " + hidden_text(plan);
}

}  // namespace backlash::geared_arm
