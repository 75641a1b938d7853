// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/arm/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/presliding.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/record/sample_joiner.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::arm {
namespace {

constexpr double kRowsPerCycle = 5;         // choice: of torque_cutoff; two would do for a perfect low-pass
constexpr double kEdge = 1;                 // cycles of torque_cutoff that a low-pass needs to settle; choice
constexpr int kNoiseOrder = 3;              // of the differences that show white noise; choice
constexpr double kLargestDeflection = 0.1;  // rad, of a gear between its encoders; choice
constexpr double kBackwards = 2;  // theory: 0 of an encoder that follows, 1 of one of two that rest; choice
/// Theory: of white noise at sampling interval T, low_pass(f) leaves the variance share 2 T f times the
/// integral of 1 / (1 + x^8)^2 from 0 to infinity.
constexpr double kNoiseBandwidth = 0.898;

std::vector<double> column(const Eigen::MatrixXd& m, Eigen::Index j) {
  return {m.col(j).data(), m.col(j).data() + m.rows()};
}

Eigen::VectorXd to_eigen(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), Eigen::Index(v.size()));
}

struct Kinematics {
  std::vector<double> q, v, a;
};

Kinematics smooth_kinematics(const record::Record& r, record::Channel position, record::Channel velocity,
                             double interval, double cutoff) {
  Kinematics k;
  k.q = signal::low_pass(r.column(position), interval, cutoff);
  const std::vector<double>& speed = r.column(velocity);
  k.v = speed.empty() ? signal::derivative(k.q, interval) : signal::low_pass(speed, interval, cutoff);
  k.a = signal::derivative(k.v, interval);
  return k;
}

/// Whether the load's encoder is that of the link: it follows the motor's but for its zero and a deflection,
/// and turns the same way. One that counts the other way moves against the motor by twice of what the joint
/// moves, and read backwards hardly at all; a link in its gap moves as much against the motor as read
/// backwards.
bool follows(const record::Record& r) {
  if (!r.has(record::Channel::load_position)) return false;
  const std::vector<double>&motor = r.column(record::Channel::motor_position),
        &load = r.column(record::Channel::load_position);
  double least = INFINITY, largest = -INFINITY, least_sum = INFINITY, largest_sum = -INFINITY;
  for (std::size_t k = 0; k < motor.size(); ++k) {
    least = std::fmin(least, load[k] - motor[k]), largest = std::fmax(largest, load[k] - motor[k]);
    least_sum = std::fmin(least_sum, load[k] + motor[k]),
    largest_sum = std::fmax(largest_sum, load[k] + motor[k]);
  }
  const double apart = largest - least;
  return apart < kLargestDeflection && apart <= kBackwards * (largest_sum - least_sum);
}

/// Links as the load's encoder has them where there is one, else as the motor's. Zero is the load's: what a
/// gear sags by is no error of it; but the motor's where they are farther apart than any gear sags.
void set_kinematics(ArmMotion& m, const std::vector<record::Record>& joints, const ArmRig& rig,
                    std::vector<std::string>& warnings) {
  using record::Channel;
  const auto n = Eigen::Index(m.time.size()), count = Eigen::Index(joints.size());
  for (Eigen::MatrixXd* each : {&m.q, &m.v, &m.a, &m.motor_v, &m.motor_a, &m.signal}) each->resize(n, count);
  m.noise.resize(count);
  const double cutoff = rig.identification.kinematics_cutoff;
  for (Eigen::Index j = 0; j < count; ++j) {
    const record::Record& r = joints[std::size_t(j)];
    const Kinematics motor =
        smooth_kinematics(r, Channel::motor_position, Channel::motor_velocity, m.interval, cutoff);
    Kinematics link = motor;
    m.link_follows.push_back(follows(r));
    if (m.link_follows.back()) {
      link = smooth_kinematics(r, Channel::load_position, Channel::load_velocity, m.interval, cutoff);
      const double offset = to_eigen(motor.q).mean() - to_eigen(link.q).mean();
      if (std::fabs(offset) > kLargestDeflection)
        for (double& q : link.q) q += offset;
    } else if (r.has(Channel::load_position)) {
      warnings.push_back(fmt::format(
          "{}: load_position of {} does not follow motor_position to {} rad, or counts the other way: unused",
          m.name, rig.joints[std::size_t(j)].name, kLargestDeflection));
    }
    m.q.col(j) = to_eigen(link.q), m.v.col(j) = to_eigen(link.v), m.a.col(j) = to_eigen(link.a);
    m.motor_v.col(j) = to_eigen(motor.v), m.motor_a.col(j) = to_eigen(motor.a);
    const std::vector<double>& s = r.column(rig.channel);
    m.signal.col(j) = to_eigen(signal::low_pass(s, m.interval, rig.identification.torque_cutoff));
    m.noise[j] = signal::noise_from_differences(s, kNoiseOrder) *
                 std::sqrt(2 * m.interval * rig.identification.torque_cutoff * kNoiseBandwidth);
  }
}

