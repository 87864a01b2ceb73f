#include "trundle/inspection/overview.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/alignment/gyro_turns.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/gyro_clock.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::inspection {
namespace {

/// Finds where a wheel does not turn, and what it rolled there by the other sensors.
class StandstillSearch {
 public:
  StandstillSearch(const Robot& robot, std::size_t wheel)
      : wheel_(wheel),
        others_(without_wheel(robot.chassis, wheel)),
        bias_sigma_rad_s_(robot.chassis.gyro ? odometry::initial_bias_sigma(robot) : 0.0),
        rolling_row_(rolling_row(robot.chassis.wheels()[wheel])) {
    for (const bool with_gyro : {false, true}) {
      if (others_.wheel_count == 0 || (with_gyro && !others_.gyro)) continue;
      const Rows rows = rows_of(others_, with_gyro);
      if (observability(rows).rank == 3) rows_[with_gyro ? 1 : 0] = rows;
    }
    if (!rows_[1]) return;
    Increment turned;
    turned.gyro_rad = 1.0;
    turned.has_gyro = true;
    rolled_m_per_rad_ = rolling_row_.dot(twist_of(others_, *rows_[1], turned).vector());
  }

  void add(const Increment& increment, double start_s) {
    if (increment.turned[wheel_] != 0.0) return finish();
    if (!current_) {
      current_ = Current{};
      current_->still.start_s = start_s;
    }
    current_->still.end_s = increment.time_s;
    for (std::size_t w = 0; w < kMaxWheels; ++w) current_->still.way[w] += std::abs(increment.turned[w]);
    current_->all_with_gyro = current_->all_with_gyro && increment.has_gyro;
    const Increment read = without_wheel(increment, wheel_);
    for (std::size_t i = 0; i < rows_.size(); ++i)
      if (rows_[i]) current_->rolled_m[i] += rolling_row_.dot(twist_of(others_, *rows_[i], read).vector());
  }

  /// The wheel turns, or nothing follows.
  void finish() {
    constexpr double kShortest_s = 2.0;  // a shorter stop is one before a turn, and tells no bias
    if (current_ && current_->still.duration_s() >= kShortest_s) {
      const std::size_t i = others_.gyro && current_->all_with_gyro ? 1 : 0;
      if (rows_[i]) current_->still.expected_m = current_->rolled_m[i];
      if (i == 1)
        current_->still.expected_sigma_m =
            std::abs(rolled_m_per_rad_) * bias_sigma_rad_s_ * current_->still.duration_s();
      found_.push_back(current_->still);
    }
    current_.reset();
  }

  [[nodiscard]] std::vector<Standstill>& found() { return found_; }

 private:
  struct Current {
    Standstill still;
    bool all_with_gyro = true;
    std::array<double, 2> rolled_m{};  ///< without and with the gyro
  };

  std::size_t wheel_;
  Chassis others_;
  double bias_sigma_rad_s_;
  Vector3 rolling_row_;
  std::array<std::optional<Rows>, 2> rows_;  ///< without and with the gyro, where they tell the motion
  double rolled_m_per_rad_ = 0.0;            ///< of the gyro's turn
  std::optional<Current> current_;
  std::vector<Standstill> found_;
};

/// Gathers an Overview, interval by interval.
class Gathering {
 public:
  Gathering(const Recording& recording, const Robot& robot)
      : robot_(robot),
        wheels_(robot.chassis.wheels().size()),
        rows_(rows_of(robot.chassis, false)),
        contradictions_(left_null_space(rows_)),
        piece_(RowVector::Zero(rows_.measured)),
        clock_(recording, robot) {
    for (int row = 0; row < rows_.measured && contradictions_.cols() > 0; ++row)
      if (const Row& of = rows_.row[static_cast<std::size_t>(row)]; of.kind == RowKind::wheel)
        rounded_squares_ += 2.0 *
                            rounding_variance(robot.chassis.wheels()[static_cast<std::size_t>(of.wheel)]) *
                            contradictions_.row(row).squaredNorm();
    for (std::size_t w = 0; w < wheels_; ++w) {
      standstills_.emplace_back(robot, w);
      for (std::size_t other = 0; other < w; ++other) overview_.read_alike[other][w] = true;
    }
    if (!robot.chassis.gyro || recording.gyro.time_s.empty() || observability(rows_).rank < 3) return;
    compares_gyro_ = true;
    unlimited_ = *robot.chassis.gyro;  // degrees look like a gyro beyond its limit
    unlimited_.max_rate_rad_s = std::numeric_limits<double>::infinity();
    samples_.emplace(recording.gyro, unlimited_);
  }

