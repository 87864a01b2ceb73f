#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "trundle/geometry/angle.hpp"

namespace trundle {

// Elementary functions without branches or calls, so that a loop over particles becomes vector code with the
// same bits as one particle alone. Coefficients of atan and log are those of FDLIBM [Sun 1993].

/// atan2, within 5e-16 · |angle|; 0 at (0, 0). Finite arguments.
inline double straight_atan2(double y, double x) {
  const double ax = std::abs(x);
  const double ay = std::abs(y);
  const double larger = ax > ay ? ax : ay;
  const double smaller = ax > ay ? ay : ax;
  const double t = smaller / (larger > 0.0 ? larger : 1.0);
  // atan t = π/4 + atan((t − 1)/(t + 1)) above tan(π/8)
  const bool reduce = t > 0.41421356237309503;
  const double r = (reduce ? t - 1.0 : t) / (reduce ? t + 1.0 : 1.0);
  const double z = r * r;
  const double tail =
      z * (3.33333333333329318027e-01 +
           z * (-1.99999999998764832476e-01 +
                z * (1.42857142725034663711e-01 +
                     z * (-1.11111104054623557880e-01 +
                          z * (9.09088713343650656196e-02 +
                               z * (-7.69187620504482999495e-02 +
                                    z * (6.66107313738753120669e-02 +
                                         z * (-5.83357013379057348645e-02 +
                                              z * (4.97687799461593236017e-02 +
                                                   z * (-3.65315727442169155270e-02 +
                                                        z * 1.62858201153657823623e-02))))))))));
  const double octant = (reduce ? 0.25 * kPi : 0.0) + (r - r * tail);
  const double quadrant = ay > ax ? 0.5 * kPi - octant : octant;
  const double half = x < 0.0 ? kPi - quadrant : quadrant;
  return y < 0.0 ? -half : half;
}

/// Natural logarithm, within 1 unit in the last place or 1e-16; normal positive arguments.
inline double straight_log(double x) {
  constexpr double kLn2Hi = 6.93147180369123816490e-01;
  constexpr double kLn2Lo = 1.90821492927058770002e-10;
  constexpr std::uint64_t kRootHalf = 0x3fe6a09e667f3bcdULL;  // √½: the mantissa becomes √½ to √2
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x) - kRootHalf + 0x3ff0000000000000ULL;
  const std::uint64_t exponent = bits >> 52U;
  const double k = std::bit_cast<double>(exponent | 0x4330000000000000ULL) - (0x1p52 + 1023.0);
  const double m = std::bit_cast<double>((bits & 0xfffffffffffffULL) + kRootHalf);
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  const double R =
      z * (6.666666666666735130e-01 +
           z * (3.999999999940941908e-01 +
                z * (2.857142874366239149e-01 +
                     z * (2.222219843214978396e-01 +
                          z * (1.818357216161805012e-01 +
                               z * (1.531383769920937332e-01 + z * 1.479819860511658591e-01))))));
  const double half_square = 0.5 * f * f;
  return k * kLn2Hi - ((half_square - (s * (half_square + R) + k * kLn2Lo)) - f);
}

}  // namespace trundle
