// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/blocks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr std::size_t kBatches = 10;
constexpr double kSmallestPivot = 1e-10;  // of the equations with columns of length 1

constexpr double kUnsteady = 4;  // deviations

}  // namespace

std::vector<double> block_means(const std::vector<double>& values, std::size_t length) {
  std::vector<double> means;
  for (std::size_t k = 0; k + length <= values.size(); k += length)
    means.push_back(std::accumulate(values.begin() + k, values.begin() + k + length, 0.0) / double(length));
  return means;
}

std::pair<std::size_t, std::size_t> steady_range(const std::vector<double>& values, double most,
                                                 double allowed_change) {
  const std::size_t n = values.size();
  if (n < 4) return {0, n};
  std::vector<double> middle(values.begin() + n / 4, values.begin() + (3 * n + 3) / 4);
  const double level = median(middle);
  for (double& value : middle) value = std::fabs(value - level);
  const double allowed =
      std::max(kUnsteady * kNormalPerMedianDeviation * median(middle), allowed_change * std::fabs(level));
  const auto reach = static_cast<std::size_t>(most * double(n));
  std::size_t first = reach, last = n - reach;
  while (first > 0 && std::fabs(values[first - 1] - level) <= allowed) --first;
  while (last < n && std::fabs(values[last] - level) <= allowed) ++last;
  return {first, last};
}

Measured batch_mean(const std::vector<double>& values) {
  Measured mean;
  mean.value = std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
  if (values.size() < kBatches) return mean;
  const std::vector<double> batches = block_means(values, values.size() / kBatches);
  const double n = double(batches.size());
  const double centre = std::accumulate(batches.begin(), batches.end(), 0.0) / n;
  double squares = 0;
  for (const double batch : batches) squares += std::pow(batch - centre, 2);
  mean.standard_error = std::sqrt(squares / (n - 1) / n);
  return mean;
}

Eigen::MatrixXd jackknife_changes(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                  const std::vector<std::size_t>& block) {
  const std::size_t blocks = block.empty() ? 0 : *std::max_element(block.begin(), block.end()) + 1;
  if (blocks < 4)
    throw CannotIdentify(fmt::format("only {} independent blocks of data: too few for an error", blocks));
  const Eigen::Index n = a.cols();
  const Eigen::VectorXd unit = a.colwise().norm().cwiseInverse();
  std::vector<Eigen::MatrixXd> normal(blocks, Eigen::MatrixXd::Zero(n, n));
  std::vector<Eigen::VectorXd> gradient(blocks, Eigen::VectorXd::Zero(n));
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < a.rows(); ++k) {
    const Eigen::VectorXd row = a.row(k).transpose().cwiseProduct(unit);
    normal[block[k]] += row * row.transpose();
    gradient[block[k]] += row * residuals[k];
  }
  for (const auto& part : normal) all += part;
  Eigen::MatrixXd changes(n, blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    const Eigen::MatrixXd rest = all - normal[b];
    if (!(smallest_pivot(rest) > kSmallestPivot))
      throw CannotIdentify(
          "one part of the data decides alone: without it the unknowns cannot be distinguished");
    changes.col(b) = -solve_symmetric(rest, gradient[b]).cwiseProduct(unit);
  }
  const Eigen::VectorXd mean = changes.rowwise().mean();
  changes.colwise() -= mean;
  return changes;
}

Eigen::MatrixXd jackknife_covariance(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                     const std::vector<std::size_t>& block) {
  const Eigen::MatrixXd changes = jackknife_changes(a, residuals, block);
  return gram(changes.transpose()) * (double(changes.cols() - 1) / double(changes.cols()));
}

double jackknife_error(const Eigen::VectorXd& changes) {
  return std::sqrt(changes.squaredNorm() * double(changes.size() - 1) / double(changes.size()));
}

}  // namespace backlash::signal
