#include "backlash_diagnosis/identification/robust_mean.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/identification/least_squares.h"

namespace backlash {

Measured robust_mean(const std::vector<Measured>& values) {
  std::vector<double> errors;
  for (const Measured& m : values) errors.push_back(m.standard_error);
  if (values.size() < 2) throw CannotIdentify("a mean of fewer than two values has no standard error");
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  const double typical = errors[errors.size() / 2];
  const auto n = Eigen::Index(values.size());
  Eigen::MatrixXd a(n, 1);
  Eigen::VectorXd b(n);
  double information = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Measured& m = values[std::size_t(i)];
    const double error = std::hypot(m.standard_error, typical), weight = error > 0 ? 1 / error : 1;
    a(i, 0) = weight;
    b[i] = weight * m.value;
    information += 1 / (m.standard_error * m.standard_error);
  }
  Measured mean = fit_robust(a, b).parameter(0);
  mean.standard_error = std::max(mean.standard_error, 1 / std::sqrt(information));
  return mean;
}

}  // namespace backlash
