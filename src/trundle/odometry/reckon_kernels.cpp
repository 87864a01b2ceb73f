#include "trundle/odometry/reckon_kernels.hpp"

#include <algorithm>

#include "trundle/odometry/arc.hpp"
#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/odometry/reckon_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/simd/lanes.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::odometry::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;
#include "trundle/odometry/steered_twist.inl"

constexpr std::size_t kBlock = 256;  // rows; a block's columns stay in the first-level cache
using BlockColumn = std::array<double, kBlock>;

/// A block on its way from readings to displacements in world axes. What stands beyond its last row was there
/// before and is not used.
struct alignas(64) Block {
  BlockColumn dx, dy, dtheta;
  BlockColumn middle;  ///< heading in the middle of each arc
  BlockColumn chord_x, chord_y;
};

/// In the order of MotionModel::twist.
HWY_INLINE void twists(const Reckoning& task, std::size_t first, std::size_t rows, Block& block) {
  const Tag<double> d;
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= rows; i += hn::Lanes(d)) {
    Wide dx = hn::Zero(d), dy = hn::Zero(d), turn = hn::Zero(d);
    const double* T = task.T;
    for (std::size_t k = 0; k < task.input_count; ++k, T += 3) {
      const Wide u = hn::LoadU(d, task.inputs[k] + first + i);
      dx = dx + hn::Set(d, T[0]) * u;
      dy = dy + hn::Set(d, T[1]) * u;
      turn = turn + hn::Set(d, T[2]) * u;
    }
    hn::Store(dx, d, &block.dx[i]);
    hn::Store(dy, d, &block.dy[i]);
    hn::Store(turn, d, &block.dtheta[i]);
  }
  for (; i < rows; ++i) {
    block.dx[i] = block.dy[i] = block.dtheta[i] = 0.0;
    const double* T = task.T;
    for (std::size_t k = 0; k < task.input_count; ++k, T += 3) {
      const double u = task.inputs[k][first + i];
      block.dx[i] += T[0] * u;
      block.dy[i] += T[1] * u;
      block.dtheta[i] += T[2] * u;
    }
  }
}

/// In the order of SteeredModel::twist. A row whose wheels do not plainly see all of the motion is left to
/// it.
HWY_INLINE void twists(const SteeredReckoning& task, std::size_t first, std::size_t rows, Block& block) {
  const Tag<double> d;
  const SteeredSums& sums = task.model.sums(0);
  const auto left_to_model = [&](std::size_t i) {
    const Triple twist = task.model.twist(task.increment(first + i), 0);
    block.dx[i] = twist[0];
    block.dy[i] = twist[1];
    block.dtheta[i] = twist[2];
  };
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= rows; i += hn::Lanes(d)) {
    const auto input = [&](std::size_t column) { return hn::LoadU(d, task.inputs[column] + first + i); };
    const auto steering = [&](std::size_t wheel) { return hn::LoadU(d, task.steering[wheel] + first + i); };
    const auto twist = steered_twist<Wide>(sums, input, steering);
    hn::Store(twist.dx, d, &block.dx[i]);
    hn::Store(twist.dy, d, &block.dy[i]);
    hn::Store(twist.dtheta, d, &block.dtheta[i]);
    if (!hn::AllTrue(d, twist.seen > hn::Zero(d))) [[unlikely]]
      for (std::size_t k = i; k < i + hn::Lanes(d); ++k) left_to_model(k);
  }
  for (; i < rows; ++i) left_to_model(i);
}

