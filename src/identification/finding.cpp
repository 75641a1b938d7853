// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/finding.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
std::map<std::string, signal::Measured> combine_findings(const std::vector<Finding>& findings,
                                                         const model::Rig& rig,
                                                         const std::vector<std::string>& names) {
  const auto index = [&](const std::string& name) {
    return Eigen::Index(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const Eigen::Index n = Eigen::Index(names.size());
  Eigen::VectorXd declared(n), size(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    declared[i] = rig_file::servo_parameter(names[i]).get(rig);
    size[i] = declared[i] != 0 ? kDeclaredUncertainty * std::fabs(declared[i]) : 1;
  }
  // Deviations from the declared values, in units of their uncertainties.
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  struct Row {
    Eigen::VectorXd a;
    double b;
  };
  std::vector<Row> rows;
  std::vector<bool> found(n, false);
  for (const Finding& finding : findings) {
    const double error = finding.measured.standard_error;
    if (!(error > 0) || !std::isfinite(finding.measured.value)) continue;
    Row row{Eigen::VectorXd::Zero(n), finding.measured.value / error};
    for (const auto& [name, factor] : finding.combination) {
      const Eigen::Index i = index(name);
      if (i == n) continue;
      row.a[i] = factor * size[i] / error;
      row.b -= factor * declared[i] / error;
      found[i] = true;
    }
    information += row.a * row.a.transpose();
    gradient += row.a * row.b;
    rows.push_back(std::move(row));
  }
  const Eigen::MatrixXd covariance = signal::symmetric_inverse(information);
  const Eigen::VectorXd deviation = covariance * gradient;
  double chi2 = 0;
  for (const Row& row : rows) chi2 += std::pow(row.b - row.a.dot(deviation), 2);
  const double freedom = double(rows.size()) - double(std::count(found.begin(), found.end(), true));
  const double growth = freedom > 0 ? std::sqrt(std::max(1.0, chi2 / freedom)) : 1;
  std::map<std::string, signal::Measured> result;
  for (Eigen::Index i = 0; i < n; ++i)
    if (found[i])
      result[names[i]] = {declared[i] + size[i] * deviation[i],
                          growth * size[i] * std::sqrt(covariance(i, i))};
  return result;
}

}  // namespace backlash::identification
