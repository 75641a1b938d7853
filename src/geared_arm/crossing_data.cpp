// SPDX-License-Identifier: BSD-3-Clause
#include "crossing_data.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/geared_arm/drive_effects.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/local_parabola.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::geared_arm {
namespace {

using record::Channel;

// All choices, tried on simulated arms.
constexpr double kCertain = 0.5;         // cycles of torque_cutoff for which the load must be certain
constexpr double kSmoothed = 0.125;      // of a cycle of the teeth, to each side
constexpr double kBlock = 0.25;          // of a cycle of the teeth
constexpr double kStep = 0.5;            // rad of a cycle of the teeth per step
constexpr double kLead = 3;              // cycles of the teeth that count before the load becomes uncertain
constexpr double kSettling = 2;          // cycles of the teeth after the begin that do not count
constexpr double kTail = 0.15;           // s, after the load is certain again
constexpr double kLongest = 1.5;         // s
constexpr double kUnsureFriction = 0.7;  // of the motor's dry friction, about a standstill
constexpr double kStandstill = 3;        // friction speeds

/// Value and slope of the parabola about each sample, at either end of the nearest one.
void smooth(const std::vector<double>& x, Eigen::Index reach, double interval, Eigen::Index j,
            Eigen::MatrixXd& value, Eigen::MatrixXd& slope) {
  const auto n = Eigen::Index(x.size());
  const signal::LocalParabola parabola{std::size_t(reach)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index middle = std::clamp(i, reach, n - 1 - reach);
    value(i, j) = i == middle ? parabola.of(x, std::size_t(middle), parabola.value) : x[std::size_t(i)];
    slope(i, j) = parabola.of(x, std::size_t(middle), parabola.slope) / interval;
  }
}

/// Motors of one stretch of the record: rows all samples, columns all joints of the rig. Torques are those
/// that turn the motors.
struct Stretch {
  Eigen::MatrixXd position, rate, torque, load, way;
};

Stretch stretch_of(const arm::ArmRig& rig, const arm::ArmRecord& record, const arm::ArmMotion& motion,
                   const arm::Chain& chain, Eigen::Index reach) {
  const auto n = Eigen::Index(motion.time.size()), joints = motion.q.cols();
  Stretch s;
  s.position.resize(n, joints), s.rate.resize(n, joints), s.torque.resize(n, joints),
      s.load.resize(n, joints), s.way.resize(n, joints);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const record::Record even = record::evenly_sampled(
        record.joints[std::size_t(j)].slice(motion.time.front(), motion.time.back() + motion.interval / 2));
    smooth(even.column(Channel::motor_position), reach, motion.interval, j, s.position, s.rate);
    s.way.col(j) = arm::way_since_reversal(s.rate.col(j), motion.interval);
    const arm::JointDrive& drive = rig.joints[std::size_t(j)];
    const std::vector<double> torque =
        signal::delayed(even.column(rig.channel), -drive.delay / motion.interval);
    for (Eigen::Index i = 0; i < n; ++i) s.torque(i, j) = drive.constant * torque[std::size_t(i)];
  }
  const Eigen::MatrixXd recorded = s.torque;
  for (Eigen::Index j = 0; j < joints; ++j) {
    const DriveEffects effects(rig, std::size_t(j));
    s.torque.col(j) *= effects.gain();
    for (const auto& [other, share] : effects.couplings())
      s.torque.col(j) -= share * recorded.col(Eigen::Index(other));
  }
  for (Eigen::Index i = 0; i < n; ++i)
    s.load.row(i) = arm::inverse_dynamics(chain, motion.q.row(i), motion.v.row(i), motion.a.row(i));
  for (Eigen::Index j = 0; j < joints; ++j) {
    const Eigen::VectorXd column = s.load.col(j);
    const std::vector<double> low = signal::low_pass({column.data(), column.data() + n}, motion.interval,
                                                     rig.identification.torque_cutoff);
    s.load.col(j) = Eigen::Map<const Eigen::VectorXd>(low.data(), n);
  }
  return s;
}

