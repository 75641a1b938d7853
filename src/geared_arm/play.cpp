// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/play.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "flank_stays.h"
#include "play_fit.h"

namespace backlash::geared_arm {
namespace {

using record::Channel;

/// What the fit of one joint looks at: one row per low-passed sample.
struct Rows : FlankRows {
  std::vector<double> sign, lacking;  // S; of the motor's torque, beyond chain and rotor [N m]
  double noise = 0;                   // of lacking: sum of variances [N^2 m^2]
  std::vector<bool> first;            // of a stretch
  std::size_t size() const { return torque.size(); }
};

/// phi of a stretch, low-passed as the torque is.
std::vector<double> twist_of(const record::Record& joint, const arm::ArmMotion& motion, double cutoff) {
  const record::Record even =
      record::evenly_sampled(joint.slice(motion.time.front(), motion.time.back() + motion.interval / 2));
  std::vector<double> twist = even.column(Channel::motor_position);
  const std::vector<double>& load = even.column(Channel::load_position);
  if (twist.size() != motion.time.size())
    throw BadData(joint.name, "motor_position has other times than the record of the arm");
  for (std::size_t k = 0; k < twist.size(); ++k) twist[k] -= load[k];
  return signal::low_pass(twist, motion.interval, cutoff);
}

void append(Rows& rows, const arm::ArmMotion& motion, std::size_t joint, const Eigen::VectorXd& links,
            const arm::JointDrive& drive, const JointLoad& load, const std::vector<double>& twist) {
  const auto j = Eigen::Index(joint);
  const Eigen::VectorXd chain = motion.chain[joint] * links;
  const double noise = drive.constant * motion.noise[j];
  rows.noise += noise * noise * double(motion.rows.size());
  for (std::size_t k = 0; k < motion.rows.size(); ++k) {
    const auto row = Eigen::Index(k);
    const double speed = motion.drive[joint](row, int(arm::DriveTerm::viscous));
    rows.torque.push_back(chain[row] + load.link_viscous * speed +
                          load.link_coulomb * motion.drive[joint](row, int(arm::DriveTerm::coulomb)));
    rows.sign.push_back(motion.drive[joint](row, int(arm::DriveTerm::coulomb)));
    rows.lacking.push_back(drive.constant * motion.signal(Eigen::Index(motion.rows[k]), j) - chain[row] -
                           drive.terms[std::size_t(arm::DriveTerm::rotor_inertia)] *
                               motion.drive[joint](row, int(arm::DriveTerm::rotor_inertia)));
    rows.twist.push_back(twist.empty() ? 0 : twist[motion.rows[k]]);
    rows.position.push_back(motion.q(Eigen::Index(motion.rows[k]), j));
    rows.speed.push_back(speed);
    rows.first.push_back(k == 0);
  }
}

/// What of the motor's torque neither the chain nor any friction (Coulomb, viscous, an offset) explains, over
/// the chain's torque, rms, white noise of the torque taken off.
double disagreement(const Rows& rows) {
  const auto n = Eigen::Index(rows.size());
  Eigen::MatrixXd x(n, 3);
  double load = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    x.row(k) << rows.sign[std::size_t(k)], rows.speed[std::size_t(k)], 1;
    load += rows.torque[std::size_t(k)] * rows.torque[std::size_t(k)];
  }
  const Eigen::Map<const Eigen::VectorXd> y(rows.lacking.data(), n);
  const Eigen::VectorXd left = y - x * x.completeOrthogonalDecomposition().solve(y);
  return load > 0 ? std::sqrt(std::fmax(0, left.squaredNorm() - rows.noise) / load) : 0;
}

/// Where gravity would press the other flank by twice the least load: the nearest to where the joint was.
std::optional<double> showing_pose(const arm::Chain& chain, const arm::Joints& mean, std::size_t joint,
                                   int wanted, double least) {
  constexpr int kSteps = 90;  // choice: 2 degrees
  const arm::Joints rest = arm::Joints::Zero(mean.size());
  for (int step = 1; step <= kSteps; ++step)
    for (const int way : {1, -1}) {
      arm::Joints q = mean;
      q[Eigen::Index(joint)] += way * step * M_PI / kSteps;
      if (wanted * arm::inverse_dynamics(chain, q, rest, rest)[Eigen::Index(joint)] > 2 * least)
        return std::remainder(q[Eigen::Index(joint)], 2 * M_PI);
    }
  return std::nullopt;
}

std::string one_flank_message(const JointPlay& play, bool any, double least) {
  const bool turns = play.least_torque < -least && play.largest_torque > least;
  std::string text =
      fmt::format("cannot tell: {} (mesh torque between {:.3g} and {:.3g} N m, certain beyond {:.2g} N m)",
                  turns ? "the load presses the other flank only for moments"
                  : any ? "the load holds the teeth on one flank throughout"
                        : "no flank is loaded for long enough",
                  play.least_torque, play.largest_torque, least);
  if (play.pose)
    return text +
           fmt::format("; motion that passes a pose with {} at {:.2f} rad would do", play.joint, *play.pose);
  return text + (any ? "; gravity turns it in no pose of this joint: faster motion would do"
                     : "; faster motion or a pose in which gravity loads the joint would do");
}

void judge(JointPlay& play, const Rows& rows, double friction, const PlaySettings& settings) {
  const FlankPlayFit fit = fit_flank_play(rows);
  diagnosis::Estimate& e = play.estimate;
  e.components = diagnosis::PlayComponents{fit.play, fit.compliance, kNaN, kNaN};
  if (!std::isfinite(fit.lower) || !std::isfinite(fit.upper)) {
    e.message = "cannot tell: the deflection has no finite fit";
    return;
  }
  // Teeth and gap give way to the load: whatever the play, the motor is ahead where it pushes the link.
  if (!(fit.between + fit.between_error > 0)) {
    e.status = diagnosis::Status::out_of_domain;
    e.message = fmt::format(
        "cannot tell: from flank to flank the motor falls behind its link by {:.2g} rad, which no teeth "
        "allow: are the encoders exchanged, or does the link's encoder count the other way?",
        -fit.between);
    return;
  }
  // The interval covers what friction behind the gap does to the deflection: such teeth do not float.
  if (fit.residual > settings.worst_residual * std::fabs(fit.play) && fit.play > 3 * fit.error &&
      fit.residual > friction * std::fabs(fit.compliance)) {
    e.status = diagnosis::Status::ambiguous;
    e.message = fmt::format(
        "cannot tell: the teeth do not rest on their flanks: the fit leaves {:.2g} rad of the deflection: "
        "move so that the load presses them for longer",
        fit.residual);
    return;
  }
  const double rest = std::hypot(settings.bend * fit.play, 2 * friction * fit.softest);
  e.angle_lower = std::fmax(0, fit.play - std::hypot(fit.play - fit.lower, rest));
  e.angle_upper = fit.play + std::hypot(fit.upper - fit.play, rest);
  if (!(e.angle_upper > 0)) {
    e.status = diagnosis::Status::out_of_domain;
    e.message = fmt::format(
        "cannot tell: the deflection fits only a negative play of {:.2g} rad: check encoders and "
        "load",
        fit.play);
    e.angle_lower = e.angle_upper = kNaN;
    return;
  }
  e.from_record = true;
  if (!(e.angle_lower > 0)) {
    e.status = diagnosis::Status::below_range;
    e.message = fmt::format("no play that is larger than its interval: at most {:.3g} rad", e.angle_upper);
  } else if (e.angle_upper - e.angle_lower > 2 * settings.vague * fit.play) {
    e.status = diagnosis::Status::ambiguous;
    e.message = fmt::format(
        "cannot tell closer than {:.3g} to {:.3g} rad: play and the deflection of the teeth look alike in "
        "this record: load the teeth more and less",
        e.angle_lower, e.angle_upper);
  } else {
    e.status = diagnosis::Status::ok;
    e.backlash_angle = fit.play;
    e.message = fmt::format("{} and {} stays on the two flanks by the chain's load; deflection of {}",
                            play.stays[1], play.stays[0], fit.law);
  }
}

/// First the reasons not to look at the deflection.
void answer(JointPlay& play, const Rows& rows, bool two_encoders, bool follows, double friction,
            const PlaySettings& settings) {
  diagnosis::Estimate& e = play.estimate;
  if (!two_encoders) {
    e.message = "needs load_position";
  } else if (!follows) {
    e.status = diagnosis::Status::out_of_domain;
    e.message =
        "cannot tell: load_position does not follow motor_position: does it count the other way, or is it of "
        "another joint?";
  } else if (!play.one_flank.empty()) {
    e.status = diagnosis::Status::out_of_domain;
    e.message = play.one_flank;
  } else if (std::min(play.stays[0], play.stays[1]) < settings.least_stays) {
    e.message = fmt::format(
        "cannot tell: only {} and {} stays on the two flanks, {} on each are needed: record for longer",
        play.stays[1], play.stays[0], settings.least_stays);
  } else if (play.disagreement > settings.disagreement) {
    e.status = diagnosis::Status::out_of_domain;
    e.message = fmt::format(
        "cannot tell: the motor's torque differs by {:.0f} % from that of the declared chain: declare what "
        "the arm carries, or fit links and drives (identify)",
        100 * play.disagreement);
  } else {
    judge(play, rows, friction, settings);
  }
}

}  // namespace

