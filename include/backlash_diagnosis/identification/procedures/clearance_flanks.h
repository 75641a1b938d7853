// SPDX-License-Identifier: BSD-3-Clause
// Flanks, seen from the motion of a load that flies between them: the fit behind identify_clearance(), which
// has the equation. Linear but for the place of the flanks.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct Flanks {
  double lower = 0, gap = 0;  // rad
};

/// w^2 [1/s^2] and 2 z w [1/s] of the load on a flank; NaN: not known.
struct FlankContact {
  double stiffness = std::numeric_limits<double>::quiet_NaN();
  double damping = std::numeric_limits<double>::quiet_NaN();
};

/// One passage without what a polynomial explains: start, and a push of a degree in time, integrated twice.
class FlankPassage {
 public:
  /// `position` [rad] evenly sampled every `interval` [s], and the same low-passed, of which the penetration
  /// is taken.
  FlankPassage(const Eigen::VectorXd& position, Eigen::VectorXd smooth, double interval, int push_degree);

  Eigen::Index size() const { return smooth_.size(); }
  int polynomial() const { return int(basis_.cols()); }  ///< coefficients that are fitted beside the flanks
  const Eigen::VectorXd& measured() const { return measured_; }

  /// Columns of -w^2 and -2 z w at these flanks.
  Eigen::MatrixXd columns(const Flanks& flanks) const;

 private:
  Eigen::VectorXd integral(const Eigen::VectorXd& y) const;
  Eigen::VectorXd without_polynomial(const Eigen::VectorXd& y) const;

  double interval_;
  Eigen::VectorXd smooth_, measured_;
  Eigen::MatrixXd basis_;
};

struct PassageFit {
  Flanks flanks;
  FlankContact contact;
  signal::Measured gap;       // rad
  double deviation = 0;       // rad, of the residuals
  double without_flanks = 0;  // rad, the same for the polynomials alone
  Eigen::VectorXd residuals;  // rad, passage after passage
};

/// The flanks common to all passages, which reach from `low` to `high` [rad]; of the contact what is not
/// `known`, its damping >= 0. Starts from the best of a grid of flanks. Throws CannotIdentify where nothing
/// fits.
PassageFit fit_flanks(const std::vector<FlankPassage>& passages, double low, double high,
                      const FlankContact& known);

}  // namespace backlash::identification
