#include "trundle/calibration/student_t.hpp"

#include <array>
#include <cassert>

namespace trundle {
namespace {

constexpr double kNormal95 = 1.959963984540054;

constexpr std::array kStudentT95 = {12.706205, 4.302653, 3.182446, 2.776445, 2.570582, 2.446912, 2.364624,
                                    2.306004,  2.262157, 2.228139, 2.200985, 2.178813, 2.160369, 2.144787,
                                    2.131450,  2.119905, 2.109816, 2.100922, 2.093024, 2.085963};

/// Cornish and Fisher's expansion about the normal quantile z, in powers of 1/n.
double student_t_by_expansion(double n) {
  constexpr double z = kNormal95;
  constexpr double z2 = z * z;
  constexpr double g1 = z * (z2 + 1.0) / 4.0;
  constexpr double g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
  constexpr double g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
  return z + g1 / n + g2 / (n * n) + g3 / (n * n * n);
}

}  // namespace

double student_t_95(int degrees_of_freedom) {
  assert(degrees_of_freedom >= 1);
  const std::size_t index = static_cast<std::size_t>(degrees_of_freedom) - 1;
  return index < kStudentT95.size() ? kStudentT95[index] : student_t_by_expansion(degrees_of_freedom);
}

}  // namespace trundle
