// SPDX-License-Identifier: BSD-3-Clause
// A record of a joint with locked output as the columns of a regression (locked_output.h).
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/identification/fit/servo_data.h"
#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

/// Where the flanks are and how stiff: all that is not linear.
struct LockedMesh {
  double stiffness = 0;        // of the contact law, in its unit
  double plus = 0, minus = 0;  // rad, motor_position at the flanks in the middle of the record
  double drift = 0;            // rad/s
  double centre() const { return 0.5 * (plus + minus); }
};

/// Effects that a machine like this often has beside those declared.
enum class Lack { load_friction, hardening, slow_friction, delay };
constexpr Lack kLacks[] = {Lack::load_friction, Lack::hardening, Lack::slow_friction, Lack::delay};
std::string lack_name(Lack lack);

/// Everything is low-passed after what does not slide has been set to 0.
class LockedSignals {
 public:
  /// `rig` at the load side, with rigid couplings. Throws CannotIdentify.
  LockedSignals(const record::Record& record, const model::Rig& rig);

  const ServoData& data() const { return data_; }
  double cutoff() const { return cutoff_; }
  double middle() const { return 0.5 * double(data_.size()) * data_.interval; }  // s
  const std::vector<char>& counts() const { return counts_; }
  /// Samples that count, as many as a signal of this bandwidth has independent values.
  const std::vector<Eigen::Index>& rows() const { return rows_; }
  /// a, v, sign(v), 1; all samples.
  const Eigen::MatrixXd& columns() const { return columns_; }

  /// N m, less what the rig declares beside the columns and the mesh, which a mesh of these values may
  /// change.
  Eigen::VectorXd torque(const model::Rig& rig, const LockedMesh& mesh) const;
  /// rad/s^2, rad/s: standard deviation of the noise of both columns.
  std::pair<double, double> noise_of_motion() const;
  /// Rows: where the motor is, and how fast, in `count` places each and either way.
  Eigen::MatrixXd states(int count) const;
  /// 0 to 1: largest correlation of what the low-pass leaves out of the torque with steps of the position
  /// beside it, as in a closed loop whose torque answers to the noise of the position; at least what chance
  /// may hide.
  double answer() const;
  /// Whether the motor's torque drives it to and fro between the samples: above the band of the low-pass
  /// torque and steps of the position are correlated, and the torque is large enough to reverse a motor of
  /// this inertia within a sample.
  bool chatters(double inertia) const;
  /// What a delay of one sample adds to the torque.
  Eigen::VectorXd delayed_by_sample() const;
  /// N m, of the contact law of `rig` with these values.
  Eigen::VectorXd mesh_torque(const model::Rig& rig, const LockedMesh& mesh) const;
  /// In the effect's own unit.
  Eigen::VectorXd lack(Lack lack, const model::Rig& rig, const LockedMesh& mesh) const;

  Eigen::VectorXd picked(const Eigen::VectorXd& values) const;
  Eigen::MatrixXd picked(const Eigen::MatrixXd& values) const;

 private:
  /// Samples over which the speed is smoothed (servo_data.h); so near to a stop it shows no direction.
  long reach() const;
  std::vector<double> raw_mesh_torque(const model::Rig& rig, const LockedMesh& mesh) const;
  Eigen::VectorXd low_passed(std::vector<double> values) const;

  ServoData data_;
  double cutoff_;
  // rad, as recorded: where a slow motion starts and stops a low-pass would bend it by more than the
  // encoder's steps
  std::vector<double> position_;
  double position_noise_;  // rad
  double usual_speed_;     // rad/s
  std::vector<double> fast_torque_,
      fast_step_;  // N m, rad per sample: above the band, where the motor slides
  std::vector<int> direction_;
  std::vector<char> counts_;
  std::vector<Eigen::Index> rows_;
  Eigen::MatrixXd columns_;
};

}  // namespace backlash::identification
