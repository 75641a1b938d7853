// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/robust_mean.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr double kOutlier = 3;  // standard deviations

/// By which every value is divided before they are compared.
std::vector<double> sizes(const std::vector<Measured>& values) {
  std::vector<double> errors;
  for (const Measured& m : values) errors.push_back(m.standard_error);
  if (std::any_of(errors.begin(), errors.end(), [](double e) { return std::isnan(e); }))
    return std::vector<double>(values.size(), 1);
  const double typical = median(errors);
  std::vector<double> sizes;
  for (const Measured& m : values) {
    const double error = std::hypot(m.standard_error, typical);
    sizes.push_back(error > 0 ? error : 1);
  }
  return sizes;
}

}  // namespace

RobustMean robust_mean(const std::vector<Measured>& values) {
  if (values.empty()) throw CannotIdentify("no value to take the mean of");
  if (values.size() == 1) return {values.front(), {}};
  const std::vector<double> size = sizes(values);
  const auto n = Eigen::Index(values.size());
  Eigen::MatrixXd a(n, 1);
  Eigen::VectorXd b(n);
  double information = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Measured& m = values[std::size_t(i)];
    a(i, 0) = 1 / size[std::size_t(i)];
    b[i] = m.value / size[std::size_t(i)];
    information += std::isnan(m.standard_error) ? 0 : 1 / (m.standard_error * m.standard_error);
  }
  const LeastSquaresFit fit = fit_robust(a, b);
  RobustMean mean{fit.parameter(0), {}};
  if (information > 0) mean.standard_error = std::max(mean.standard_error, 1 / std::sqrt(information));
  for (Eigen::Index i = 0; i < n; ++i)
    if (std::fabs(fit.residuals[i]) > kOutlier * fit.deviation) mean.outliers.push_back(std::size_t(i));
  return mean;
}

}  // namespace backlash::signal
