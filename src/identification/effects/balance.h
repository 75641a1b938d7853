// SPDX-License-Identifier: BSD-3-Clause
// Two equations of a geared machine with two encoders that need no simulation of its teeth and are linear in
// all unknowns.
//   whole train     tau = J_M a_M + J_L a_L + b w_M + F s_M - terms on either end
//   pressed flank   q_M - q_L = zero + side g / 2 + T / k + skew w_L + shift of the flank by terms
// s_M = +-1 is the direction of the motor; T = J_L a_L + b_L w_L + F_L s_M, with the values of a fit, is what
// the teeth transmit; side is its sign. The first is Newton's law of both bodies together: it holds whatever
// the teeth do, across the gap as well. Left out are samples at which dry friction may take any value (first
// equation) or no flank is pressed (second), and their neighbours within the memory of the low-pass.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/model/term.h"
#include "residual_orders.h"

namespace backlash::identification {

class Balance {
 public:
  /// Of the low-pass of each sum [Hz]. The first holds at any frequency, the second where the teeth are a
  /// spring.
  struct Cutoffs {
    double torque, deflection;
  };
  /// Of the machine with its terms. `data`: its records, which must outlive this.
  Balance(const Machine& machine, const std::vector<ServoData>& data, const Cutoffs& cutoffs);

  /// Measured minus the part that the machine's values and the strengths of its terms explain; each channel
  /// in units of its standard deviation.
  const Eigen::VectorXd& left() const { return left_; }
  /// How often per turn left() repeats.
  ResidualOrders orders() const;
  /// The change of both sums by a term, less the part that the machine's own values explain, in the same
  /// units; 0 if what remains is less than `least_own` of the change.
  Eigen::VectorXd column(const model::Term& term, double least_own) const;

  /// How much columns explain, in the channel in which they explain more: relative decreases of the norm of
  /// left().
  struct Explained {
    bool deflection = false;
    double gain = 0;           // with factors fitted to all records
    double gain_held_out = 0;  // of blocks, each with factors fitted to the others
    double of_signal = 0;      // held out, what is taken away over the standard deviation of the channel
  };
  /// Each record in so many `blocks`.
  Explained explained(const Eigen::MatrixXd& columns, int blocks) const;

 private:
  struct Sample {
    model::Motion motion;
    double direction = 0, side = 0;  // +1, -1, 0: neither
  };
  /// One record.
  struct Part {
    double interval = 0;
    std::vector<Sample> samples;
    std::vector<std::size_t> torque_rows, deflection_rows;  // samples that count
  };
  /// Both sums at all samples.
  struct Sums {
    std::vector<double> torque, deflection;  // N m, rad
  };
  Part part_of(const ServoData& data, const Calibration& calibration) const;
  Sums sums_of(const model::Term& term, const Part& part) const;
  Eigen::VectorXd rows(const std::vector<Sums>& of_parts) const;
  Eigen::VectorXd rows_of(const model::Term& term) const;
  std::vector<Eigen::VectorXd> base(const std::vector<ServoData>& data) const;
  Eigen::VectorXd measured(const Machine& machine, const std::vector<ServoData>& data) const;
  void scale(const Eigen::VectorXd& signal);
  struct Squares;  // of both channels, before and after
  Squares squares_of(const std::vector<Eigen::Index>& rows, const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& factors) const;

  const model::Rig rig_;
  const Cutoffs cutoffs_;
  double load_inertia_, stiffness_;
  std::vector<Part> parts_;
  std::vector<char> deflection_;  // of each row, whether it is one
  std::vector<double> time_;      // of each row, 0 to 1 in its record
  Eigen::VectorXd weights_, left_;
  double signal_[2] = {0, 0};  // of torque and deflection, in units of what is left
  Eigen::MatrixXd basis_;
};

}  // namespace backlash::identification
