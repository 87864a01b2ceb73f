#include "trundle/odometry/dead_reckon.hpp"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/arc.hpp"
#include "trundle/odometry/odometer.hpp"

// Lanes stay inside one kernel: how they would be passed between functions does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace trundle {
namespace {

constexpr std::size_t kBlock = 256;  // rows; a block's columns stay in the first-level cache
using Column = std::array<double, kBlock>;
using InputColumns = std::array<std::span<const double>, kMaxInputs>;

/// A block on its way from readings to displacements in world axes.
struct alignas(64) Block {
  Column dx, dy, dtheta;
  Column middle;  ///< heading in the middle of each arc
  Column chord_x, chord_y;
};

/// Twists: ξ = T u, in the order of MotionModel::twist.
TRUNDLE_INLINE void twists(const double* T, const InputColumns& inputs, int input_count, std::size_t first,
                           std::size_t rows, Block& block) {
  block.dx.fill(0.0);
  block.dy.fill(0.0);
  block.dtheta.fill(0.0);
  for (int k = 0; k < input_count; ++k, T += 3) {
    const double* u = inputs[static_cast<std::size_t>(k)].data() + first;
    for (std::size_t i = 0; i < rows; ++i) {
      block.dx[i] += T[0] * u[i];
      block.dy[i] += T[1] * u[i];
      block.dtheta[i] += T[2] * u[i];
    }
  }
}

/// Displacements of a block, eight rows at once; false if an angle lies outside the kernel's range.
TRUNDLE_INLINE bool chords(Block& block) {
  LaneBits outside{};
  for (std::size_t i = 0; i < kBlock; i += kLanes) {
    Lanes dx, dy, half, middle;
    std::memcpy(&dx, &block.dx[i], sizeof dx);
    std::memcpy(&dy, &block.dy[i], sizeof dy);
    std::memcpy(&half, &block.dtheta[i], sizeof half);
    std::memcpy(&middle, &block.middle[i], sizeof middle);
    half *= 0.5;
    outside |= beyond(half, kLargestHalfTurn) | beyond(middle, kLargestAngle);
    const Chord<Lanes> chord = chord_of(dx, dy, sin_cos(middle), half_sinc(half));
    std::memcpy(&block.chord_x[i], &chord.x, sizeof chord.x);
    std::memcpy(&block.chord_y[i], &chord.y, sizeof chord.y);
  }
  return !any_beyond(outside);
}

void chords_at_any_angle(Block& block) {
  for (std::size_t i = 0; i < kBlock; ++i) {
    const Chord<double> chord =
        chord_of(block.dx[i], block.dy[i], sin_cos_of(block.middle[i]), half_sinc_of(0.5 * block.dtheta[i]));
    block.chord_x[i] = chord.x;
    block.chord_y[i] = chord.y;
  }
}

/// Running sums, one row after the other: headings of this block and, since they do not wait for each other,
/// positions of the block before it.
struct Sums {
  double x, y, heading;

  TRUNDLE_INLINE void headings(Block& block, std::size_t i, double* out) {
    block.middle[i] = heading + 0.5 * block.dtheta[i];
    heading += block.dtheta[i];
    out[i] = heading;
  }
  TRUNDLE_INLINE void positions(const Block& block, std::size_t i, double* x_out, double* y_out) {
    x += block.chord_x[i];
    y += block.chord_y[i];
    x_out[i] = x;
    y_out[i] = y;
  }
};

TRUNDLE_KERNEL void reckon(const double* T, const InputColumns& inputs, int input_count, std::size_t rows,
                           const Pose2& start, const PoseColumns& out) {
  Block block{};
  Sums sums{start.x, start.y, start.heading};
  std::size_t done = 0;  // rows whose positions are written
  for (std::size_t first = 0; first < rows; first += kBlock) {
    const std::size_t count = std::min(kBlock, rows - first);
    const std::size_t together = std::min(count, first - done);
    twists(T, inputs, input_count, first, count, block);
    for (std::size_t i = 0; i < together; ++i) {
      sums.headings(block, i, &out.heading_rad[first]);
      sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
    }
    for (std::size_t i = together; i < count; ++i) sums.headings(block, i, &out.heading_rad[first]);
    for (std::size_t i = together; i < first - done; ++i)
      sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
    done = first;
    if (!chords(block)) chords_at_any_angle(block);
  }
  for (std::size_t i = 0; i < rows - done; ++i) sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
}

void require_length(std::size_t length, std::size_t expected, const std::string& column) {
  if (length != expected)
    throw InputError("dead_reckon", fmt::format("column {} has {} rows", column, length),
                     fmt::format("{} as the first column", expected));
}

InputColumns columns_of(const Chassis& chassis, const TravelColumns& travel, bool with_gyro) {
  InputColumns inputs{};
  const auto wheels = static_cast<std::size_t>(chassis.wheel_count > 0 ? chassis.wheel_count : 2);
  for (std::size_t i = 0; i < wheels; ++i) {
    inputs[i] = travel.turned[i];
    require_length(inputs[i].size(), travel.rows(), fmt::format("turned[{}]", i));
  }
  if (!with_gyro) return inputs;
  inputs[wheels] = travel.gyro_rad;
  inputs[wheels + 1] = travel.duration_s;
  require_length(travel.gyro_rad.size(), travel.rows(), "gyro_rad");
  require_length(travel.duration_s.size(), travel.rows(), "duration_s");
  return inputs;
}

void step_through(const Robot& robot, const TravelColumns& travel, const Pose2& start,
                  const PoseColumns& poses) {
  Odometer odometer(robot, {.start = start, .with_covariance = false});
  Increment increment{.has_gyro = !travel.gyro_rad.empty()};
  for (std::size_t i = 0; i < travel.rows(); ++i) {
    for (std::size_t k = 0; k < kMaxWheels; ++k)
      if (!travel.turned[k].empty()) increment.turned[k] = travel.turned[k][i];
    if (increment.has_gyro) {
      increment.gyro_rad = travel.gyro_rad[i];
      increment.duration_s = travel.duration_s[i];
    }
    odometer.step(increment);
    poses.x_m[i] = odometer.pose().x;
    poses.y_m[i] = odometer.pose().y;
    poses.heading_rad[i] = odometer.pose().heading;
  }
}

}  // namespace

void dead_reckon(const Robot& robot, const TravelColumns& travel, const Pose2& start,
                 const PoseColumns& poses) {
  const bool with_gyro = robot.chassis.gyro && !travel.gyro_rad.empty();
  const InputColumns inputs = columns_of(robot.chassis, travel, with_gyro);
  require_length(poses.x_m.size(), travel.rows(), "x_m");
  require_length(poses.y_m.size(), travel.rows(), "y_m");
  require_length(poses.heading_rad.size(), travel.rows(), "heading_rad");
  require_observable(robot, with_gyro);
  const MotionModel model(robot.chassis, {}, with_gyro);
  if (!model.has_one_gain()) return step_through(robot, travel, start, poses);
  const LinearisedChassis linearised = model.linearised();
  reckon(linearised.twist.data(), inputs, linearised.inputs(), travel.rows(), start, poses);
}

}  // namespace trundle
