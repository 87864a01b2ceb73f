#include "trundle/calibration/preparation/channel_assignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/calibration/preparation/steering_sense.hpp"
#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {
namespace {

// Motions between epochs: some seconds of driving.
constexpr std::size_t kFewestMotions = 5;
// Wheels: 5! = 120 assignments are looked at, 8! would be 40 320.
constexpr std::size_t kMostToPermute = 5;
// Misfits E of eq. 5. What calibration may correct makes 0.01, a wrong channel or sign 2: their geometric
// mean.
constexpr double kWrong = 0.1;
// Of such a misfit, the most that another assignment may leave: half its size, E being squared.
constexpr double kFarLess = 0.25;
// Misfits, or rows, that differ by less do not distinguish two assignments: calibration changes each by 0.01.
constexpr double kAlike = 0.02;

/// Between two epochs: how the body moved by the reference, and what was read.
struct ReadMotion {
  Vector3 by_reference;
  Increment sum;
};

void add_motions(const Run& run, const Robot& robot, std::vector<ReadMotion>& motions) {
  for (std::size_t epoch = 1; epoch < run.epochs.size(); ++epoch) {
    const auto start = body_by_reference(run, run.epochs[epoch - 1], robot);
    const auto end = body_by_reference(run, run.epochs[epoch], robot);
    if (!start || !end || std::ranges::binary_search(run.jumps, epoch)) continue;
    ReadMotion& motion = motions.emplace_back();
    Pose2 moved = start->inverse() * *end;
    moved.heading = wrap_angle(moved.heading);
    motion.by_reference = log(moved).vector();
    motion.sum.has_gyro = true;
    for (std::size_t i = run.epochs[epoch - 1]; i < run.epochs[epoch]; ++i) {
      const Increment& increment = run.readings.increments[i];
      add_readings(motion.sum, increment);
      motion.sum.has_gyro = motion.sum.has_gyro && increment.has_gyro;
    }
  }
}

/// How far the readings of column j are from what the wheel at place i should read, as a share of their mean
/// square; for both signs.
struct Misfit {
  double as_is = 0.0;
  double reversed = 0.0;

  double best() const { return std::min(as_is, reversed); }
  bool is_reversed() const { return reversed < as_is; }
};

/// The motion where lengths are so many times as large.
Vector3 scaled(const Vector3& motion, double times) {
  return {times * motion.x(), times * motion.y(), motion.z()};
}

using Misfits = std::array<std::array<Misfit, kMaxWheels>, kMaxWheels>;

/// What the reference's lengths and the wheels' are multiplied by.
struct Scale {
  double reference = 1.0, wheels = 1.0;
};

Misfits misfits_of(const std::vector<ReadMotion>& motions, const Chassis& chassis, const Scale& scale) {
  const auto wheels = chassis.wheels();
  double size = 0.0;
  Misfits misfits{};
  for (const ReadMotion& motion : motions)
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      const double expected = rolling_row(wheels[i]).dot(scaled(motion.by_reference, scale.reference));
      size += expected * expected / static_cast<double>(wheels.size());
      for (std::size_t j = 0; j < wheels.size(); ++j) {
        const double read = scale.wheels * kPi * wheels[i].diameter_m * motion.sum.turned[j];
        misfits[i][j].as_is += (read - expected) * (read - expected);
        misfits[i][j].reversed += (read + expected) * (read + expected);
      }
    }
  for (auto& row : misfits)
    for (Misfit& misfit : row)
      misfit = {misfit.as_is / std::max(size, 1e-30), misfit.reversed / std::max(size, 1e-30)};
  return misfits;
}

using Places = std::vector<std::size_t>;  ///< for each place on the chassis, the column that belongs to it

double cost_of(const Places& columns, const Misfits& misfits) {
  double cost = 0.0;
  for (std::size_t i = 0; i < columns.size(); ++i) cost += misfits[i][columns[i]].best();
  return cost;
}

Places as_named(std::size_t wheels) {
  Places columns(wheels);
  std::iota(columns.begin(), columns.end(), 0U);
  return columns;
}

Places best_places(std::size_t wheels, const Misfits& misfits) {
  const Places named = as_named(wheels);
  if (wheels > kMostToPermute) return named;
  // A wheel that only counts backwards has its place: ports are swapped only where that explains far more.
  Places best = named;
  double smallest = kFarLess * cost_of(named, misfits);
  Places columns = named;
  while (std::next_permutation(columns.begin(), columns.end()))
    if (const double cost = cost_of(columns, misfits); cost < smallest) {
      smallest = cost;
      best = columns;
    }
  return best;
}

