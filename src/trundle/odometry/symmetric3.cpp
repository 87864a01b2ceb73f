#include "trundle/odometry/symmetric3.hpp"

namespace trundle::odometry {

Matrix3 full_matrix(const Symmetric3& s) {
  return (Matrix3() << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]).finished();
}

Symmetric3 symmetric_of(const Matrix3& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

}  // namespace trundle::odometry