std::vector<JointPlay> plays_of(const arm::ArmRig& rig, const std::vector<JointLoad>& loads,
                                const arm::ArmRecord& record, std::vector<std::string>& warnings,
                                const PlaySettings& settings) {
  const std::vector<arm::ArmMotion> motions = arm::motions_of(record, rig, warnings);
  const arm::Chain chain = arm::loaded_chain(rig);
  Eigen::VectorXd links(10 * Eigen::Index(chain.size()));
  for (std::size_t i = 0; i < chain.size(); ++i) links.segment<10>(10 * Eigen::Index(i)) = chain.links[i];
  arm::Joints mean = arm::Joints::Zero(Eigen::Index(chain.size()));
  for (const arm::ArmMotion& m : motions) mean += m.q.colwise().mean().transpose() / double(motions.size());
  std::vector<JointPlay> plays;
  for (std::size_t j = 0; j < chain.size(); ++j) {
    JointPlay play;
    play.joint = rig.joints[j].name;
    play.estimate.method = "position_difference";
    const bool two_encoders = record.joints[j].has(Channel::load_position);
    const bool follows = std::all_of(motions.begin(), motions.end(),
                                     [&](const arm::ArmMotion& m) { return m.link_follows[j]; });
    Rows rows;
    for (const arm::ArmMotion& m : motions)
      append(rows, m, j, links, rig.joints[j], loads[j],
             two_encoders ? twist_of(record.joints[j], m, rig.identification.torque_cutoff)
                          : std::vector<double>());
    if (rows.size() == 0) throw BadData(record.name, "is too short for torque_cutoff");
    const auto [least, largest] = std::minmax_element(rows.torque.begin(), rows.torque.end());
    const auto [lower, upper] = std::minmax_element(rows.position.begin(), rows.position.end());
    play.least_torque = *least, play.largest_torque = *largest;
    play.lower_position = *lower, play.upper_position = *upper;
    for (const double speed : rows.speed) play.fastest = std::fmax(play.fastest, std::fabs(speed));
    play.disagreement = disagreement(rows);
    const double most = std::fmax(std::fabs(*least), std::fabs(*largest));
    const double certain = certain_load(loads[j], most, settings);
    const double friction = std::fmax(loads[j].link_coulomb, settings.least_friction * most);
    rows.side = sides_of(rows.torque, rows.first, certain, guard_rows(settings));
    rows.stay = stays_of(rows.side, play.stays);
    rows.per_cycle = kRowsPerCycle;
    if (play.stays[0] == 0 || play.stays[1] == 0) {
      const int present = play.stays[0] > 0 ? -1 : play.stays[1] > 0 ? 1 : 0;
      if (present != 0) play.pose = showing_pose(chain, mean, j, -present, certain);
      play.one_flank = one_flank_message(play, present != 0, certain);
    }
    answer(play, rows, two_encoders, follows, friction, settings);
    plays.push_back(std::move(play));
  }
  return plays;
}

}  // namespace backlash::geared_arm
