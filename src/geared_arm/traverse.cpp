// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/traverse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm/fit.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "crossing_fit.h"
#include "diagnosis/refusal.h"

namespace backlash::geared_arm {
namespace {

using diagnosis::Refusal;
using diagnosis::Status;
using record::Channel;

constexpr double kSmallest = 3e-5;    // rad, of the gaps that are tried first; choice
constexpr int kTried = 40;            // of them, evenly in the logarithm
constexpr double kFine = 1.02;        // ratio of those that are tried then; choice
constexpr int kNearby = 10;           // of them to each side: to the next of the first; theory
constexpr int kSteps = 30;            // of a fit
constexpr double kProfile = 1.5;      // ratio of gaps that a profile looks at; choice
constexpr int kProfileSteps = 6;      // of its fits; choice
constexpr double kLeastSlow = 0.005;  // of the largest load; choice
constexpr double kCycleSamples = 8;   // in a cycle of the teeth, at least; choice
constexpr double kFelt = 4;           // the same, of joints that move others; choice
constexpr double kTypical = 0.5;      // of the largest load: where teeth are known; choice

std::vector<double> grid() {
  std::vector<double> gaps{0};
  for (int i = 0; i < kTried; ++i)
    gaps.push_back(kSmallest * std::pow(kLargestGap / kSmallest, double(i) / (kTried - 1)));
  return gaps;
}

/// Touches that come a cycle of the teeth earlier or later explain a turn nearly as well: finer than that.
std::vector<double> gaps_about(double gap) {
  std::vector<double> gaps;
  for (int i = -kNearby; i <= kNearby; ++i) gaps.push_back(gap * std::pow(kFine, i));
  return gaps;
}

/// The rig as fitted to the record: links and drives, with those of the file as prior.
arm::ArmFit fitted_to(const arm::ArmRig& rig, const std::vector<arm::ArmMotion>& motions) {
  std::vector<arm::FittedMotion> all;
  for (const arm::ArmMotion& motion : motions) all.push_back({&motion, false});
  arm::FitFreedom freedom;
  freedom.constants = false;
  try {
    return arm::fit_arm(rig, all, freedom);
  } catch (const CannotIdentify& e) {
    throw Refusal{Status::insufficient_data, fmt::format("cannot tell: {}", e.what())};
  }
}

/// T of each joint by the fitted chain, low-passed, at the rows of all motions.
std::vector<std::vector<double>> loads_of(const arm::ArmRig& rig,
                                          const std::vector<arm::ArmMotion>& motions) {
  const arm::Chain chain = arm::loaded_chain(rig);
  Eigen::VectorXd links(10 * Eigen::Index(chain.size()));
  for (std::size_t i = 0; i < chain.size(); ++i) links.segment<10>(10 * Eigen::Index(i)) = chain.links[i];
  std::vector<std::vector<double>> loads(chain.size());
  for (const arm::ArmMotion& motion : motions)
    for (std::size_t j = 0; j < chain.size(); ++j) {
      const Eigen::VectorXd load = motion.chain[j] * links;
      loads[j].insert(loads[j].end(), load.data(), load.data() + load.size());
    }
  return loads;
}

/// Inertia of the link alone, all other joints moving freely: the least over the poses of the record.
double least_inertia(const arm::Chain& chain, const std::vector<arm::ArmMotion>& motions, std::size_t joint) {
  double least = INFINITY;
  const auto n = Eigen::Index(chain.size());
  arm::Chain weightless = chain;
  weightless.gravity.setZero();
  for (const arm::ArmMotion& motion : motions)
    for (std::size_t k = 0; k < motion.rows.size(); k += std::max<std::size_t>(1, motion.rows.size() / 50)) {
      const arm::Joints q = motion.q.row(Eigen::Index(motion.rows[k]));
      const arm::Joints a = arm::forward_dynamics(weightless, q, arm::Joints::Zero(n),
                                                  arm::Joints::Unit(n, Eigen::Index(joint)));
      least = std::fmin(least, 1 / a[Eigen::Index(joint)]);
    }
  return least;
}

/// White noise of a channel; of a position at least that of its steps.
double noise_of(const std::vector<double>& values, int order) {
  return signal::noise_from_differences(values, order);
}

TraverseJoint joint_of(const GearedArm& arm, const arm::ArmFit& fit, const arm::ArmRecord& record,
                       const std::vector<double>& load, double least, std::size_t j,
                       const TraverseSettings& settings) {
  const GearedJoint& declared = arm.joints[j];
  const arm::JointDrive& drive = fit.rig.joints[j];
  TraverseJoint t;
  t.joint = j;
  std::vector<double> sizes;
  for (const double each : load) sizes.push_back(std::fabs(each));
  t.most = *std::max_element(sizes.begin(), sizes.end());
  t.level = kTypical * t.most;
  const double depth = declared.gear->contact->static_penetration(t.level), little = 1e-3 * depth;
  const auto force = [&](double d, double rate) { return declared.gear->contact->force(d, rate, 0); };
  t.stiffness = t.level / depth;
  const double rate = little * 2 * M_PI;  // rad/s, slow: of laws whose damping is not a line as well
  t.damping = std::fmax((force(depth, rate) - force(depth, 0)) / rate, 1e-4 * t.stiffness);
  t.rotor = drive.terms[std::size_t(arm::DriveTerm::rotor_inertia)];
  t.least_inertia = least;
  t.link_coulomb = declared.link_coulomb, t.link_viscous = declared.link_viscous;
  t.coulomb = drive.terms[std::size_t(arm::DriveTerm::coulomb)];
  t.slow_torque = std::fmax(fit.deviation[j] * drive.constant, kLeastSlow * t.most);
  const record::Record& r = record.joints[j];
  t.torque_noise = drive.constant * noise_of(r.column(arm.rig.channel), 3);
  t.position_noise = std::fmax(noise_of(r.column(Channel::motor_position), 4),
                               signal::smallest_step(r.column(Channel::motor_position)) / std::sqrt(12.0));
  const double certain = t.link_coulomb + settings.least_load * t.most;
  const auto [lowest, highest] = std::minmax_element(load.begin(), load.end());
  t.crosses = *lowest<-certain&& * highest> certain;
  t.lesser = std::fmax(0, std::fmin(-*lowest, *highest));
  return t;
}

/// Why a joint cannot be judged at all; empty: it can.
std::string obstacle(const GearedArm& arm, const arm::ArmFit& fit, std::size_t j) {
  const GearedJoint& joint = arm.joints[j];
  if (joint.held) return "cannot tell: the joint is held: let it move";
  if (!joint.gear)
    return "needs load_position, or gear.contact of the joint in the rig file: how stiff its teeth are";
  if (!(fit.rig.joints[j].terms[std::size_t(arm::DriveTerm::rotor_inertia)] > 0))
    return "needs load_position, or rotor_inertia of the joint in the rig file";
  if (!std::isfinite(fit.deviation[j])) return "cannot tell: the joint hardly moves: move it further";
  return {};
}

/// Why samples are too far apart for a joint; empty: they are not.
std::string too_fast(const TraverseJoint& joint, double interval) {
  if (interval * kCycleSamples < teeth_cycle(joint)) return {};
  return fmt::format(
      "cannot tell: samples {:.3g} s apart do not resolve the cycle of {:.3g} s of the motor against its "
      "link: record faster",
      interval, teeth_cycle(joint));
}

/// Flights that the fitted machine makes.
std::vector<std::vector<Crossing>> crossings_of(const CrossingData& data, const CrossingFit& fit) {
  std::vector<std::vector<Crossing>> all(data.joints.size());
  for (std::size_t w = 0; w < data.windows.size(); ++w) {
    std::vector<Flight> flights;
    const CrossingWindow& window = data.windows[w];
    mesh_torques(data, window, link_mobilities(data, window, fit.machine()), fit.machine(), fit.own(w),
                 &flights);
    for (const Flight& flight : flights) {
      Crossing c;
      c.time = window.begin + double(flight.from) * data.interval;
      c.duration = double(flight.to - flight.from) * data.interval;
      c.flank = flight.flank;
      c.speed = window.rate(flight.from, Eigen::Index(flight.joint));
      const Eigen::VectorXd pose = window.pose.row(flight.from);
      c.pose.assign(pose.data(), pose.data() + pose.size());
      all[flight.joint].push_back(std::move(c));
    }
  }
  return all;
}

struct Judged {
  const CrossingData& data;
  const TraverseSettings& settings;
  double misfit;
  std::size_t crossings, turns;
  std::string strange;  // other joints
};

/// Windows in which the load of a joint turns.
std::size_t turns_of(const CrossingData& data, std::size_t k) {
  std::size_t turns = 0;
  for (const CrossingWindow& w : data.windows) {
    const auto load = w.chain.col(Eigen::Index(k));
    turns += load.minCoeff() < 0 && load.maxCoeff() > 0;
  }
  return turns;
}

/// How much worse the record is explained without the gap; looked for until that is less than `wanted`.
double evidence_of(const CrossingFit& best, std::size_t k, double wanted) {
  CrossingFit sound = best.held(k, 0);
  sound.run(kSteps, best.cost() + wanted);
  return sound.cost() - best.cost();
}

/// The largest gap that explains the record about as well as the best, `from` or more.
double largest_of(const CrossingFit& best, std::size_t k, double from, const TraverseSettings& settings) {
  CrossingFit other = best;
  for (double gap = from; gap < kLargestGap; gap *= kProfile) {
    other = other.held(k, gap);
    other.run(kProfileSteps);
    if (other.cost() - best.cost() > settings.rival) return gap;
  }
  throw Refusal{Status::insufficient_data,
                fmt::format("cannot tell: the turns of the load rule out no play up to {:.2g} rad: turn the "
                            "load faster, or record for longer",
                            kLargestGap)};
}

double half_width(const CrossingFit& fit, std::size_t k, const CrossingFit::Errors& errors,
                  const Judged& judged) {
  const TraverseJoint& joint = judged.data.joints[k];
  const double stiffness = joint.stiffness * fit.machine()[k][kCrossingStiffness];
  const double error = std::fmax(errors.own * std::fmax(1, judged.misfit), errors.clustered);
  const double t = signal::student_t_quantile(0.975, std::fmax(1, errors.turns - 1));
  return std::hypot(t * error, judged.settings.model * fit.gap(k),
                    judged.settings.law * joint.level / stiffness);
}

/// By which factor the teeth are stiffer or softer than declared.
double off_stiffness(const CrossingFit& fit, std::size_t k) {
  return std::exp(std::fabs(std::log(fit.machine()[k][kCrossingStiffness])));
}

/// A joint that the fit does not describe: the load of its teeth on the others is not known.
bool is_strange(const CrossingFit& fit, std::size_t k, const TraverseSettings& settings) {
  return fit.misfit(k) > settings.misfit || off_stiffness(fit, k) > settings.far;
}

void require_others(const std::string& strange) {
  if (strange.empty()) return;
  throw Refusal{
      Status::out_of_domain,
      fmt::format("cannot tell: the fit does not explain the teeth of {}, which load this joint too: "
                  "check its gear in the rig file",
                  strange)};
}

void require_explained(const Judged& judged) {
  const TraverseSettings& s = judged.settings;
  if (judged.misfit > s.misfit)
    throw Refusal{Status::out_of_domain,
                  fmt::format("cannot tell: no play explains the torque of the motor where the load turns: "
                              "{:.2g} times the noise is left: check friction and contact of the gear",
                              judged.misfit)};
  if (judged.turns < s.least_turns)
    throw Refusal{Status::insufficient_data,
                  fmt::format("cannot tell: the load turned {} times, {} are needed: record for longer",
                              judged.turns, s.least_turns)};
}

/// The fitted teeth must be plausible ones: else a play found with them, or none, means nothing.
void require_teeth(const CrossingFit& fit, std::size_t k, const Judged& judged) {
  const TraverseSettings& s = judged.settings;
  const double stiffer = fit.machine()[k][kCrossingStiffness];
  if (off_stiffness(fit, k) > s.far)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("cannot tell: the record fits only teeth of {:.2g} N m/rad at {:.2g} N m, {:.2g} "
                    "times the declared stiffness: is gear.contact that of this joint?",
                    stiffer * judged.data.joints[k].stiffness, judged.data.joints[k].level, stiffer)};
  if (const double power = fit.machine()[k][kCrossingPower]; power > s.steepest || power < s.flattest)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("cannot tell: the fit asks for teeth whose torque goes with the power {:.2g} of their "
                    "deflection, which no teeth do: check friction and contact of the gear",
                    power)};
}

