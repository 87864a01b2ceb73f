#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/recording/alignment/aligner.hpp"

namespace trundle::recording {

/// The column of a wheel's steering. Throws InputError where the recording has none.
[[nodiscard]] const WheelSeries& steering_of(const Recording& recording, const std::string& wheel);

/// A recording through an Aligner, reading by reading as the stamps order them, interval by interval: for
/// those who need each interval once. The recording must outlive it.
class Replay {
 public:
  /// Throws InputError when a wheel of the robot has no column, or the recording has neither wheels nor
  /// velocity, or where columns of a stream differ in length.
  Replay(const Recording& recording, const Robot& robot);

  /// The intervals in order; nothing after the last.
  [[nodiscard]] std::optional<AlignedInterval> next();

  /// Of the first interval, once that has been read; 0 where there is none.
  [[nodiscard]] double start_s() const { return aligner_.start_s().value_or(0.0); }
  /// At most so many intervals come.
  [[nodiscard]] std::size_t most_intervals() const { return motion_.time_s->size(); }
  /// After the last interval: wraps, resets, a gyro that is missing.
  [[nodiscard]] std::vector<Finding> findings() const;

 private:
  /// What gives a robot's motion: its wheels' columns, or a velocity.
  struct MotionStream {
    const std::vector<double>* time_s = nullptr;
    std::vector<const std::vector<double>*> columns;
    WheelUnits units{};
    std::array<const std::vector<double>*, kMaxWheels> steering{};  ///< of steered wheels
    WheelUnits steering_units{};

    WheelReadings at(std::size_t row) const;
  };
  /// Of what a wheel's counter did besides counting: how often, and at which row first.
  struct CounterRows {
    std::size_t count = 0;
    std::size_t first = 0;

    void add(std::size_t row) {
      if (count++ == 0) first = row;
    }
  };
  struct CounterEvents {
    CounterRows wraps, resets, jumps;

    void add(const CounterFinding& finding);
  };
  static MotionStream motion_of(const Recording& recording, const Robot& robot);

  bool add_reading();
  void note(const AlignedInterval& interval);
  void report_gyro(std::vector<Finding>& findings) const;

  const Recording& recording_;
  std::vector<std::string> wheel_names_;
  std::optional<Gyro> gyro_;
  double wheels_offset_s_;
  MotionStream motion_;
  Aligner aligner_;
  std::vector<CounterEvents> counters_;
  std::size_t motion_row_ = 0;
  std::size_t gyro_row_ = 0;
  std::size_t accel_row_ = 0;
  bool finished_ = false;

  std::size_t intervals_ = 0;
  double end_s_ = 0.0;            ///< of the last one
  std::size_t beyond_gyro_ = 0;   ///< intervals without the gyro, before or after it ran
  std::size_t missing_gyro_ = 0;  ///< and meanwhile
};

}  // namespace trundle::recording
