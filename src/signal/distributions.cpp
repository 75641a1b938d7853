// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::signal {
namespace {

// Without this each number would be computed in long double, for a digit that nobody needs.
using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
using Student = boost::math::students_t_distribution<double, Policy>;
using ChiSquare = boost::math::chi_squared_distribution<double, Policy>;

void require_degrees(double degrees) {
  if (!(degrees > 0)) throw InvalidParameter("degrees of freedom", degrees, "must be > 0");
}

void require_probability(double probability) {
  if (!(probability > 0 && probability < 1))
    throw InvalidParameter("probability", probability, "must be > 0 and < 1");
}

}  // namespace

double student_t_quantile(double probability, double degrees) {
  require_probability(probability);
  require_degrees(degrees);
  return boost::math::quantile(Student(degrees), probability);
}

double student_t_two_sided(double t, double degrees) {
  require_degrees(degrees);
  if (std::isinf(t)) return 0;
  return std::isnan(t) ? t : 2 * boost::math::cdf(Student(degrees), -std::fabs(t));
}

double chi_square_quantile(double probability, double degrees) {
  require_probability(probability);
  require_degrees(degrees);
  return boost::math::quantile(ChiSquare(degrees), probability);
}

double chi_square_probability(double x, double degrees) {
  require_degrees(degrees);
  if (!(x >= 0)) throw InvalidParameter("chi square", x, "must be >= 0");
  return std::isinf(x) ? 1 : boost::math::cdf(ChiSquare(degrees), x);
}

}  // namespace backlash::signal