/// A play that there is must be known well enough.
void require_known(const CrossingFit& fit, std::size_t k, double half, double turns, const Judged& judged) {
  const TraverseSettings& s = judged.settings;
  const double gap = fit.gap(k);
  if (turns < double(s.least_turns))
    throw Refusal{
        Status::insufficient_data,
        fmt::format("cannot tell: {:.2g} turns of the load determine the play, {} are needed: record "
                    "for longer",
                    turns, s.least_turns)};
  if (!(half < s.vague * gap))
    throw Refusal{Status::insufficient_data,
                  fmt::format("cannot tell: the turns of the load show a play between {:.2g} and {:.2g} rad "
                              "only; a soft start of the teeth would look alike",
                              std::fmax(0, gap - half), gap + half)};
}

void judge(diagnosis::Estimate& e, const CrossingFit& fit, std::size_t k, const CrossingFit::Errors& errors,
           const Judged& judged) {
  const TraverseSettings& s = judged.settings;
  require_explained(judged);
  require_others(judged.strange);
  require_teeth(fit, k, judged);
  e.from_record = true;
  const double gap = fit.gap(k), half = half_width(fit, k, errors, judged);
  if (!(gap > half) || evidence_of(fit, k, s.evidence) < s.evidence) {
    const double most = largest_of(fit, k, gap + half, s);
    e.status = Status::below_range;
    e.angle_lower = 0, e.angle_upper = most;
    e.message =
        fmt::format("motor's side alone: no play that is larger than its interval: at most {:.3g} rad", most);
    return;
  }
  require_known(fit, k, half, errors.turns, judged);
  e.status = Status::ok;
  e.backlash_angle = gap, e.angle_lower = gap - half, e.angle_upper = gap + half;
  e.message = fmt::format(
      "motor's side alone, against the link that the chain's load moves: the gap was crossed {} times; "
      "{:.2g} times the noise are left",
      judged.crossings, judged.misfit);
}

