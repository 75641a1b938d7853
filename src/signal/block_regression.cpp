// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/block_regression.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr std::size_t kLeastBlocks = 4;  // choice

struct Block {
  std::vector<Eigen::Index> rows;
  Eigen::MatrixXd gram;      // X^T X
  Eigen::VectorXd gradient;  // X^T y
  double total = 0;          // y^T y
};

std::vector<Block> blocks_of(const Eigen::MatrixXd& x, const Eigen::VectorXd& y,
                             const std::vector<int>& block) {
  std::vector<Block> blocks(std::size_t(1 + *std::max_element(block.begin(), block.end())));
  for (std::size_t i = 0; i < block.size(); ++i)
    blocks[std::size_t(block[i])].rows.push_back(Eigen::Index(i));
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(), [](const Block& b) { return b.rows.empty(); }),
               blocks.end());
  for (Block& b : blocks) {
    const Eigen::MatrixXd rows = x(b.rows, Eigen::all);
    const Eigen::VectorXd values = y(b.rows);
    b.gram = gram(rows);
    b.gradient = rows.transpose() * values;
    b.total = values.squaredNorm();
  }
  return blocks;
}

/// Sum of squares of each block (row) that a fit to the others leaves, for signals that are y times a sign of
/// their own in each block: `signs` has a row per block and a column per signal.
Eigen::MatrixXd left_out(const std::vector<Block>& blocks, const Eigen::MatrixXd& signs, double ridge) {
  Eigen::MatrixXd normal = blocks[0].gram, gradient = blocks[0].gradient * signs.row(0);
  for (std::size_t i = 1; i < blocks.size(); ++i)
    normal += blocks[i].gram, gradient += blocks[i].gradient * signs.row(Eigen::Index(i));
  normal.diagonal().array() += ridge;
  Eigen::MatrixXd left(Eigen::Index(blocks.size()), signs.cols());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& b = blocks[i];
    const Eigen::MatrixXd own = b.gradient * signs.row(Eigen::Index(i));
    const Eigen::MatrixXd w = solve_symmetric(normal - b.gram, gradient - own);
    left.row(Eigen::Index(i)) =
        (w.cwiseProduct(product(b.gram, w)) - 2 * w.cwiseProduct(own)).colwise().sum().array() + b.total;
  }
  return left;
}

double share(double left, double total) {
  return total > 0 ? 1 - left / total : 0;
}

double total(const std::vector<Block>& blocks) {
  double sum = 0;
  for (const Block& b : blocks) sum += b.total;
  return sum;
}

PredictedShare with_interval(const std::vector<Block>& blocks, const Eigen::VectorXd& left, Random& random,
                             const BlockRegressionSettings& settings) {
  std::vector<double> shares;
  for (int draw = 0; draw < settings.draws; ++draw) {
    double l = 0, t = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const std::size_t at = random.below(blocks.size());
      l += left[Eigen::Index(at)], t += blocks[at].total;
    }
    shares.push_back(share(l, t));
  }
  return {std::max(0.0, share(left.sum(), total(blocks))), quantile(shares, 0.5 * settings.risk),
          std::max(0.0, quantile(shares, 1 - 0.5 * settings.risk))};
}

Eigen::MatrixXd drawn_signs(std::size_t blocks, int draws, Random& random) {
  Eigen::MatrixXd signs(Eigen::Index(blocks), draws);
  for (Eigen::Index i = 0; i < signs.size(); ++i) signs.data()[i] = random.uniform() < 0.5 ? -1 : 1;
  return signs;
}

}  // namespace

PredictedShare predicted_share(const Eigen::MatrixXd& features, const Eigen::VectorXd& y,
                               const std::vector<int>& block, const BlockRegressionSettings& settings) {
  if (block.empty() || features.cols() == 0) return {};
  Eigen::MatrixXd x = features;
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    const double norm = x.col(c).norm();
    if (norm > 0) x.col(c) *= std::sqrt(double(x.rows())) / norm;
  }
  const std::vector<Block> blocks = blocks_of(x, y, block);
  if (blocks.size() < kLeastBlocks) return {};
  const Eigen::MatrixXd itself = Eigen::MatrixXd::Ones(Eigen::Index(blocks.size()), 1);
  Eigen::VectorXd best;
  double best_ridge = 0;
  for (const double per_sample : settings.ridges) {
    const double ridge = per_sample * double(x.rows());
    const Eigen::VectorXd left = left_out(blocks, itself, ridge).col(0);
    if (best.size() == 0 || left.sum() < best.sum()) best = left, best_ridge = ridge;
  }
  Random random(settings.seed);
  PredictedShare out = with_interval(blocks, best, random, settings);
  const Eigen::MatrixXd flipped =
      left_out(blocks, drawn_signs(blocks.size(), settings.flips, random), best_ridge);
  for (Eigen::Index i = 0; i < flipped.cols(); ++i)
    out.chance = std::max(out.chance, share(flipped.col(i).sum(), total(blocks)));
  return out;
}

Eigen::MatrixXd hat_functions(const std::vector<double>& x, int count) {
  std::vector<double> knots;
  std::vector<double> sorted = x;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < count; ++i) {
    const double at = sorted[std::size_t(double(i) / (count - 1) * double(sorted.size() - 1))];
    if (knots.empty() || at > knots.back()) knots.push_back(at);
  }
  if (knots.size() < 2) return Eigen::MatrixXd(Eigen::Index(x.size()), 0);
  Eigen::MatrixXd hats = Eigen::MatrixXd::Zero(Eigen::Index(x.size()), Eigen::Index(knots.size()));
  for (std::size_t k = 0; k < x.size(); ++k) {
    const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, x[k]);
    const auto i = Eigen::Index(above - knots.begin());
    const double low = knots[std::size_t(i) - 1], high = knots[std::size_t(i)];
    const double part = std::clamp((x[k] - low) / (high - low), 0.0, 1.0);
    hats(Eigen::Index(k), i - 1) = 1 - part;
    hats(Eigen::Index(k), i) = part;
  }
  return hats;
}

Eigen::MatrixXd row_products(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd out(a.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    for (Eigen::Index j = 0; j < b.cols(); ++j) out.col(i * b.cols() + j) = a.col(i).cwiseProduct(b.col(j));
  return out;
}

}  // namespace backlash::signal