/// With which all wheels together read as much as they should, whichever is which: a reference in another
/// unit, or wheels of another size.
std::array<Scale, 2> scales_of(const std::vector<ReadMotion>& motions, const Chassis& chassis) {
  double read = 0.0;
  Eigen::Matrix2d expected = Eigen::Matrix2d::Zero();  // of ways and turns
  for (const ReadMotion& motion : motions)
    for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
      const Wheel& wheel = chassis.wheels()[i];
      const double by_turn = rolling_row(wheel).dot(scaled(motion.by_reference, 0.0));
      const Vector2 parts(rolling_row(wheel).dot(motion.by_reference) - by_turn, by_turn);
      expected += parts * parts.transpose();
      read += std::pow(kPi * wheel.diameter_m * motion.sum.turned[i], 2);
    }
  const double a = expected(0, 0), b = expected(0, 1), c = expected(1, 1) - read;  // a s² + 2 b s + c = 0
  return {Scale{.reference = (std::sqrt(std::max(b * b - a * c, 0.0)) - b) / a},
          Scale{.wheels = std::sqrt(expected.sum() / read)}};
}

/// Sizes say nothing of wires: misfits as they are, or with the scale that leaves far less of them.
Misfits misfits_of(const std::vector<ReadMotion>& motions, const Chassis& chassis) {
  const auto cost = [&](const Misfits& misfits) {
    return cost_of(best_places(chassis.wheels().size(), misfits), misfits);
  };
  Misfits best = misfits_of(motions, chassis, {});
  for (const Scale& scale : scales_of(motions, chassis)) {
    if (!std::isfinite(scale.reference * scale.wheels)) continue;
    const Misfits misfits = misfits_of(motions, chassis, scale);
    if (cost(misfits) < kFarLess * cost(best)) best = misfits;
  }
  return best;
}

double as_in_the_file(std::size_t wheels, const Misfits& misfits) {
  double cost = 0.0;
  for (std::size_t i = 0; i < wheels; ++i) cost = std::max(cost, misfits[i][i].as_is);
  return cost;
}

/// The encoder stays with its column: it and the name change places.
void give_places(const Places& columns, const Robot& given, ChannelAssignment& channels) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::size_t j = columns[i];
    channels.robot.wheel_names[i] = given.wheel_names[j];
    Wheel& wheel = channels.robot.chassis.wheels()[i];
    wheel.ticks_per_revolution = given.chassis.wheels()[j].ticks_per_revolution;
    wheel.tick_bits = given.chassis.wheels()[j].tick_bits;
    wheel.recorded_diameter_m = given.chassis.wheels()[j].recorded_diameter_m;
    if (j > i && columns[j] == i) {
      channels.faults.push_back(
          {.code = FindingCode::swapped_channels, .subjects = {given.wheel_names[i], given.wheel_names[j]}});
    } else if (j != i && columns[j] != i) {
      channels.faults.push_back(
          {.code = FindingCode::misplaced_channel, .subjects = {given.wheel_names[j], given.wheel_names[i]}});
    }
  }
}

bool in_ticks(std::span<const Recording> recordings, const std::string& wheel) {
  return std::ranges::any_of(recordings, [&](const Recording& recording) {
    return std::ranges::any_of(recording.wheels.series, [&](const WheelSeries& series) {
      return series.wheel == wheel && series.unit == WheelUnit::ticks;
    });
  });
}

void check_wheels(const std::vector<ReadMotion>& motions, std::span<const Recording> recordings,
                  const Robot& given, ChannelAssignment& channels) {
  const auto n = given.chassis.wheels().size();
  const Misfits misfits = misfits_of(motions, given.chassis);
  if (as_in_the_file(n, misfits) < kWrong) return;
  const Places columns = best_places(n, misfits);
  give_places(columns, given, channels);
  for (std::size_t i = 0; i < n; ++i) {
    const Misfit& misfit = misfits[i][columns[i]];
    if (misfit.reversed < kFarLess * misfit.as_is)
      channels.faults.push_back(
          turn_around(i, in_ticks(recordings, channels.robot.wheel_names[i]), channels.robot));
  }
}