/// Friction of one that builds up over a path, > 0 against forward motion.
Eigen::ArrayXd built_up(const Eigen::VectorXd& speed, double interval, double distance) {
  const std::vector<double> rate(speed.begin(), speed.end());
  std::vector<double> way(rate.size(), 0.0);
  for (std::size_t k = 1; k < way.size(); ++k) way[k] = way[k - 1] + 0.5 * interval * (rate[k - 1] + rate[k]);
  const std::vector<model::FrictionLimits> one(way.size(), {1, 1, distance, 0});
  return to_eigen(model::presliding_friction(way, one, rate, interval)).array();
}

Eigen::MatrixXd signs(const ArmMotion& m, const ArmRig& rig) {
  Eigen::MatrixXd out(m.motor_v.rows(), m.motor_v.cols());
  for (Eigen::Index j = 0; j < out.cols(); ++j) {
    const Eigen::VectorXd v = m.motor_v.col(j);
    const Eigen::ArrayXd fast = (v / rig.friction_speed(std::size_t(j))).array().tanh();
    const double distance = rig.joints[std::size_t(j)].friction_distance;
    out.col(j) = distance > 0 ? Eigen::ArrayXd(fast.abs() * built_up(v, m.interval, distance)) : fast;
  }
  return out;
}

void set_rows(ArmMotion& m, const ArmRig& rig) {
  const double cutoff = rig.identification.torque_cutoff;
  const auto step = std::max<std::size_t>(1, std::size_t(1 / (kRowsPerCycle * cutoff * m.interval)));
  const auto edge = std::size_t(kEdge / (cutoff * m.interval));
  for (std::size_t k = edge; k + edge < m.time.size(); k += step) m.rows.push_back(k);
}

Eigen::MatrixXd rows_of(const Eigen::MatrixXd& all, const ArmMotion& m, const ArmRig& rig) {
  Eigen::MatrixXd out(Eigen::Index(m.rows.size()), all.cols());
  for (Eigen::Index c = 0; c < all.cols(); ++c) {
    const std::vector<double> smooth =
        signal::low_pass(column(all, c), m.interval, rig.identification.torque_cutoff);
    for (std::size_t k = 0; k < m.rows.size(); ++k) out(Eigen::Index(k), c) = smooth[m.rows[k]];
  }
  return out;
}

void set_regressors(ArmMotion& m, const ArmRig& rig) {
  const auto n = Eigen::Index(m.time.size());
  const std::size_t count = rig.chain.size();
  std::vector<Eigen::MatrixXd> all(count, Eigen::MatrixXd(n, 10 * Eigen::Index(count)));
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::MatrixXd y = regressor(rig.chain, m.q.row(k), m.v.row(k), m.a.row(k));
    for (std::size_t j = 0; j < count; ++j) all[j].row(k) = y.row(Eigen::Index(j));
  }
  m.counts.resize(Eigen::Index(m.rows.size()), Eigen::Index(count));
  for (std::size_t j = 0; j < count; ++j) {
    const auto c = Eigen::Index(j);
    m.chain.push_back(rows_of(all[j], m, rig));
    const Eigen::ArrayXd v = m.motor_v.col(c);
    Eigen::MatrixXd drive = Eigen::MatrixXd::Zero(n, kDriveTerms);
    drive.col(int(DriveTerm::rotor_inertia)) = m.motor_a.col(c);
    drive.col(int(DriveTerm::coulomb)) = m.sign.col(c);
    drive.col(int(DriveTerm::viscous)) = v;
    drive.col(int(DriveTerm::quadratic)) = v * v.abs();
    drive.col(int(DriveTerm::cubic)) = v.cube();
    drive.col(int(DriveTerm::offset)).setOnes();
    m.drive.push_back(rows_of(drive, m, rig));
    for (std::size_t k = 0; k < m.rows.size(); ++k)
      m.counts(Eigen::Index(k), c) =
          std::fabs(m.drive[j](Eigen::Index(k), int(DriveTerm::viscous))) > rig.identification.slowest;
  }
}

ArmMotion motion_of(const ArmRecord& record, const ArmRig& rig, double from, double to,
                    std::vector<std::string>& warnings) {
  ArmMotion m;
  m.name = record.name;
  std::vector<record::Record> joints;
  for (const record::Record& joint : record.joints)
    joints.push_back(record::evenly_sampled(joint.slice(from, to)));
  m.time = joints.front().time;
  m.interval = joints.front().sampling_interval();
  if (2 * rig.identification.kinematics_cutoff * m.interval >= 1)
    throw BadData(record.name, fmt::format("sampled at {:.4g} Hz: too slow for kinematics_cutoff = {} Hz",
                                           1 / m.interval, rig.identification.kinematics_cutoff));
  set_kinematics(m, joints, rig, warnings);
  m.sign = signs(m, rig);
  set_rows(m, rig);
  return m;
}

}  // namespace

