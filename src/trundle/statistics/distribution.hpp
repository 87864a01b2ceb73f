#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

inline constexpr double kSignificant = 3.0;  ///< sigmas: beyond, it is no chance

// Tails and quantiles of the distributions that intervals and tests need; relative error below 1e-10.
// Quantiles are given by the probability of what lies *beyond* them, so that small ones keep their digits.

/// 95 % of χ² with two, and with three, degrees of freedom are below.
inline constexpr double kChiSquared2At95 = 5.991464547107979;
inline constexpr double kChiSquared3At95 = 7.814727903251178;
/// The same of |N(0, 1)|.
inline constexpr double kNormalAt95 = 1.959963984540054;

/// P(X > x) of χ² with so many degrees of freedom.
double chi_squared_tail(double x, double degrees_of_freedom);
/// P(X > x) of Fisher's F.
double f_tail(double x, double numerator_dof, double denominator_dof);

/// The x with P(X > x) = tail, 0 < tail < 1.
double chi_squared_limit(double tail, double degrees_of_freedom);
double f_limit(double tail, double numerator_dof, double denominator_dof);
/// The z with P(|N(0, 1)| > z) = tail: 1.96 for 0.05.
double normal_limit(double tail);
/// The t with P(|T| > t) = tail of Student's distribution.
double student_t_limit(double tail, double degrees_of_freedom);

}  // namespace trundle::statistics
