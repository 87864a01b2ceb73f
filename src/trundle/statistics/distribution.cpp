#include "trundle/statistics/distribution.hpp"

#include <cassert>
#include <cmath>

#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace trundle::statistics {
namespace {

using boost::math::complement;
namespace policies = boost::math::policies;

/// double is enough, and what is beyond all bounds is infinite.
using Policy =
    policies::policy<policies::promote_double<false>, policies::overflow_error<policies::ignore_error>>;
using FisherF = boost::math::fisher_f_distribution<double, Policy>;
using StudentT = boost::math::students_t_distribution<double, Policy>;

}  // namespace

double chi_squared_tail(double x, double degrees_of_freedom) {
  return x <= 0.0 ? 1.0 : boost::math::gamma_q(0.5 * degrees_of_freedom, 0.5 * x, Policy());
}

double f_tail(double x, double numerator_dof, double denominator_dof) {
  return x <= 0.0 ? 1.0 : cdf(complement(FisherF(numerator_dof, denominator_dof), x));
}

double chi_squared_limit(double tail, double degrees_of_freedom) {
  assert(tail > 0.0 && tail < 1.0);
  return 2.0 * boost::math::gamma_q_inv(0.5 * degrees_of_freedom, tail, Policy());
}

double f_limit(double tail, double numerator_dof, double denominator_dof) {
  assert(tail > 0.0 && tail < 1.0);
  return quantile(complement(FisherF(numerator_dof, denominator_dof), tail));
}

double normal_limit(double tail) {
  assert(tail > 0.0 && tail < 1.0);
  return std::sqrt(2.0) * boost::math::erfc_inv(tail, Policy());
}

double student_t_limit(double tail, double degrees_of_freedom) {
  assert(tail > 0.0 && tail < 1.0);
  return quantile(complement(StudentT(degrees_of_freedom), 0.5 * tail));
}

}  // namespace trundle::statistics
