// SPDX-License-Identifier: BSD-3-Clause
// The rig file of an arm: the chain by its URDF, the drives by a record of all joints,
//
//   effort = c tau_chain + J a + C S(v) + d v + o        c: 1 of a torque, else one over the torque constant
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_draft/draft.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "rig_text.h"

namespace backlash::rig_draft {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRowRate = 50;       // Hz, of the rows of a fit: choice, some per cycle of its low-pass
constexpr double kTorque = 1.6;       // factor of the chain's torque that masses of a URDF may be off: choice
constexpr double kClear = 4;          // standard errors: choice
constexpr double kNotSure = 0.3;      // of a torque constant by masses of a URDF, relative: choice
constexpr double kUsualYield = 1e-3;  // rad: see joint_draft.cpp
constexpr double kLeastError = 0.1;   // relative: choice

struct SeenDrive {
  double explained = 0;
  signal::Measured chain, rotor, coulomb, viscous;  // in the unit of the effort
};

/// Rows of all motions: chain, acceleration, sign, speed, one; and the effort.
struct Rows {
  std::vector<MatrixXd> a;
  std::vector<VectorXd> b;
};

Rows rows_of(const std::vector<arm::ArmMotion>& motions, const arm::ArmRig& rig) {
  const auto joints = Index(rig.chain.size());
  Rows rows;
  rows.a.assign(std::size_t(joints), MatrixXd(0, 5));
  rows.b.assign(std::size_t(joints), VectorXd());
  for (const arm::ArmMotion& m : motions) {
    const auto step = std::max<Index>(1, Index(1 / (kRowRate * m.interval)));
    const Index n = m.q.rows() / step;
    MatrixXd torque(n, joints);
    for (Index k = 0; k < n; ++k)
      torque.row(k) = arm::inverse_dynamics(rig.chain, m.q.row(k * step).transpose(),
                                            m.v.row(k * step).transpose(), m.a.row(k * step).transpose())
                          .transpose();
    for (Index j = 0; j < joints; ++j) {
      MatrixXd a(n, 5);
      VectorXd b(n);
      for (Index k = 0; k < n; ++k) {
        a.row(k) << torque(k, j), m.motor_a(k * step, j), m.sign(k * step, j), m.motor_v(k * step, j), 1;
        b[k] = m.signal(k * step, j);
      }
      signal::low_pass_columns(a.leftCols(4), m.interval * double(step), rig.identification.torque_cutoff);
      MatrixXd& all = rows.a[std::size_t(j)];
      all.conservativeResize(all.rows() + n, 5);
      all.bottomRows(n) = a;
      VectorXd& effort = rows.b[std::size_t(j)];
      effort.conservativeResize(effort.size() + n);
      effort.tail(n) = b;
    }
  }
  return rows;
}

/// With c = 1 where `torque`.
SeenDrive drive_of(const MatrixXd& a, const VectorXd& b, bool torque) {
  SeenDrive seen;
  const double size = (b.array() - b.mean()).square().sum();
  if (!(size > 0)) return seen;
  try {
    const MatrixXd columns = torque ? MatrixXd(a.rightCols(4)) : a;
    const VectorXd effort = torque ? VectorXd(b - a.col(0)) : b;
    const signal::LeastSquaresFit fit = signal::fit_linear(columns, effort);
    const Index shift = torque ? -1 : 0;
    const auto value = [&](Index i) {
      const signal::Measured m = fit.parameter(i + shift);
      return signal::Measured{std::max(0.0, m.value),
                              std::max(m.standard_error, kLeastError * std::abs(m.value))};
    };
    seen.chain = torque ? signal::Measured{1, 0} : fit.parameter(0);
    seen.rotor = value(1), seen.coulomb = value(2), seen.viscous = value(3);
    seen.explained = std::clamp(1 - fit.residuals.squaredNorm() / size, 0.0, 1.0);
  } catch (const CannotIdentify&) {  // a joint that stands
  }
  return seen;
}

class ArmDraft {
 public:
  ArmDraft(arm::ArmRig urdf, const std::vector<record::JointRecord>& records, std::string path)
      : rig_(std::move(urdf)), path_(std::move(path)) {
    rig_.terms = {arm::DriveTerm::rotor_inertia, arm::DriveTerm::coulomb, arm::DriveTerm::viscous,
                  arm::DriveTerm::offset};
    drives_.resize(rig_.chain.size());
    if (!records.empty()) look(records);
  }

  Draft draft() {
    for (std::size_t j = 0; j < drives_.size(); ++j) joint(j);
    Draft d;
    d.notes = notes_;
    d.to_fill = text_.to_fill();
    arm::ArmRig head = rig_;
    head.joints.clear();
    std::vector<std::string> comments = {
        "Rig file of an arm, made by make_rig from " + file(rig_.urdf) +
            (path_.empty() ? "" : " and " + file(path_)) + ". Beside each value: unit, where it came from.",
        "Links are those of the URDF. identification: cutoffs that records of many arms bear [choice]."};
    if (!d.to_fill.empty()) comments.emplace_back("To be filled in by a person:");
    for (const std::string& what : d.to_fill) comments.push_back("  " + what);
    d.text = arm::arm_rig_text(head, comments) + text_.text();
    return d;
  }

 private:
  static std::string file(const std::string& path) { return std::filesystem::path(path).filename().string(); }

