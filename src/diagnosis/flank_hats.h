// SPDX-License-Identifier: BSD-3-Clause
// Functions of the load's position that the fit of the flanks and that of the torque share.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace backlash::diagnosis {

constexpr int kCommonKnots = 48;            // of f over the travel, and
constexpr double kWindowsPerKnot = 40;      // at least
constexpr std::size_t kFewestOnFlank = 12;  // windows

/// Piecewise linear functions of q, one per column: at most so many, and each for so many values.
Eigen::MatrixXd position_hats(const std::vector<double>& q, int most, double per_knot);

/// Of each row the first of the two neighbouring columns outside of which all are zero; 0 of less than two.
std::vector<Eigen::Index> first_knots(const Eigen::MatrixXd& h);

}  // namespace backlash::diagnosis
