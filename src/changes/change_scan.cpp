// SPDX-License-Identifier: BSD-3-Clause
#include "change_scan.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "healthy_columns.h"

namespace backlash::changes {

void Background::add_unknown(const Eigen::MatrixXd& more) {
  const Eigen::Index p = columns.cols();
  columns.conservativeResize(Eigen::NoChange, p + more.cols());
  columns.rightCols(more.cols()) = more;
  spread.conservativeResize(p + more.cols());
  spread.tail(more.cols()).setConstant(std::numeric_limits<double>::infinity());
}

void Background::solve() {
  Eigen::MatrixXd information = columns.transpose() * columns / variance;
  for (Eigen::Index i = 0; i < spread.size(); ++i)
    information(i, i) += std::isfinite(spread[i]) ? 1 / (spread[i] * spread[i])
                         : information(i, i) > 0  ? 1e-9 * information(i, i)
                                                  : 1;  // nothing shows it: it stays 0
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols());
  inverse = scale.asDiagonal() * Eigen::MatrixXd(scaled.ldlt().solve(identity)) * scale.asDiagonal();
  estimate = inverse * (columns.transpose() * residual / variance);
}

namespace {

/// (N m)^2, of unknown times of the samples.
double timing_variance(const HealthyModel& model, const SampledMotion& motion) {
  if (motion.unsure_time == 0 || motion.sampling.channel != ChangeChannel::torque) return 0;
  double squares = 0;
  for (Eigen::Index r = 0; r < motion.size(); ++r) squares += std::pow(motion.moment(r).speed, 2);
  const double place = squares / double(motion.size()) * std::pow(motion.unsure_time, 2);
  const double dt = motion.sampling.interval / double(motion.sampling.thinned);
  return std::pow(model.values[kInertia], 2) * place * 2 * dt * std::pow(2 * M_PI, 4) *
         std::pow(motion.sampling.cutoff, 5) / 5;
}

}  // namespace

double noise_variance(const HealthyModel& model, const SampledMotion& motion) {
  double healthy = 0;
  for (const SampledMotion& record : *model.records)
    healthy += timing_variance(model, record) / double(model.records->size());
  return model.noise * model.noise + std::max(0.0, timing_variance(model, motion) - healthy);
}

Background background_of(const HealthyModel& model, const SampledMotion& motion,
                         const ChangeSettings& settings) {
  Whitened whitened = residual_of(model, motion, settings);
  Background b;
  b.residual = std::move(whitened.residual);
  b.columns = std::move(whitened.nuisances);
  b.spread = std::move(whitened.spread);
  b.variance = noise_variance(model, motion);
  b.solve();
  return b;
}

EffectSums::EffectSums(const SampledMotion& motion, const Eigen::MatrixXd& z, const Background& background,
                       double block, bool ramp)
    : block_(block), ramp_(ramp) {
  const auto blocks = static_cast<std::size_t>(motion.moments.back().time / block) + 1;
  gram_.assign(blocks + 1, Eigen::MatrixXd::Zero(z.cols(), z.cols()));
  cross_.assign(blocks + 1, Eigen::MatrixXd::Zero(z.cols(), background.columns.cols()));
  moments_.assign(blocks + 1, Eigen::VectorXd::Zero(z.cols()));
  Eigen::Index end = motion.size();
  for (std::size_t k = blocks; k-- > 0;) {
    Eigen::Index begin = end;
    while (begin > 0 && motion.time(begin - 1) >= block * double(k)) --begin;
    const auto rows = z.middleRows(begin, end - begin);
    gram_[k] = gram_[k + 1];
    cross_[k] = cross_[k + 1];
    moments_[k] = moments_[k + 1];
    if (begin < end) {
      gram_[k] += rows.transpose() * rows;
      cross_[k] += rows.transpose() * background.columns.middleRows(begin, end - begin);
      moments_[k] += rows.transpose() * background.residual.segment(begin, end - begin);
    }
    end = begin;
  }
}

EffectSums::Score EffectSums::score(std::size_t from, std::size_t to, const Background& background) const {
  return score(normal(from, to, background));
}

EffectSums::Normal EffectSums::normal(std::size_t from, std::size_t to, const Background& background) const {
  const double v = background.variance;
  Eigen::MatrixXd a = (gram_[from] - gram_[to]) / v, b = (cross_[from] - cross_[to]) / v;
  Eigen::VectorXd c = (moments_[from] - moments_[to]) / v;
  if (ramp_) {  // (t - onset) f = t f - onset f
    Eigen::RowVector2d w(-onset(from), 1);
    const Eigen::MatrixXd wa = w * a * w.transpose(), wb = w * b;
    const Eigen::VectorXd wc = w * c;
    a = wa;
    b = wb;
    c = wc;
  }
  return {a.diagonal(), a - b * background.inverse * b.transpose(), c - b * background.estimate};
}

EffectSums::Score EffectSums::score(const Normal& normal) {
  Score score;
  for (Eigen::Index i = 0; i < normal.own.size(); ++i)
    if (!(normal.information(i, i) > kLeastOwn * normal.own[i]) || !(normal.own[i] > 0)) return score;
  score.covariance = normal.information.inverse();
  score.values = score.covariance * normal.moment;
  score.gain = normal.moment.dot(score.values);
  if (!std::isfinite(score.gain) || score.gain < 0) return {};
  return score;
}

double score_inflation(const SampledMotion& motion, const Eigen::VectorXd& residual,
                       const Eigen::MatrixXd& columns, double variance, double window) {
  double most = 1;
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    double squares = 0, sum = 0, last = 0;
    for (Eigen::Index r = 0; r < columns.rows(); ++r) {
      if (motion.time(r) - last > window) {
        squares += sum * sum;
        sum = 0;
        last = motion.time(r);
      }
      sum += columns(r, i) * residual[r];
    }
    squares += sum * sum;
    if (const double white = variance * columns.col(i).squaredNorm(); white > 0)
      most = std::max(most, squares / white);
  }
  return most;
}

}  // namespace backlash::changes
