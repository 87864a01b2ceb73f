#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/recording/alignment/gyro_integral.hpp"
#include "trundle/recording/alignment/steering_angles.hpp"
#include "trundle/recording/alignment/wheel_sums.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

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

struct AlignerOptions {
  /// A longer step of a stream, and longer than five of its usual steps, is a gap; so long a silent gyro is
  /// waited for. [s]
  double shortest_gap_s = 0.5;
  /// What a wheel may reach until enough of its motion was seen [m/s]: Counter.
  double usual_speed_m_s = 1.0;
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
/// An interval is complete when all wheels and the gyro have reached its end, and the steering of each
/// steered wheel its middle. Nobody waits for a gyro that has not been heard before the second reading of the
/// wheels, or not for long; a wheel's count that no usual speed explains waits for the next one; the
/// accelerometer counts as far as it has been read by then. A value: a copy goes on by itself, and the state
/// of one may be stored (io/archive.hpp).
class Aligner {
 public:
  explicit Aligner(const Robot& robot, const AlignerOptions& options = {});

  /// What the wheels give, before they give anything. Throws InputError when a wheel lacks what turns its
  /// readings into revolutions.
  /// `steering`: of steered wheels, as Chassis::all_wheels().
  void set_units(const WheelUnits& units, const WheelUnits& steering = {});

  /// Stamps of each stream must grow: false where they do not, and the reading is left out.
  bool add(const WheelReadings& readings);
  bool add(const GyroReading& reading);
  bool add(const AccelReading& reading);
  /// No more readings will come.
  void finish();

  /// By the robot's clock; nothing before the first reading of all wheels.
  [[nodiscard]] std::optional<double> start_s() const { return wheels_.start_s(); }
  /// The next interval that is complete, in order.
  [[nodiscard]] std::optional<AlignedInterval> next();
  /// Samples of the gyro at or beyond what it can measure.
  [[nodiscard]] std::size_t saturated_gyro_samples() const { return gyro_ ? gyro_->saturated() : 0; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.wheels_, self.accel_, self.end_, self.gyro_start_, self.rate_start_, self.newest_s_,
            self.finished_);
    if (self.gyro_) archive(*self.gyro_);
    if (self.steering_) archive(*self.steering_);
    if (self.scrub_gauge_.applies()) archive(self.scrub_);
    if (self.speed_gauge_) archive(self.speed_);
  }

 private:
  bool is_gyro_awaited(double time_s) const;
  bool is_gyro_silent() const;
  bool is_steering_awaited(const WheelSums::Row& row) const;
  void start_at(const WheelSums::Row& row);
  AlignedInterval interval_to(const WheelSums::Row& row);
  void add_gyro_turn(Increment& increment);
  double shaking_until(double start_s, double end_s);

  WheelSums wheels_;
  std::optional<GyroIntegral> gyro_;
  std::optional<SteeringAngles> steering_;
  ScrubGauge scrub_gauge_;
  ScrubState scrub_;
  std::optional<SpeedGauge> speed_gauge_;  ///< of a robot that depends on speed
  SpeedState speed_;
  std::vector<AccelReading> accel_;    ///< since the last interval's end
  std::optional<WheelSums::Row> end_;  ///< there; nothing before the start
  GyroIntegral::Reading gyro_start_;   ///< there
  double rate_start_ = 0.0;            ///< the gyro's, there
  double newest_s_ = 0.0;              ///< of wheels and gyro
  double gyro_later_s_ = 0.0;          ///< than the wheels' the gyro's readings of one time may come
  bool finished_ = false;
};

}  // namespace trundle::recording