  void look(const std::vector<record::JointRecord>& records) {
    const arm::ArmRecord record = arm::arm_record(records, rig_, file(path_));
    std::vector<std::string> warnings;
    const Rows rows = rows_of(arm::kinematics_of(record, rig_, warnings), rig_);
    for (std::size_t j = 0; j < drives_.size(); ++j) drives_[j] = drive_of(rows.a[j], rows.b[j], false);
    judge();
    if (!scaled_)
      for (std::size_t j = 0; j < drives_.size(); ++j) drives_[j] = drive_of(rows.a[j], rows.b[j], true);
    for (std::size_t j = 0; j < records.size() && j < drives_.size(); ++j) note(j, records);
  }

  bool is_shown(const SeenDrive& d) const {
    return d.explained >= kTakesTorque && d.chain.value > kClear * d.chain.standard_error;
  }

  /// A torque where the chain's torque is found in it once, by most joints that say so.
  void judge() {
    std::vector<double> times;
    for (const SeenDrive& d : drives_)
      if (is_shown(d)) times.push_back(d.chain.value);
    scaled_ = rig_.channel == record::Channel::motor_current;
    if (times.empty()) {
      notes_.emplace_back(
          "the efforts do not follow the torque of the chain: whether they are torques cannot be "
          "distinguished");
      return;
    }
    const double middle = signal::median(times);
    if (!scaled_ && middle < kTorque && middle > 1 / kTorque) {
      notes_.push_back(
          fmt::format("the efforts are torques: they hold {:.2f} times what the chain takes", middle));
      return;
    }
    scaled_ = true;
    if (rig_.channel == record::Channel::motor_torque && std::filesystem::path(path_).extension() == ".csv")
      text_.to_fill("the columns motor_torque of " + file(path_) +
                    ": name them motor_current, which they are");
    rig_.channel = record::Channel::motor_current;
    notes_.push_back(fmt::format(
        "the efforts are currents, or torques of other shafts: they hold {:.3g} times what the chain takes",
        middle));
  }

  void note(std::size_t j, const std::vector<record::JointRecord>& records) {
    const SeenDrive& d = drives_[j];
    const auto found = std::find_if(records.begin(), records.end(),
                                    [&](const auto& r) { return r.joint == rig_.joints[j].name; });
    const bool two = found != records.end() && found->record.has(record::Channel::load_position);
    notes_.push_back(fmt::format("{}: {}, the effort follows the motion by {:.0f} %", rig_.joints[j].name,
                                 two ? "an encoder on either side" : "one encoder", 100 * d.explained));
  }

  void joint(std::size_t j) {
    const SeenDrive& d = drives_[j];
    const std::string& name = rig_.joints[j].name;
    text_.line("  - name: " + quoted(name));
    double constant = 1;
    if (scaled_) {
      if (is_shown(d)) constant = 1 / d.chain.value;
      text_.line(
          fmt::format("    torque_constant: {{value: {:.4g}, uncertainty: {:.0f} %}}", constant,
                      100 * kNotSure),
          fmt::format(
              "N m at the joint per unit of the effort; {}; FILL IN: motor's data sheet times the ratio",
              is_shown(d) ? "by the masses of the URDF" : "not known"));
      text_.to_fill(fmt::format("joints.{}.torque_constant: motor's data sheet times the ratio", name));
    }
    term("rotor_inertia", d.rotor, constant, "kg m^2", name,
         "the rotor's, data sheet of the motor, times the ratio squared");
    term("coulomb", d.coulomb, constant, "N m", name, "");
    term("viscous", d.viscous, constant, "N m s/rad", name, "");
    text_.line("    offset: 0", "N m; identify finds it");
    const arm::JointLimits limits = arm::read_limits(rig_.urdf, {name}).front();
    const double stiffness = (std::isfinite(limits.effort) ? limits.effort : 100) / kUsualYield;
    text_.line(fmt::format("    # gear: {{backlash_angle: {:.1g}, contact: {{law: linear, stiffness: {:.3g}, "
                           "damping: {:.3g}}}}}",
                           kUsualYield, stiffness, stiffness * kUsualYield),
               "FILL IN: N m/rad, data sheet of the gear; for the play by the motor alone");
    text_.line("    # limits: {backlash_angle: {watch: 1.0e-3, service: 2.0e-3, stop: 3.0e-3}}",
               "FILL IN: rad, an example");
    text_.to_fill(fmt::format(
        "joints.{}.gear, limits: stiffness by the gear's data sheet, the play from which on you want to act",
        name));
  }

  void term(const std::string& key, const signal::Measured& m, double constant, const std::string& unit,
            const std::string& joint, const std::string& where) {
    const bool seen = std::isfinite(m.value);
    const double value = seen ? constant * m.value : 0;
    if (where.empty() || (seen && m.value > kClear * m.standard_error))
      text_.value("    " + key, value,
                  unit + "; " + (seen ? from_record(m) : "not known: identify finds it"));
    else
      text_.fill_in("    " + key, value, unit, "joints." + joint + "." + key, where);
  }

  arm::ArmRig rig_;
  std::string path_;
  std::vector<SeenDrive> drives_;
  bool scaled_ = false;  // the effort is no torque at the joint
  RigText text_;
  std::vector<std::string> notes_;
};

}  // namespace

Draft draft_arm(const arm::ArmRig& urdf, const std::vector<record::JointRecord>& records,
                const std::string& record_path) {
  return ArmDraft(urdf, records, record_path).draft();
}

}  // namespace backlash::rig_draft
