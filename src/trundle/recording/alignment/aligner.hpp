#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/counter.hpp"
#include "trundle/recording/alignment/gyro_integral.hpp"
#include "trundle/recording/alignment/usual_step.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle {

/// The readings of all wheels at one time, in the order of the robot's wheels; NaN: not read. Of a robot
/// without wheels, its velocity: forwards [m/s] and yaw rate [rad/s].
struct WheelReadings {
  double time_s = 0.0;
  std::array<double, kMaxWheels> value{};
};

struct GyroReading {
  double time_s = 0.0;
  double yaw_rate_rad_s = 0.0;  ///< the mean since the reading before; NaN: not measured
};

struct AccelReading {
  double time_s = 0.0;
  double x_m_s2 = 0.0;
  double y_m_s2 = 0.0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s, self.x_m_s2, self.y_m_s2);
  }
};

/// Of each wheel's readings.
using WheelUnits = std::array<WheelUnit, kMaxWheels>;

struct AlignerOptions {
  /// A longer step of a stream, and longer than five of its usual steps, is a gap; so long a silent gyro is
  /// waited for. [s]
  double shortest_gap_s = 0.5;
  /// What a wheel may reach until enough of its motion was seen [m/s]: Counter.
  double usual_speed_m_s = 1.0;
};

/// What a wheel's counter did within an interval.
struct CounterFinding {
  CounterEvent event = CounterEvent::none;
  std::size_t reading = 0;  ///< at which of those that were added, counted from 0

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.event, self.reading);
  }
};

/// An interval between two readings of the wheels.
struct AlignedInterval {
  Increment increment;
  bool bridged = false;  ///< spans a gap, or a counter that starts anew: its course is not known
  std::array<CounterFinding, kMaxWheels> counters{};
};

/// Readings as they come, turned into increments on the wheels' time base: counter wraps undone, the sensors'
/// clocks moved as the robot says, the gyro's turn between the wheels' stamps. docs/theory/alignment.md.
///
/// An interval is complete when all wheels and the gyro have reached its end. Nobody waits for a gyro that
/// has not been heard before the second reading of the wheels, or not for long; a wheel's count that no usual
/// speed explains waits for the next one; the accelerometer counts as far as it has been read by then. A
/// value: a copy goes on by itself, and the state of one may be stored (io/archive.hpp).
class Aligner {
 public:
  explicit Aligner(const Robot& robot, const AlignerOptions& options = {});

  /// What the wheels give, before they give anything. Throws InputError when a wheel lacks what turns its
  /// readings into revolutions.
  void set_units(const WheelUnits& units);

  /// Stamps of each stream must grow: false where they do not, and the reading is left out.
  bool add(const WheelReadings& readings);
  bool add(const GyroReading& reading);
  bool add(const AccelReading& reading);
  /// No more readings will come.
  void finish();

  /// By the robot's clock; nothing before the first reading of all wheels.
  [[nodiscard]] std::optional<double> start_s() const { return start_s_; }
  /// The next interval that is complete, in order.
  [[nodiscard]] std::optional<AlignedInterval> next();
  /// Samples of the gyro at or beyond what it can measure.
  [[nodiscard]] std::size_t saturated_gyro_samples() const { return gyro_ ? gyro_->saturated() : 0; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.units_);
    if constexpr (Archive::kReads) {
      const WheelUnits units = self.units_;
      self.set_units(units);
    }
    archive(self.sums_, self.rows_, self.added_, self.usual_step_, self.last_row_s_, self.start_s_,
            self.begun_, self.finished_, self.bridged_, self.end_, self.findings_, self.newest_s_,
            self.gyro_start_, self.rate_start_, self.accel_);
    if (self.gyro_) archive(*self.gyro_);
  }

 private:
  /// What one wheel's readings sum up to, up to the last that was decided.
  struct WheelSum {
    Counter counter{{}};
    std::optional<double> time_s;
    double sum = 0.0;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.counter, self.time_s, self.sum);
    }
  };
  /// One reading of the wheels that waits.
  struct Row {
    double time_s = 0.0;
    double longest_step_s = 0.0;  ///< from the row before, or it is a gap
    std::size_t number = 0;
    std::array<double, kMaxWheels> sum{};  ///< NaN: not known
    std::array<CounterEvent, kMaxWheels> event{};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.longest_step_s, self.number, self.sum, self.event);
    }
  };
  /// Where the last interval ended.
  struct End {
    double time_s = 0.0;
    std::array<double, kMaxWheels> sum{};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.sum);
    }
  };

  void read(std::size_t wheel, double value, const Row& row);
  void settle(std::size_t wheel, const CounterStep& step, double longest_step_s);
  bool is_known(const Row& row) const;
  bool stays_unknown(const Row& row) const;
  void pass(const Row& row);
  void sort_out_rows();
  bool is_gyro_awaited(double time_s) const;
  bool is_gyro_silent() const;
  AlignedInterval interval_to(const Row& row);
  void add_gyro_turn(Increment& increment);
  double shaking_until(double start_s, double end_s);

  std::vector<Wheel> wheels_;
  std::vector<std::string> names_;
  std::vector<std::string> places_;  // of the wheels, for messages
  std::size_t count_;                // of the readings at one time
  AlignerOptions options_;
  double wheels_offset_s_;
  double gyro_offset_s_ = 0.0;
  WheelUnits units_{};
  std::array<double, kMaxWheels> units_per_turn_{};

  std::vector<WheelSum> sums_;
  std::vector<Row> rows_;  ///< that wait for wheels or gyro
  std::size_t added_ = 0;
  UsualStep usual_step_;
  std::optional<double> last_row_s_;  ///< time of the last reading of the wheels
  std::optional<double> start_s_;
  bool begun_ = false;  ///< the start is aligned: what follows are intervals
  bool finished_ = false;
  bool bridged_ = false;  ///< since the last interval's end
  End end_;
  std::array<CounterFinding, kMaxWheels> findings_{};  ///< since then
  double newest_s_ = 0.0;                              ///< of wheels and gyro
  std::optional<GyroIntegral> gyro_;
  GyroIntegral::Reading gyro_start_;  ///< at the end of the last interval
  double rate_start_ = 0.0;           ///< the gyro's, there
  std::vector<AccelReading> accel_;   ///< since then
};

}  // namespace trundle
