// SPDX-License-Identifier: BSD-3-Clause
#include "prior_regression.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kCauchy = 3;   // scales, at which a row counts half: choice
constexpr double kBegin = 0.2;  // of the rms of y, the first scale: choice, half of it is usually the gap

}  // namespace

/// A group repeats itself: what was known before counts as much against it as against one row.
double PriorRegression::unit() const {
  const double repeats = double(rows.size()) / double(std::max<std::size_t>(1, groups));
  return scale * scale * std::max(1.0, repeats);
}

void PriorRegression::step() {
  const Eigen::Index n = mean.size();
  if (weight.size() != rows.size()) weight.assign(rows.size(), 1);
  if (!(scale > 0)) {
    double sum = 0, squares = 0;
    for (const Row& r : rows) sum += r.y, squares += r.y * r.y;
    const double count = double(rows.size());
    scale = kBegin * std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count))) + 1e-12;
  }
  MatrixXd normal = MatrixXd::Zero(n, n);
  VectorXd right = VectorXd::Zero(n);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& r = rows[i];
    for (std::size_t p = 0; p < r.count; ++p) {
      const double weighted = weight[i] * r.value[p];
      right[r.column[p]] += weighted * r.y;
      for (std::size_t q = 0; q <= p; ++q) normal(r.column[p], r.column[q]) += weighted * r.value[q];
    }
  }
  normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
  const double variance = unit();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double precision = variance / (deviation[k] * deviation[k]);
    normal(k, k) += precision, right[k] += precision * mean[k];
    normal(k, k) = normal(k, k) > 0 ? (1 + 1e-12) * normal(k, k) : 1;  // no row has it: it gets 0
  }
  const VectorXd size = normal.diagonal().cwiseSqrt().cwiseInverse();  // columns are of different units
  const MatrixXd equal = size.asDiagonal() * normal * size.asDiagonal();
  inverse = size.asDiagonal() * signal::symmetric_inverse(equal) * size.asDiagonal();
  x = inverse * right;
  left.clear();
  for (const Row& r : rows) {
    left.push_back(r.y);
    for (std::size_t p = 0; p < r.count; ++p) left.back() -= r.value[p] * x[r.column[p]];
  }
  std::vector<double> sizes;
  for (const double l : left) sizes.push_back(std::abs(l));
  scale = signal::kNormalPerMedianDeviation * signal::median(std::move(sizes)) + 1e-12;
  for (std::size_t i = 0; i < rows.size(); ++i)
    weight[i] = 1 / (1 + left[i] * left[i] / (kCauchy * kCauchy * scale * scale));
}

double PriorRegression::independent() const {
  std::vector<double> sums(groups, 0.0);
  double squares = 0, of_sums = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double weighted = weight[i] * left[i];
    sums[rows[i].group] += weighted, squares += weighted * weighted;
  }
  for (const double s : sums) of_sums += s * s;
  return double(rows.size()) * squares / std::max(of_sums, squares);
}

double PriorRegression::variance(const VectorXd& of) const {
  const VectorXd row = inverse * of;
  std::vector<double> sums(groups, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double at = 0;
    for (std::size_t p = 0; p < rows[i].count; ++p) at += rows[i].value[p] * row[rows[i].column[p]];
    sums[rows[i].group] += at * weight[i] * left[i];
  }
  double squares = 0;
  for (const double s : sums) squares += s * s;
  constexpr double kFitted = 5;  // unknowns that the groups determine, beside what priors hold: choice
  squares *= double(groups) / std::max(1.0, double(groups) - kFitted);
  for (Eigen::Index k = 0; k < deviation.size(); ++k) squares += std::pow(row[k] * unit() / deviation[k], 2);
  return squares;
}

}  // namespace backlash::diagnosis
