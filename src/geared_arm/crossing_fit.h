// SPDX-License-Identifier: BSD-3-Clause
// Plays and teeth that explain the torques of the motors about all turns of the load, by the method of Gauss,
// Newton, Levenberg and Marquardt. Equations: geared_arm/traverse.h.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "crossing_motion.h"

namespace backlash::geared_arm {

class CrossingFit {
 public:
  explicit CrossingFit(const CrossingData& data);

  /// Begins with gaps [rad] and with everything else as declared.
  void begin(const std::vector<double>& gaps);
  /// The gap of this joint stays as it is.
  void hold_gap(std::size_t joint, bool held) { held_[joint] = held; }
  void set_gap(std::size_t joint, double gap);
  /// At most so many steps; ends where at the pace of a step all of them would not bring the cost down to
  /// what is wanted.
  void run(int steps, double wanted = std::numeric_limits<double>::infinity());
  /// Takes, joint by joint, the gap of `grid` that explains most, all else as it is.
  void scan(const std::vector<double>& grid);

  double gap(std::size_t joint) const { return machine_[joint][kCrossingGap]; }
  const CrossingMachine& machine() const { return machine_; }
  const Eigen::VectorXd& own(std::size_t window) const { return own_[window]; }
  /// Minus twice the logarithm of the likelihood of the residuals and of the deviations from what is known.
  double cost() const { return cost_; }
  /// The same with another gap; only each window's own values are fitted anew.
  double cost_with(std::size_t joint, double gap) const;
  /// Root of the mean square of a joint's weighted residuals that most windows do not exceed: about 1 where
  /// the equations hold.
  double misfit(std::size_t joint) const;

  struct Errors {
    double own = 0, clustered = 0;  // rad, standard errors of the gap
    double turns = 0;               // how many turns determine it, better ones counting more
  };
  std::vector<Errors> errors() const;  // per joint

 private:
  struct Part {                        // of one window
    Eigen::VectorXd residual, offset;  // offset: of half the gradient by the machine, see shaken()
    Eigen::MatrixXd global, own;       // derivatives by the machine, by what is of this window alone
  };
  struct Reduced {                         // by one window of the machine, its own values taken out
    Eigen::MatrixXd inverse, information;  // inverse: of the information on its own values
    Eigen::VectorXd score;
  };
  static Reduced reduced(const Part& part, const Eigen::MatrixXd& known, const Eigen::VectorXd& own);
  Eigen::VectorXd residual(std::size_t window, const CrossingMachine& machine,
                           const Eigen::VectorXd& own) const;
  Part part(std::size_t window) const;
  std::vector<Part> parts() const;
  void weigh(std::size_t window, Part& part) const;
  double shaken(std::size_t window, std::size_t joint, const CrossingMachine& machine) const;
  double cost_of(std::size_t window, const Eigen::VectorXd& residual, const CrossingMachine& machine) const;
  double cost_of(const CrossingMachine& machine, const std::vector<Eigen::VectorXd>& own) const;
  double cost_of(std::size_t window, const CrossingMachine& machine, const Eigen::VectorXd& own) const;
  double prior_cost(const CrossingMachine& machine) const;
  void add_priors(Eigen::MatrixXd& h, Eigen::VectorXd& g) const;
  void hold_at_bounds(Eigen::MatrixXd& h, Eigen::VectorXd& g) const;
  double centre(std::size_t joint, int value) const;
  double spread(std::size_t joint, int value) const;
  Eigen::VectorXd own_spread(const CrossingMachine& machine) const;
  CrossingMachine moved(const Eigen::VectorXd& step) const;
  bool take(const CrossingMachine& machine, const std::vector<Part>& parts,
            const std::vector<Reduced>& normals);
  void take_rotors();
  void whiten();

  const CrossingData& data_;
  CrossingMachine machine_;
  std::vector<char> held_;
  std::vector<Eigen::VectorXd> own_;                   // per window: as mesh_torques() has it
  std::vector<std::vector<Eigen::MatrixXd>> factors_;  // of covariances, lower: per window, per joint
  std::vector<std::vector<double>> shaken_;            // the same: squares that noise of the position leaves
  std::shared_ptr<const std::vector<LinkMobilities>> mobilities_;  // per window, with the machine's rotors
  double cost_ = 0, damping_ = 1e-3;
};

}  // namespace backlash::geared_arm