double motor_friction(const arm::ArmRig& rig, std::size_t joint, const DriveEffects& effects, double position,
                      double speed, double load, double way) {
  const double distance = rig.joints[joint].friction_distance;
  const double built_up = distance > 0 ? 1 - 2 * std::exp(-way / distance) : 1;
  const double direction = std::tanh(speed / rig.friction_speed(joint)) * built_up;
  const model::JointMoment now{0, position, speed, direction, load, way};
  return arm::drive_friction(rig.joints[joint], now) + effects.torque(now);
}

/// Mass matrix and bias of the joints that have a gap, the others moving as their motors do.
void set_chain(CrossingWindow& w, const CrossingData& data, const arm::Chain& chain, const Stretch& s,
               Eigen::Index begin) {
  const Eigen::Index joints = s.position.cols(), n = Eigen::Index(data.joints.size());
  const arm::Joints rest = arm::Joints::Zero(joints);
  arm::Chain weightless = chain;
  weightless.gravity.setZero();
  for (Eigen::Index i = 0; i < w.samples(); ++i) {
    const Eigen::Index row = begin + i;
    const arm::Joints q = s.position.row(row), v = s.rate.row(row);
    const Eigen::Index next = std::min(row + 1, s.rate.rows() - 1), last = std::max<Eigen::Index>(row - 1, 0);
    arm::Joints a = (s.rate.row(next) - s.rate.row(last)) / (double(next - last) * data.interval);
    Eigen::MatrixXd inertia(n, n);
    for (Eigen::Index c = 0; c < n; ++c) {
      const auto joint = Eigen::Index(data.joints[std::size_t(c)].joint);
      a[joint] = 0;
      const arm::Joints column = arm::inverse_dynamics(weightless, q, rest, arm::Joints::Unit(joints, joint));
      for (Eigen::Index r = 0; r < n; ++r)
        inertia(r, c) = column[Eigen::Index(data.joints[std::size_t(r)].joint)];
    }
    w.inertia.emplace_back((inertia + inertia.transpose()) / 2);
    const arm::Joints bias = arm::inverse_dynamics(chain, q, v, a);
    for (Eigen::Index c = 0; c < n; ++c) w.bias(i, c) = bias[Eigen::Index(data.joints[std::size_t(c)].joint)];
  }
}

CrossingWindow window_of(const CrossingData& data, const arm::ArmRig& rig, const arm::Chain& chain,
                         const Stretch& s, double time, Eigen::Index begin, Eigen::Index end) {
  CrossingWindow w;
  const Eigen::Index samples = end - begin, n = Eigen::Index(data.joints.size());
  w.begin = time;
  for (Eigen::MatrixXd* each : {&w.position, &w.rate, &w.torque, &w.friction, &w.unsure, &w.bias, &w.chain})
    each->resize(samples, n);
  w.load.resize(n);
  w.pose = s.position.middleRows(begin, samples);
  for (Eigen::Index c = 0; c < n; ++c) {
    const TraverseJoint& joint = data.joints[std::size_t(c)];
    const auto j = Eigen::Index(joint.joint);
    const DriveEffects effects(rig, joint.joint);
    for (Eigen::Index i = 0; i < samples; ++i) {
      w.position(i, c) = s.position(begin + i, j), w.rate(i, c) = s.rate(begin + i, j);
      w.torque(i, c) = s.torque(begin + i, j), w.chain(i, c) = s.load(begin + i, j);
      w.friction(i, c) = motor_friction(rig, joint.joint, effects, w.position(i, c), w.rate(i, c),
                                        w.chain(i, c), s.way(begin + i, j));
      const double moving = std::tanh(w.rate(i, c) / (kStandstill * rig.friction_speed(joint.joint)));
      w.unsure(i, c) = kUnsureFriction * joint.coulomb * (1 - moving * moving);
    }
    w.load[c] = w.chain(0, c);
  }
  set_chain(w, data, chain, s, begin);
  return w;
}