  void start(double start_s) {
    start_s_ = before_s_ = start_s;
    if (compares_gyro_) turns_.emplace(*samples_, unlimited_.time_offset_s, start_s);
  }

  void add(const AlignedInterval& interval) {
    const Increment& increment = interval.increment;
    clock_.add(increment, interval.bridged);
    if (contradictions_.cols() > 0) add_contradictions(increment);
    if (compares_gyro_) compare_turns(increment);
    if (increment.has_gyro) overview_.turned_rad += std::abs(increment.gyro_rad);
    for (std::size_t w = 0; w < wheels_; ++w) {
      standstills_[w].add(increment, before_s_);
      overview_.way[w] += std::abs(increment.turned[w]);
      for (std::size_t other = 0; other < w; ++other)
        if (increment.turned[other] != increment.turned[w]) overview_.read_alike[other][w] = false;
    }
    before_s_ = increment.time_s;
  }

  Overview finish(std::vector<Finding> findings) {
    for (std::size_t w = 0; w < wheels_; ++w) {
      standstills_[w].finish();
      overview_.standstills[w] = std::move(standstills_[w].found());
    }
    if (squares_ > 0.0) overview_.unexplained = std::sqrt(std::max(0.0, unexplained_squares_) / squares_);
    overview_.turns = steady_.pairs();
    overview_.turns_of_a_bias_s = steady_.of_a_bias_s();
    overview_.gyro_beside_wheels = steady_.turn();
    overview_.turns_unlimited = pairs_unlimited_.sums();
    overview_.gyro_time_offset = clock_.take_offset(start_s_);
    overview_.findings = std::move(findings);
    return std::move(overview_);
  }

 private:
  double rotation(double gyro_rad, const Increment& increment) const {
    return rotation_of(gyro_rad, increment.duration_s, *robot_.chassis.gyro);
  }

  /// Over pieces, as turns are, in which counts are many; what their rounding makes of each is taken off.
  void add_contradictions(const Increment& increment) {
    piece_ += readings_of(robot_.chassis, rows_, increment).z.head(rows_.measured);
    piece_s_ += increment.duration_s;
    if (piece_s_ < kPieceOfTurns_s) return;
    squares_ += piece_.squaredNorm();
    unexplained_squares_ += (contradictions_.transpose() * piece_).squaredNorm() - rounded_squares_;
    piece_.setZero();
    piece_s_ = 0.0;
  }

  void compare_turns(const Increment& increment) {
    const std::optional<double> unlimited = turns_->until(increment.time_s);
    if (!increment.has_gyro && !unlimited) return;
    const Twist2 by_wheels = twist_of(robot_.chassis, rows_, increment);
    if (increment.has_gyro)
      steady_.add(by_wheels, rotation(increment.gyro_rad, increment), increment.duration_s);
    if (unlimited)
      pairs_unlimited_.add(by_wheels.dtheta, rotation(*unlimited, increment), increment.duration_s);
  }

  const Robot& robot_;
  std::size_t wheels_;
  Rows rows_;
  Combinations contradictions_;  ///< of the wheels' readings
  RowVector piece_;
  double piece_s_ = 0.0;
  double rounded_squares_ = 0.0;  ///< expected of the rounding of both ends of a piece [m²]
  double squares_ = 0.0, unexplained_squares_ = 0.0;
  GyroClock clock_;
  TurnPairs pairs_unlimited_;
  SteadyTurns steady_;
  std::vector<StandstillSearch> standstills_;
  bool compares_gyro_ = false;
  Gyro unlimited_;
  std::optional<GyroSamples> samples_;
  std::optional<GyroTurns> turns_;
  double start_s_ = 0.0, before_s_ = 0.0;  ///< of the first increment, and the end of the last one
  Overview overview_;
};

}  // namespace

Overview overview_of(const Recording& recording, const Robot& robot) {
  Replay replay(recording, robot);
  Gathering gathering(recording, robot);
  std::optional<AlignedInterval> interval = replay.next();
  gathering.start(replay.start_s());
  for (; interval; interval = replay.next()) gathering.add(*interval);
  return gathering.finish(replay.findings());
}

}  // namespace trundle::inspection
