// SPDX-License-Identifier: BSD-3-Clause
// A damaged tooth: a bump at one place of the travel, once per turn of the axis of the motor's position,
//   o = A exp(-(c / w)^2 / 2),  c = 2 sin((q - q0) / 2)      as the term `local_fault` has it,
// of the torque, A [N m] another one moving forward and backward: equal for a push, opposite for friction,
// one of them nothing for a single flank; or of the deflection, A [rad] of the forward and of the backward
// flank.
#pragma once

#include <vector>

#include "change_effects.h"

namespace backlash::changes {

extern const char* const kLocalFault;  // its id

/// Columns: A forward, A backward.
ChangeEffect local_fault(ChangeChannel channel, double place, double width);

/// Columns of a fault with these values of A, and of its place and its width: the derivatives.
ChangeEffect fault_with_slopes(ChangeChannel channel, const ChangeEffect& fault,
                               const Eigen::VectorXd& values);

/// Rows about a fault, where it shows.
bool shows_fault(const ChangeEffect& fault, const Moment& moment);

/// Square of what passes through the place show in [from, to) [s], in standard errors: each pass counts as
/// one value of A, as slow ones have many rows of the same coloured noise, and scatters by what passes do in
/// all of the record. Passes that turn back there do not count, nor does the one of each direction that says
/// most: a push is at one place as well. 0 where too few are left. `left`: of the residual, without the
/// fault.
double repeated_gain(const SampledMotion& motion, const ChangeEffect& fault, const Eigen::VectorXd& left,
                     double from, double to);

/// Where a fault may be: residuals by bins of position, for all places, widths and onsets. A matched filter
/// without the nuisances and the filter of the signals: it says where to look closer, not what is there.
class FaultScreen {
 public:
  explicit FaultScreen(const SampledMotion& motion);

  /// Places and widths that are looked at: so many effects may be wrong by chance.
  std::size_t count() const { return tried_.size(); }
  /// Faults of more than `least` of twice the log likelihood ratio, some of each width, at any onset but in
  /// the first and last `margin` [s].
  std::vector<ChangeEffect> likeliest(const Eigen::VectorXd& left, double variance, double margin,
                                      double least) const;
  /// The largest twice the log likelihood ratio in [from, to) [s] of a fault of the same width at a place of
  /// its own.
  double elsewhere(const ChangeEffect& fault, const Eigen::VectorXd& left, double variance, double from,
                   double to) const;
  /// Wider is no place.
  double widest() const { return 2 * widths_.back(); }
  double narrowest() const { return 0.5 * widths_.front(); }

 private:
  struct Tried {
    double place, width;
    std::size_t bin;
  };
  struct Bins;
  double gain(const Tried& tried, const Bins& bins, double variance) const;

  const SampledMotion& motion_;
  double from_ = 0, bin_ = 1;
  bool turns_ = false;  // more than once: bins go round
  std::vector<double> widths_;
  std::vector<std::vector<double>> kernels_;  // of each width, from the middle on
  std::vector<Tried> tried_;
  std::vector<std::size_t> bin_of_row_;
  std::size_t bins_ = 0;
};

}  // namespace backlash::changes