/// Per sample: whether every joint's load has been large enough, of one sign, for `guard` samples.
std::vector<char> certain(const CrossingData& data, const Stretch& s, Eigen::Index guard,
                          const TraverseSettings& settings) {
  std::vector<char> all(std::size_t(s.load.rows()), 0);
  Eigen::Index since = 0;
  for (Eigen::Index i = 0; i < s.load.rows(); ++i) {
    bool now = true;
    for (const TraverseJoint& joint : data.joints) {
      const double load = s.load(i, Eigen::Index(joint.joint));
      const double last = i > 0 ? s.load(i - 1, Eigen::Index(joint.joint)) : load;
      now = now && load * last > 0 && std::fabs(load) > joint.link_coulomb + settings.least_load * joint.most;
    }
    since = now ? since + 1 : 0;
    all[std::size_t(i)] = since > guard;
  }
  return all;
}

bool any_turns(const CrossingData& data, const Stretch& s, Eigen::Index begin, Eigen::Index end) {
  for (const TraverseJoint& joint : data.joints) {
    const auto load = s.load.col(Eigen::Index(joint.joint)).segment(begin, end - begin);
    if (load.minCoeff() < 0 && load.maxCoeff() > 0) return true;
  }
  return false;
}

void add_windows(CrossingData& data, const arm::ArmRig& rig, const arm::Chain& chain, const Stretch& s,
                 const arm::ArmMotion& motion, double cycle, const TraverseSettings& settings) {
  const auto samples = [&](double time) { return Eigen::Index(std::lround(time / data.interval)); };
  const std::vector<char> sure =
      certain(data, s, samples(kCertain / rig.identification.torque_cutoff), settings);
  const auto n = Eigen::Index(sure.size());
  const Eigen::Index lead = samples(kLead * cycle) + data.skipped, longest = samples(kLongest);
  Eigen::Index free_from = data.reach;
  for (Eigen::Index i = 1; i < n; ++i) {
    if (sure[std::size_t(i)] || !sure[std::size_t(i - 1)]) continue;
    Eigen::Index begin = std::max(i - lead, free_from);
    while (begin < i && !sure[std::size_t(begin)]) ++begin;
    Eigen::Index end = i;  // the tail holds another turn where that comes soon
    for (Eigen::Index calm = 0; end + data.reach < n && calm < samples(kTail) && end - begin < longest; ++end)
      calm = sure[std::size_t(end)] ? calm + 1 : 0;
    if (begin == i || end - begin < 2 * lead || !any_turns(data, s, begin, end)) continue;
    ++data.turns;
    data.windows.push_back(window_of(data, rig, chain, s, motion.time[std::size_t(begin)], begin, end));
    free_from = end;
    i = std::max(i, end - lead);
  }
}

}  // namespace

double teeth_cycle(const TraverseJoint& joint) {
  return 2 * M_PI / std::sqrt(joint.stiffness * (1 / joint.rotor + 1 / joint.least_inertia));
}

CrossingData crossing_data(const GearedArm& arm, const arm::ArmRig& fitted, const arm::ArmRecord& record,
                           const std::vector<arm::ArmMotion>& motions,
                           const std::vector<TraverseJoint>& joints, const TraverseSettings& settings) {
  CrossingData data;
  data.joints = joints;
  data.interval = motions.front().interval;
  data.friction_speed = arm.rig.identification.friction_speed;
  double fastest = INFINITY, slowest = 0;
  for (const TraverseJoint& joint : joints) {
    const double cycle = teeth_cycle(joint);
    fastest = std::fmin(fastest, cycle), slowest = std::fmax(slowest, cycle);
  }
  data.steps = int(std::ceil(2 * M_PI * data.interval / (fastest * kStep)));
  data.reach = std::max<Eigen::Index>(2, std::lround(kSmoothed * fastest / data.interval));
  data.block = std::max<Eigen::Index>(2 * data.reach + 1, std::lround(kBlock * fastest / data.interval));
  data.skipped = std::lround(kSettling * slowest / data.interval);
  const arm::Chain chain = arm::loaded_chain(fitted);
  for (const arm::ArmMotion& motion : motions) {
    if (std::fabs(motion.interval - data.interval) > 1e-6 * data.interval) continue;
    const Stretch s = stretch_of(fitted, record, motion, chain, data.reach);
    add_windows(data, fitted, chain, s, motion, slowest, settings);
  }
  return data;
}

}  // namespace backlash::geared_arm
