#include "trundle/calibration/likelihood/reading_noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::calibration {
namespace {

/// The rolling rows of the skid wheels, and which wheels they are.
struct SkidRows {
  std::vector<std::size_t> wheels;
  RowMatrix H;
};
SkidRows skid_rows_of(const Chassis& chassis) {
  const Rows rows = rows_of(chassis, false);
  SkidRows skid;
  std::vector<int> own;
  for (int i = 0; i < rows.measured; ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (row.kind != RowKind::wheel) continue;
    const auto wheel = static_cast<std::size_t>(row.wheel);
    if (chassis.wheels()[wheel].kind != WheelKind::skid) continue;
    skid.wheels.push_back(wheel);
    own.push_back(i);
  }
  skid.H = rows.H(own, Eigen::all);
  return skid;
}

/// What the speed before and after says of the middle one of three intervals: shares of their ways.
struct Neighbours {
  double before;
  double after;
};
/// Speed lies on a straight line between the middles of the outer two.
Neighbours neighbours_of(const std::array<Increment, 3>& three) {
  const double before_s = three[0].duration_s, middle_s = three[1].duration_s, after_s = three[2].duration_s;
  const double apart_s = before_s + 2.0 * middle_s + after_s;
  return {middle_s / before_s * (middle_s + after_s) / apart_s,
          middle_s / after_s * (before_s + middle_s) / apart_s};
}

bool lasts(const Increment& increment) {
  return increment.duration_s > 0.0;
}

}  // namespace

// Eq. 3.
ReadingNoise noise_in_readings(const recording::Increments& increments, const Chassis& chassis) {
  ReadingNoise noise;
  const SkidRows skid = skid_rows_of(chassis);
  const auto n = static_cast<Eigen::Index>(skid.wheels.size());
  if (n == 0) return noise;
  // Onto what a motion can do: wheels that contradict each other move nothing.
  const Eigen::MatrixXd H = skid.H;
  const Eigen::MatrixXd by_motion = H * pseudo_inverse(H);
  const auto ways_of = [&](const Increment& increment) {
    RowVector ways(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t wheel = skid.wheels[static_cast<std::size_t>(i)];
      ways[i] = kPi * chassis.wheels()[wheel].diameter_m * increment.turned[wheel];
    }
    return ways;
  };
  RowVector variance(n);  // of a jump, by the metres that it varies by
  for (Eigen::Index i = 0; i < n; ++i)
    variance[i] = by_motion(i, i) * squared(wheel_noise(chassis, skid.wheels[static_cast<std::size_t>(i)]));
  double squares = 0.0, expected = 0.0;
  std::array<Increment, 3> three;
  for (const Increment& increment : increments) {
    std::rotate(three.begin(), three.begin() + 1, three.end());
    three.back() = increment;
    if (!std::ranges::all_of(three, lasts)) continue;
    const auto [before, after] = neighbours_of(three);
    const RowVector first = before * ways_of(three[0]), second = ways_of(three[1]),
                    third = after * ways_of(three[2]);
    squares += (by_motion * (second - first - third)).squaredNorm();
    expected += variance.dot(second.cwiseAbs() + before * first.cwiseAbs() + after * third.cwiseAbs());
  }
  if (expected <= 0.0) return noise;
  const double share = std::min(squares / expected, 1.0);
  for (const std::size_t wheel : skid.wheels)
    noise.wheel_per_sqrt_m[wheel] = std::sqrt(share) * wheel_noise(chassis, wheel);
  return noise;
}

Chassis as_read(const Chassis& chassis, const ReadingNoise& noise) {
  Chassis result = chassis;
  for (std::size_t w = 0; w < result.wheels().size(); ++w)
    if (const auto& own = noise.wheel_per_sqrt_m[w]) result.wheels()[w].noise_per_sqrt_m = *own;
  if (result.gyro && noise.gyro_rad_s_sqrt_hz) result.gyro->noise_rad_s_sqrt_hz = *noise.gyro_rad_s_sqrt_hz;
  return result;
}

}  // namespace trundle::calibration
