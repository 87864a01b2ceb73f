#include "trundle/chassis/contact.hpp"

#include <cmath>
#include <utility>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/chassis/rows.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::chassis {
namespace {

/// One driven wheel that is steered, read in coarse counts; nothing else errs by more than a micrometre.
Chassis coarse_tricycle() {
  Chassis chassis = tricycle({.diameter_m = 0.1, .ticks_per_revolution = 40.0}, 0.4, {.sigma_rad = 0.0});
  chassis.noise.wheel_per_sqrt_m = chassis.noise.lateral_per_sqrt_m = 0.0;
  return chassis;
}

/// (x, y)ᵀ C⁻¹ (x, y) of what counts that are rounded down are off by in one drive, in which the wheel rolls
/// 2 to 5 counts in each interval and is steered by up to `most_rad`.
double squares_of(double most_rad, Random& random) {
  const Chassis chassis = coarse_tricycle();
  const double count_m = kPi * 0.1 / 40.0;
  double rolled_counts = random.uniform(0.0, 1.0), counted = 0.0, angle_rad = random.uniform(-kPi, kPi);
  Eigen::Vector2d truth_m = Eigen::Vector2d::Zero();
  ContactMotions contacts{};
  for (int i = 0; i < 12; ++i) {
    const double counts = random.uniform(2.0, 5.0);
    rolled_counts += counts;
    const double before = std::exchange(counted, std::floor(rolled_counts));
    angle_rad += random.uniform(0.0, most_rad);
    Increment increment{.duration_s = 0.02};
    increment.turned[0] = (counted - before) / 40.0;
    increment.steering_rad[0] = angle_rad;
    add_interval(chassis, increment, contacts);
    truth_m += counts * count_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
  }
  const ContactMotion& contact = contacts[0];
  const Eigen::Vector2d last(contact.last_x, contact.last_y);
  Eigen::Matrix2d covariance;
  covariance << contact.variance_xx, contact.variance_xy, contact.variance_xy, contact.variance_yy;
  covariance += rounding_variance(chassis.wheels()[0]) * last * last.transpose();
  const Eigen::Vector2d error = Eigen::Vector2d(contact.x_m, contact.y_m) - truth_m;
  return error.dot(covariance.inverse() * error);
}

TEST(ContactMotion, errs_by_rounded_counts_in_all_directions_in_which_the_wheel_was_steered) {
  constexpr int kDrives = 4000;
  for (const double most_rad : {0.05, 0.3, 1.0}) {
    Random random(1);
    double sum = 0.0;
    for (int i = 0; i < kDrives; ++i) sum += squares_of(most_rad, random);
    // Sums of what is uniform scatter less than χ².
    EXPECT_GT(sum, chi_squared_limit(1.0 - 5e-4, 2.0 * kDrives)) << most_rad;
    EXPECT_LT(sum, chi_squared_limit(5e-4, 2.0 * kDrives)) << most_rad;
  }
}

TEST(ContactMotion, of_a_wheel_that_is_not_steered_as_it_rolls_has_the_rounding_of_two_counts) {
  const Chassis chassis = coarse_tricycle();
  ContactMotions contacts{};
  Increment increment{.duration_s = 0.02};
  increment.turned[0] = 0.1;
  for (int i = 0; i < 10; ++i) add_interval(chassis, increment, contacts);
  EXPECT_NEAR(contacts[0].variance_xx, rounding_variance(chassis.wheels()[0]), 1e-10);
  EXPECT_NEAR(contacts[0].variance_yy, 0.0, 1e-10);
}

}  // namespace
}  // namespace trundle::chassis
