// SPDX-License-Identifier: BSD-3-Clause
#include "local_strength.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "found_effects.h"

namespace backlash::identification {
namespace {

constexpr double kActsMost = 0.5,
                 kNearlyAll = 0.95;  // choice: of what the effect changes at nearly all samples
constexpr double kRidge = 1e-10;     // theory: of a squared sensitivity: what these rows do not show stays

/// Columns of the strengths of all effects, each first of its term's, and which columns are not shapes.
struct Columns {
  std::vector<Eigen::Index> strength;  // of the first term of each effect
  std::vector<Eigen::Index> free;
};

Columns columns_of(const Hypothesis& h) {
  Columns c;
  const auto declared = Eigen::Index(h.declared->parameters.size());
  for (Eigen::Index i = 0; i < declared; ++i) c.free.push_back(i);
  Eigen::Index at = declared;
  for (const Effect& effect : h.effects) {
    c.strength.push_back(at);
    for (std::size_t t = 0; t < effect.candidate.terms.size(); ++t) {
      const bool map = model::term_type(effect.candidate.id).map.has_value();
      const auto shapes = Eigen::Index(map ? 0 : fitted_shapes(effect.candidate, t).size()),
                 all = Eigen::Index(fitted_count(effect.candidate, t));
      for (Eigen::Index i = 0; i < all - shapes; ++i) c.free.push_back(at + i);
      at += all;
    }
  }
  for (; at < h.fitted->fit.fit.jacobian.cols(); ++at) c.free.push_back(at);  // calibrations
  return c;
}

/// Rows of the records of the other channel, of this one those where |column| is large; then the
/// priors.
std::vector<Eigen::Index> rows_where_it_acts(const Hypothesis& h, const Eigen::VectorXd& column,
                                             bool deflection) {
  const auto& layout = h.fitted->records.layout();
  std::vector<double> sizes;
  for (std::size_t i = 0; i < layout.size(); ++i)
    if (layout[i].deflection == deflection && column[Eigen::Index(i)] != 0)
      sizes.push_back(std::fabs(column[Eigen::Index(i)]));
  const double least = sizes.empty() ? 0 : kActsMost * signal::quantile(sizes, kNearlyAll);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    const bool of_record = std::size_t(i) < layout.size();
    if (!of_record || layout[std::size_t(i)].deflection != deflection || std::fabs(column[i]) > least)
      rows.push_back(i);
  }
  return rows;
}

}  // namespace

std::optional<LocalStrength> local_strength(const Hypothesis& h, std::size_t effect,
                                            const signal::Measured& judged) {
  const Candidate& candidate = h.effects[effect].candidate;
  if (candidate.terms.size() != 1 || model::term_type(candidate.id).map) return std::nullopt;
  const signal::LeastSquaresFit& fit = h.fitted->fit.fit;
  const Columns columns = columns_of(h);
  const Eigen::Index strength = columns.strength[effect];
  const auto rows = rows_where_it_acts(h, fit.jacobian.col(strength), h.effects[effect].gain.deflection);
  const Eigen::MatrixXd part = fit.jacobian(rows, columns.free);
  const Eigen::VectorXd unit = part.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::MatrixXd scaled = part * unit.asDiagonal();
  Eigen::MatrixXd normal = signal::gram(scaled);
  normal.diagonal().array() += kRidge;
  const Eigen::VectorXd residuals = fit.residuals(rows);
  const Eigen::VectorXd step =
      -unit.cwiseProduct(signal::solve_symmetric(normal, scaled.transpose() * residuals));
  const auto at = std::find(columns.free.begin(), columns.free.end(), strength) - columns.free.begin();
  const double variance = (residuals + part * step).squaredNorm() / double(rows.size());
  const double error = unit[at] * std::sqrt(variance * signal::symmetric_inverse(normal)(at, at));
  const double one = h.fitted->start.parameters[std::size_t(strength)].positive ? 1 : judged.value;
  const double independent = std::sqrt(fit.covariance(strength, strength)) / std::fabs(one),
               correlation = std::max(1.0, judged.standard_error / std::fabs(judged.value) / independent);
  return LocalStrength{1 + step[at] / one, correlation * error / std::fabs(one)};
}

}  // namespace backlash::identification