ArmRecord arm_record(const std::vector<record::JointRecord>& joints, const ArmRig& rig,
                     const std::string& name) {
  ArmRecord out;
  out.name = name;
  for (const JointDrive& drive : rig.joints) {
    const auto known = std::find_if(joints.begin(), joints.end(),
                                    [&](const record::JointRecord& j) { return j.joint == drive.name; });
    if (known == joints.end()) {
      std::vector<std::string> names;
      for (const record::JointRecord& j : joints)
        names.push_back(j.joint.empty() ? "one without a name" : j.joint);
      throw BadData(name, "no joint '" + drive.name + "', which the rig has; there are: " + joined(names));
    }
    for (const record::Channel channel : {record::Channel::motor_position, rig.channel})
      if (!known->record.has(channel))
        throw BadData(name, "no column " + drive.name + "/" + record::channel_name(channel));
    out.joints.push_back(known->record);
  }
  record::share_time_base(out.joints);
  for (const record::Record& joint : out.joints)
    for (const std::string& warning : joint.warnings)
      if (std::find(out.warnings.begin(), out.warnings.end(), warning) == out.warnings.end())
        out.warnings.push_back(warning);
  return out;
}

std::vector<ArmMotion> motions_of(const ArmRecord& record, const ArmRig& rig,
                                  std::vector<std::string>& warnings) {
  std::vector<ArmMotion> all = kinematics_of(record, rig, warnings);
  for (ArmMotion& m : all) set_regressors(m, rig);
  return all;
}

std::vector<ArmMotion> kinematics_of(const ArmRecord& record, const ArmRig& rig,
                                     std::vector<std::string>& warnings) {
  const std::vector<double>& time = record.joints.front().time;
  const double most = record::kGapFactor * record::median_interval(time);
  std::vector<ArmMotion> all;
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= time.size(); ++k) {
    if (k < time.size() && time[k] - time[k - 1] <= most) continue;
    const double to = k < time.size() ? time[k] : time.back() + most + 1;
    if (time[k - 1] - time[begin] >= kShortestStretch)
      all.push_back(motion_of(record, rig, time[begin], to, warnings));
    else if (k - begin > 1)
      warnings.push_back(fmt::format("{}: {:.3g} s from t = {:.4g} s are too short for a fit and left out",
                                     record.name, time[k - 1] - time[begin], time[begin]));
    begin = k;
  }
  if (all.empty())
    throw BadData(record.name,
                  fmt::format("no stretch of {} s without a gap: too short for an arm", kShortestStretch));
  return all;
}

void set_friction_turns(ArmMotion& motion, const ArmRig& rig) {
  motion.sign = signs(motion, rig);
  for (std::size_t j = 0; j < motion.drive.size(); ++j)
    motion.drive[j].col(int(DriveTerm::coulomb)) = rows_of(motion.sign.col(Eigen::Index(j)), motion, rig);
}

ArmMotion part_of(const ArmMotion& motion, double from, double to) {
  ArmMotion part = motion;
  std::vector<Eigen::Index> keep;
  part.rows.clear();
  for (std::size_t k = 0; k < motion.rows.size(); ++k) {
    const double t = motion.time[motion.rows[k]];
    if (t < from || t >= to) continue;
    keep.push_back(Eigen::Index(k));
    part.rows.push_back(motion.rows[k]);
  }
  const auto n = Eigen::Index(keep.size());
  part.counts.resize(n, motion.counts.cols());
  for (std::size_t j = 0; j < motion.chain.size(); ++j) {
    part.chain[j].resize(n, motion.chain[j].cols());
    part.drive[j].resize(n, motion.drive[j].cols());
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    part.counts.row(k) = motion.counts.row(keep[std::size_t(k)]);
    for (std::size_t j = 0; j < motion.chain.size(); ++j) {
      part.chain[j].row(k) = motion.chain[j].row(keep[std::size_t(k)]);
      part.drive[j].row(k) = motion.drive[j].row(keep[std::size_t(k)]);
    }
  }
  return part;
}

double moving_seconds(const ArmMotion& motion, std::size_t joint) {
  if (motion.rows.size() < 2) return 0;
  const double step = motion.time[motion.rows[1]] - motion.time[motion.rows[0]];
  double sum = 0;
  for (Eigen::Index k = 0; k < motion.counts.rows(); ++k)
    sum += motion.counts(k, Eigen::Index(joint)) ? step : 0;
  return sum;
}

}  // namespace backlash::arm
