// SPDX-License-Identifier: BSD-3-Clause
#include "chain_motion.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"

namespace backlash::changes {
namespace {

constexpr int kBody = 10;           // parameters of a body
constexpr double kSlipStep = 1e-5;  // rad, of a central difference: error 1e-10 of the slope. Theory

using arm::DriveTerm;

/// Straight between samples; the first or last value beyond them.
class Interpolated {
 public:
  Interpolated(const std::vector<double>& time, const std::vector<double>& values)
      : time_(time), values_(values) {}
  double operator()(double t) {
    while (at_ + 2 < time_.size() && time_[at_ + 1] < t) ++at_;
    const double u = std::clamp((t - time_[at_]) / (time_[at_ + 1] - time_[at_]), 0.0, 1.0);
    return (1 - u) * values_[at_] + u * values_[at_ + 1];
  }

 private:
  const std::vector<double>&time_, &values_;
  std::size_t at_ = 0;
};

/// What a joint shows, without what is known of it. What is left: inertia of the rotor, offset, dry and
/// viscous friction, which may differ from day to day.
double own_torque(const arm::JointDrive& drive, double signal, double speed, double sign, double chain) {
  const auto term = [&](DriveTerm t) { return drive.terms[static_cast<std::size_t>(t)]; };
  return drive.constant * signal - chain - term(DriveTerm::quadratic) * speed * std::fabs(speed) -
         term(DriveTerm::cubic) * speed * speed * speed - term(DriveTerm::load) * sign * std::fabs(chain);
}

void add_rows(const arm::Chain& chain, const arm::ArmMotion& m, std::size_t stride, ChainMotion& out) {
  const auto joints = static_cast<Eigen::Index>(chain.size());
  const auto rows = static_cast<Eigen::Index>((m.time.size() + stride - 1) / stride);
  const auto first = static_cast<Eigen::Index>(out.time.size());
  for (std::size_t j = 0; j < chain.size(); ++j) {
    out.body[j].conservativeResize(first + rows, kBody * joints);
    out.slip[j].conservativeResize(first + rows, joints);
  }
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = i * static_cast<Eigen::Index>(stride);
    out.time.push_back(m.time[static_cast<std::size_t>(k)]);
    const arm::Joints q = m.q.row(k), v = m.v.row(k), a = m.a.row(k);
    const Eigen::MatrixXd y = regressor(chain, q, v, a);
    for (std::size_t j = 0; j < chain.size(); ++j)
      out.body[j].row(first + i) = y.row(static_cast<Eigen::Index>(j));
    for (Eigen::Index s = 0; s < joints; ++s) {
      arm::Joints before = q, after = q;
      before[s] -= kSlipStep, after[s] += kSlipStep;
      // The joint stands elsewhere than its encoder shows: that much less.
      const arm::Joints slope =
          (inverse_dynamics(chain, before, v, a) - inverse_dynamics(chain, after, v, a)) / (2 * kSlipStep);
      for (std::size_t j = 0; j < chain.size(); ++j)
        out.slip[j](first + i, s) = slope[static_cast<Eigen::Index>(j)];
    }
  }
}

/// What the chain takes at sample k.
arm::Joints torque_at(const arm::Chain& chain, const std::vector<ChainDifference>& differences,
                      const arm::ArmMotion& m, std::size_t k) {
  const auto row = static_cast<Eigen::Index>(k);
  arm::Joints q = m.q.row(row);
  if (differences.empty()) return inverse_dynamics(chain, q, m.v.row(row), m.a.row(row));
  arm::Chain changed = chain;
  for (const ChainDifference& d : differences) {
    if (m.time[k] < d.from || m.time[k] >= d.to) continue;
    changed.links[d.joint] += d.body;
    q[static_cast<Eigen::Index>(d.joint)] -= d.slip;
  }
  return inverse_dynamics(changed, q, m.v.row(row), m.a.row(row));
}

void add_joints(const arm::ArmRig& rig, const arm::Chain& chain,
                const std::vector<ChainDifference>& differences, const arm::ArmRecord& record,
                const arm::ArmMotion& m, ChainMotion& out) {
  std::vector<Interpolated> signals, positions, loads;
  for (const record::Record& joint : record.joints) {
    signals.emplace_back(joint.time, joint.column(rig.channel));
    positions.emplace_back(joint.time, joint.column(record::Channel::motor_position));
    const auto& load = joint.column(record::Channel::load_position);
    loads.emplace_back(joint.time, load.empty() ? joint.column(record::Channel::motor_position) : load);
  }
  for (std::size_t k = 0; k < m.time.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const arm::Joints torque = torque_at(chain, differences, m, k);
    for (std::size_t j = 0; j < out.joints.size(); ++j) {
      const auto c = static_cast<Eigen::Index>(j);
      record::Record& r = out.joints[j];
      r.time.push_back(m.time[k]);
      r.column(record::Channel::motor_position).push_back(positions[j](m.time[k]));
      if (record.joints[j].has(record::Channel::load_position))
        r.column(record::Channel::load_position).push_back(loads[j](m.time[k]));
      r.column(record::Channel::output_torque).push_back(torque[c]);
      r.column(record::Channel::motor_torque)
          .push_back(own_torque(rig.joints[j], signals[j](m.time[k] + rig.joints[j].delay), m.motor_v(row, c),
                                m.sign(row, c), torque[c]));
    }
  }
}

}  // namespace

std::vector<ChainEffect> chain_effects(std::size_t joints) {
  std::vector<ChainEffect> all;
  for (std::size_t i = joints; i-- > 0;) all.push_back({"payload", i, kBody});
  for (std::size_t i = 0; i < joints; ++i) all.push_back({"encoder_slip", i, 1});
  return all;
}

ChainMotion chain_motion(const arm::ArmFit& healthy, const arm::ArmRecord& record,
                         const std::vector<ChainDifference>& differences, double most_rate,
                         std::vector<std::string>& warnings) {
  const arm::ArmRig& rig = healthy.rig;
  const arm::Chain chain = loaded_chain(rig);
  ChainMotion out;
  out.joints.resize(chain.size());
  out.body.resize(chain.size());
  out.slip.resize(chain.size());
  for (std::size_t j = 0; j < chain.size(); ++j) out.joints[j].name = record.name + ", " + rig.joints[j].name;
  for (const arm::ArmMotion& m : kinematics_of(record, rig, warnings)) {
    add_joints(rig, chain, differences, record, m, out);
    const double stride = std::floor(1 / (m.interval * most_rate));
    add_rows(chain, m, static_cast<std::size_t>(std::max(1.0, stride)), out);
  }
  return out;
}

void set_chain_columns(const ChainMotion& chain, std::size_t joint, SampledMotion& motion) {
  const auto column_of = [&](const Eigen::MatrixXd& all, Eigen::Index c) {
    const std::vector<double> values(all.col(c).data(), all.col(c).data() + all.rows());
    Interpolated at(chain.time, values);
    return column(motion, [&](const Moment& m) { return at(motion.start + m.time); });
  };
  for (const ChainEffect& e : chain_effects(chain.joints.size())) {
    Eigen::MatrixXd columns(motion.size(), e.values);
    const bool body = e.values > 1;
    for (Eigen::Index c = 0; c < columns.cols(); ++c)
      columns.col(c) = column_of(body ? chain.body[joint] : chain.slip[joint],
                                 static_cast<Eigen::Index>(e.joint) * e.values + c);
    motion.known_columns.emplace(e.at_joint().name(),
                                 std::make_shared<const Eigen::MatrixXd>(std::move(columns)));
  }
}

}  // namespace backlash::changes