/// Displacements of a block; false if an angle lies outside the polynomials' range.
HWY_INLINE bool chords(std::size_t rows, Block& block) {
  const Tag<double> d;
  auto inside = hn::Zero(d) == hn::Zero(d);
  for (std::size_t i = 0; i < rows; i += hn::Lanes(d)) {
    const Wide half = lanes<double>(0.5) * hn::Load(d, &block.dtheta[i]);
    const Wide middle = hn::Load(d, &block.middle[i]);
    inside = both(inside, both(abs(half) <= lanes<double>(kLargestHalfTurn),
                               abs(middle) <= lanes<double>(kLargestAngle)));
    const auto chord =
        chord_of(hn::Load(d, &block.dx[i]), hn::Load(d, &block.dy[i]), sin_cos(middle), sinc_of_small(half));
    hn::Store(chord.x, d, &block.chord_x[i]);
    hn::Store(chord.y, d, &block.chord_y[i]);
  }
  return hn::AllTrue(d, inside);
}

void chords_at_any_angle(std::size_t rows, Block& block) {
  for (std::size_t i = 0; i < rows; ++i) {
    const auto chord = scalar::chord_of(block.dx[i], block.dy[i], sin_cos_of(block.middle[i]),
                                        half_sinc_of(0.5 * block.dtheta[i]));
    block.chord_x[i] = chord.x;
    block.chord_y[i] = chord.y;
  }
}

/// Running sums, one row after the other: headings of this block and, since they do not wait for each other,
/// positions of the block before it.
struct RunningSums {
  double x, y, heading;

  HWY_INLINE void headings(Block& block, std::size_t i, double* out) {
    block.middle[i] = heading + 0.5 * block.dtheta[i];
    heading += block.dtheta[i];
    out[i] = heading;
  }
  HWY_INLINE void positions(const Block& block, std::size_t i, double* x_out, double* y_out) {
    x += block.chord_x[i];
    y += block.chord_y[i];
    x_out[i] = x;
    y_out[i] = y;
  }
};

template <class Task>
HWY_INLINE void reckon_rows(const Task& task, const PoseColumns& out) {
  Block block{};
  RunningSums sums{task.start.x, task.start.y, task.start.heading};
  std::size_t done = 0;  // rows whose positions are written
  for (std::size_t first = 0; first < task.rows; first += kBlock) {
    const std::size_t count = std::min(kBlock, task.rows - first);
    const std::size_t together = std::min(count, first - done);
    twists(task, first, count, block);
    for (std::size_t i = 0; i < together; ++i) {
      sums.headings(block, i, &out.heading_rad[first]);
      sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
    }
    for (std::size_t i = together; i < count; ++i) sums.headings(block, i, &out.heading_rad[first]);
    for (std::size_t i = together; i < first - done; ++i)
      sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
    done = first;
    if (!chords(count, block)) chords_at_any_angle(count, block);
  }
  for (std::size_t i = 0; i < task.rows - done; ++i) sums.positions(block, i, &out.x_m[done], &out.y_m[done]);
}

void reckon_all(const Reckoning& task, const PoseColumns& out) {
  reckon_rows(task, out);
}

void reckon_all_steered(const SteeredReckoning& task, const PoseColumns& out) {
  reckon_rows(task, out);
}

}  // namespace trundle::odometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::odometry {

HWY_EXPORT(reckon_all);
HWY_EXPORT(reckon_all_steered);

Increment SteeredReckoning::increment(std::size_t row) const {
  Increment result;
  const auto value = [&](const double* column) { return column == nullptr ? 0.0 : column[row]; };
  for (std::size_t i = 0; i < kMaxWheels; ++i) {
    result.turned[i] = value(inputs[i]);
    result.steering_rad[i] = value(steering[i]);
  }
  result.gyro_rad = value(inputs[kMaxWheels]);
  result.duration_s = value(inputs[kMaxWheels + 1]);
  return result;
}

void reckon(const Reckoning& task, const PoseColumns& poses) {
  HWY_DYNAMIC_DISPATCH(reckon_all)(task, poses);
}

void reckon(const SteeredReckoning& task, const PoseColumns& poses) {
  HWY_DYNAMIC_DISPATCH(reckon_all_steered)(task, poses);
}

}  // namespace trundle::odometry
#endif