/// A fit ends where it is cheapest nearby: with the teeth that one has found the gap is tried once more.
CrossingFit solved(const CrossingData& data) {
  CrossingFit fit(data);
  fit.scan([](double) { return grid(); });
  fit.scan(gaps_about);
  fit.run(kSteps);
  CrossingFit other = fit;
  other.scan(gaps_about);
  other.run(kSteps);
  return other.cost() < fit.cost() ? other : fit;
}

void report(const GearedArm& arm, const CrossingData& data, std::vector<JointTraverse>& out,
            const TraverseSettings& settings) {
  const CrossingFit fit = solved(data);
  const std::vector<CrossingFit::Errors> errors = fit.errors();
  std::vector<std::vector<Crossing>> crossings = crossings_of(data, fit);
  std::vector<std::size_t> strange;
  for (std::size_t k = 0; k < data.joints.size(); ++k)
    if (out[data.joints[k].joint].estimate.message.empty() && is_strange(fit, k, settings))
      strange.push_back(k);
  for (std::size_t k = 0; k < data.joints.size(); ++k) {
    const TraverseJoint& joint = data.joints[k];
    JointTraverse& one = out[joint.joint];
    if (!one.estimate.message.empty()) continue;  // only felt by the others
    one.turns = joint.crosses;
    one.misfit = fit.misfit(k);
    one.estimate = diagnosis::estimate_or_refusal("gap_traverse", [&](diagnosis::Estimate& e) {
      if (!joint.crosses)
        throw Refusal{
            Status::out_of_domain,
            "cannot tell: the load never clearly turns: move so that gravity or acceleration reverses it"};
      if (joint.lesser < settings.friction * joint.coulomb)
        throw Refusal{
            Status::out_of_domain,
            fmt::format("cannot tell: on one flank the load reaches {:.2g} N m, which the motor's dry "
                        "friction of {:.2g} N m hides: {:.2g} times that friction is needed",
                        joint.lesser, joint.coulomb, settings.friction)};
      if (joint.slow_torque > settings.disagreement * joint.most)
        throw Refusal{Status::out_of_domain,
                      fmt::format("cannot tell: a fit of links and drives to the record leaves {:.2g} N m of "
                                  "the torque of the motor: declare payload and friction of the arm",
                                  joint.slow_torque)};
      std::string others;
      for (const std::size_t i : strange)
        if (i != k) others += (others.empty() ? "" : ", ") + arm.rig.joints[data.joints[i].joint].name;
      judge(e, fit, k, errors[k],
            {data, settings, one.misfit, crossings[k].size(), turns_of(data, k), others});
    });
    if (one.estimate.status == Status::ok) one.crossings = std::move(crossings[k]);
  }
}

}  // namespace