void name_ambiguous_pairs(const std::vector<ReadMotion>& motions, ChannelAssignment& channels) {
  const auto wheels = channels.robot.chassis.wheels();
  const Misfits misfits = misfits_of(motions, channels.robot.chassis);
  for (std::size_t i = 0; i < wheels.size(); ++i)
    for (std::size_t j = i + 1; j < wheels.size(); ++j) {
      const double swapped = misfits[i][j].as_is + misfits[j][i].as_is;
      if (swapped > misfits[i][i].as_is + misfits[j][j].as_is + kAlike) continue;
      const bool one_line = (rolling_row(wheels[i]) - rolling_row(wheels[j])).norm() < kAlike;
      channels.ambiguous.push_back(
          {.severity = Severity::note,
           .code = one_line ? FindingCode::parallel_wheels : FindingCode::indistinguishable_wheels,
           .subjects = {channels.robot.wheel_names[i], channels.robot.wheel_names[j]}});
    }
}

void check_gyro(const std::vector<ReadMotion>& motions, const Robot& given, ChannelAssignment& channels) {
  if (!given.chassis.gyro) return;
  const Gyro& gyro = *given.chassis.gyro;
  double as_is = 0.0, turned = 0.0, size = 0.0;
  for (const ReadMotion& motion : motions) {
    if (!motion.sum.has_gyro) continue;
    const double read = (motion.sum.gyro_rad - gyro.bias_rad_s * motion.sum.duration_s) * gyro.scale;
    as_is += (read - motion.by_reference.z()) * (read - motion.by_reference.z());
    turned += (read + motion.by_reference.z()) * (read + motion.by_reference.z());
    size += motion.by_reference.z() * motion.by_reference.z();
  }
  if (as_is < kWrong * size || turned >= kFarLess * as_is) return;
  channels.robot.chassis.gyro->scale = -gyro.scale;
  channels.faults.push_back({.code = FindingCode::reversed_gyro, .payload = payload::Amount{-gyro.scale}});
}

/// Which column is whose does not show there: a steered wheel's sum says nothing without its course.
ChannelAssignment check_steered(std::span<const Run> runs, std::span<const Recording> recordings,
                                const Robot& robot) {
  ChannelAssignment channels{robot, {}, {}};
  const ReversedWheels reversed = reversed_wheels_of_steered(runs, robot);
  for (const std::size_t i : reversed.counters)
    channels.faults.push_back(turn_around(i, in_ticks(recordings, robot.wheel_names[i]), channels.robot));
  for (const std::size_t i : reversed.steerings) {
    double& scale = channels.robot.chassis.all_wheels()[i].steering->scale;
    scale = -scale;
    channels.faults.push_back({.code = FindingCode::reversed_steering,
                               .subjects = {wheel_name(robot, i)},
                               .payload = payload::Amount{scale}});
  }
  std::vector<ReadMotion> motions;
  for (const Run& run : runs) add_motions(run, robot, motions);
  if (motions.size() >= kFewestMotions) check_gyro(motions, robot, channels);
  return channels;
}

ChannelAssignment compare(const std::vector<ReadMotion>& motions, std::span<const Recording> recordings,
                          const Robot& robot) {
  ChannelAssignment channels{robot, {}, {}};
  if (motions.size() < kFewestMotions) return channels;
  check_wheels(motions, recordings, robot, channels);
  check_gyro(motions, robot, channels);
  if (channels.faults.empty()) name_ambiguous_pairs(motions, channels);
  return channels;
}

}  // namespace

ChannelAssignment check_channels(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : recordings)
    if (robot.chassis.wheel_count > 0 && (is_steered(robot.chassis) || !recording.reference.time_s.empty()))
      runs.push_back(prepare_run(recording, robot));
  if (is_steered(robot.chassis)) return check_steered(runs, recordings, robot);
  std::vector<ReadMotion> motions;
  for (const Run& run : runs) add_motions(run, robot, motions);
  return compare(motions, recordings, robot);
}

ChannelAssignment check_channels(const Recording& recording, const Run& run, const Robot& robot) {
  if (is_steered(robot.chassis)) return check_steered({&run, 1}, {&recording, 1}, robot);
  std::vector<ReadMotion> motions;
  add_motions(run, robot, motions);
  return compare(motions, std::span(&recording, 1), robot);
}

}  // namespace trundle::calibration
