// SPDX-License-Identifier: BSD-3-Clause
// Two parallel flanks in the plane of deflection and torque, fitted to the windows in which one of them is
// pressed for sure.
//
//   q_M - q_L = zero + scale q_L + eccentricity + errors over q_L + skew w_L + c (w_M - w_L)
//               + side b / 2 + g e(T + unsure x) + u |e|
//
// e is the declared elastic deflection of one side [rad], by a law of the teeth; T is the torque on the
// flanks (flank_torque.h), what is unsure of it is known to one standard deviation x = 0 +- 1, g to
// 1 +- `deviation`, u that one flank yields more than the other. The errors over q_L are hats whose size the
// record itself shows. b is the free play.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "flank_torque.h"
#include "flank_windows.h"
#include "prior_regression.h"

namespace backlash::diagnosis {

/// Deflection over torque of one side, both over those at the large torque: law(1) = 1.
struct ToothLaw {
  std::string name;
  std::function<double(double)> deflection;  // of a torque > 0
};
/// One after the other: powers of the torque from Hertz's 2/3 (points that touch, F = K d^1.5) to a spring's
/// 1; then springs that harden, u + h u^3 = (1 + h) t, whose deflection begins as a line.
const std::vector<ToothLaw>& tooth_laws();
constexpr std::size_t kUsualLaw = 4, kSpringLaw = 8;  // of them

struct FlankFit {
  double gap = 0, standard_error = 0;     // rad
  bool varies = false;                    // with the position of the load, between
  double least_gap = 0, largest_gap = 0;  // rad
  double compliance = 1;                  // g
  double elastic = 0;                     // rad, of one side at the large torque
  double residual = 0;                    // rad, typical
  double wrong = 0;                       // standard deviations, of what is unsure of the torque
  double skew = 0, scale_error = 0;       // s, -
  std::vector<double> left;               // rad, of all windows in use
  double independent = 0;                 // as how many windows they count
};

class FlankReading {
 public:
  /// `elastic` [rad]: declared, of one side at the large torque; `deviation`: of g about 1. `law` helps to
  /// find the windows; its play does not count.
  FlankReading(FlankWindows windows, FlankTorque torque, double elastic, double deviation,
               double encoder_scale, const ToothLaw& law);

  /// Either flank is pressed in so many windows.
  bool found() const { return found_; }
  std::size_t used(int side) const { return used_[side]; }
  std::size_t windows() const { return at_.size(); }
  std::size_t stays() const { return stays_; }
  double noise() const { return torque_.noise; }
  double shown() const { return torque_.shown; }

  /// With a gap that depends on the position, where that leaves clearly less.
  FlankFit fit(const ToothLaw& law) const;
  /// Of the windows in use number `begin` to `end`: its stays, 0 where a flank is missing.
  std::size_t fit_part(const ToothLaw& law, std::size_t begin, std::size_t end, FlankFit& fit) const;
  /// Of the windows in use, whose samples spread as if the flanks changed within them.
  double share_that_swings(const ToothLaw& law, const FlankFit& fit) const;

 private:
  struct Start {
    Eigen::VectorXd x;              // of what is unsure
    Eigen::MatrixXd covariance;     // of it
    double factor = 1, errors = 0;  // g; size of the errors over position, rad
    double scale = 0;               // of the residuals, rad; 0: not known
    std::vector<double> weight;
  };
  bool search(double last, const ToothLaw& law);
  bool choose(bool begins);
  PriorRegression solve(const ToothLaw& law, Start& start, int steps, const Hats& gap) const;
  FlankFit result(const ToothLaw& law, const Hats& gap) const;

  FlankWindows windows_;
  FlankTorque torque_;
  double elastic_, deviation_, encoder_scale_;
  Hats errors_, gap_;
  double middle_ = 0;  // rad, mean of q_L
  Start start_;
  bool found_ = false, varies_ = false;
  std::size_t used_[2] = {0, 0}, stays_ = 0;
  std::vector<std::size_t> at_, stay_;  // windows in use, and their stays
  std::vector<double> side_;            // of them
};

}  // namespace backlash::diagnosis