std::vector<JointTraverse> traverses_of(const GearedArm& arm, const arm::ArmRecord& record,
                                        std::vector<std::string>& warnings,
                                        const TraverseSettings& settings) {
  std::vector<JointTraverse> out(arm.joints.size());
  const auto refuse_all = [&](const Refusal& refusal) {
    for (JointTraverse& each : out) {
      if (!each.estimate.message.empty()) continue;  // a reason of its own
      each.estimate.status = refusal.status;
      each.estimate.message = refusal.reason;
    }
  };
  for (JointTraverse& each : out) each.estimate.method = "gap_traverse";
  const std::vector<arm::ArmMotion> motions = arm::motions_of(record, arm.rig, warnings);
  try {
    const arm::ArmFit fit = fitted_to(arm.rig, motions);
    const std::vector<std::vector<double>> loads = loads_of(fit.rig, motions);
    const arm::Chain chain = arm::loaded_chain(fit.rig);
    std::vector<TraverseJoint> joints;
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j].estimate.message = obstacle(arm, fit, j);
      if (!out[j].estimate.message.empty()) continue;
      const TraverseJoint joint =
          joint_of(arm, fit, record, loads[j], least_inertia(chain, motions, j), j, settings);
      out[j].estimate.message = too_fast(joint, motions.front().interval);
      // The load of its teeth on the other joints must be known, at least roughly.
      if (motions.front().interval * kFelt < teeth_cycle(joint)) joints.push_back(joint);
    }
    const auto looked_at = [&](const TraverseJoint& joint) {
      return out[joint.joint].estimate.message.empty();
    };
    if (std::none_of(joints.begin(), joints.end(), looked_at)) return out;
    if (joints.size() > kMostGaps)
      throw Refusal{Status::out_of_domain,
                    fmt::format("needs load_position: more than {} joints have a gap", kMostGaps)};
    const CrossingData data = crossing_data(arm, fit.rig, record, motions, joints, settings);
    if (data.windows.empty())
      throw Refusal{
          Status::out_of_domain,
          "cannot tell: the load turns at no time that begins with all teeth on a flank: move the joints one "
          "after the other"};
    report(arm, data, out, settings);
  } catch (const Refusal& refusal) {
    refuse_all(refusal);
  }
  return out;
}

}  // namespace backlash::geared_arm
