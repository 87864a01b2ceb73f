#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle {

/// The readings of all wheels at one time, in the order of the robot's wheels.
struct WheelReadings {
  double time_s = 0.0;
  std::array<double, kMaxWheels> value{};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s, self.value);
  }
};

/// Of each wheel's readings.
using WheelUnits = std::array<WheelUnit, kMaxWheels>;

struct OnlineAlignmentOptions {
  /// A longer step of a stream is a gap; a gyro that is silent for longer is no longer waited for. What
  /// align() takes for streams of 10 Hz and more.
  double longest_step_s = 0.5;
  double greatest_speed_m_s = 10.0;  ///< a counter that would roll faster starts anew
};

/// An interval between two readings of the wheels.
struct AlignedInterval {
  Increment increment;
  bool bridged = false;  ///< spans a gap, or a counter that starts anew: its course is not known
};

/// align(), as the readings come: wheels with the gyro's turn between their stamps. An interval is complete
/// when the gyro has reached its end; nobody waits for a gyro that has not been heard before the second
/// reading of the wheels, or not for long. The two differ only where align() looks ahead: at counters that
/// start anew, which keep their speed here, at empty cells, and where a gyro falls silent or begins late.
class OnlineAlignment {
 public:
  explicit OnlineAlignment(const Robot& robot, const OnlineAlignmentOptions& options = {});

  /// What the wheels give, before they give anything: counts where nothing is said. Throws InputError when a
  /// wheel lacks what turns its readings into revolutions.
  void set_units(const WheelUnits& units);

  /// Stamps of each stream must grow: false where they do not, and the reading is left out.
  bool add(const WheelReadings& readings);
  bool add_gyro(double time_s, double yaw_rate_rad_s);
  /// No more readings will come.
  void finish() { finished_ = true; }

  /// On the robot's clock; nothing before the first reading of the wheels.
  std::optional<double> start_s() const { return start_s_; }
  /// The next interval that is complete, in order.
  std::optional<AlignedInterval> next();

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.units_, self.start_s_, self.begun_, self.finished_, self.wheels_, self.gyro_,
            self.gyro_start_, self.first_rate_, self.last_rate_, self.newest_s_, self.pending_,
            self.samples_);
    if constexpr (Archive::kReads) {
      const WheelUnits units = self.units_;
      self.set_units(units);
    }
  }

 private:
  /// Sums of what each wheel read, and where its counter stands.
  struct WheelsState {
    double time_s = 0.0;
    std::array<double, kMaxWheels> count{};
    std::array<double, kMaxWheels> sum{};
    std::array<double, kMaxWheels> speed{};  ///< units per second over the last step

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.count, self.sum, self.speed);
    }
  };
  /// What the gyro's readings sum up to at one of its samples.
  struct GyroSample {
    double time_s = 0.0;
    double angle = 0.0;
    std::size_t lost = 0;  ///< steps without a usable rate up to here

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.angle, self.lost);
    }
  };
  struct GyroReading {
    bool known = false;
    double angle = 0.0;
    std::size_t lost_before = 0;
    std::size_t lost_after = 0;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.known, self.angle, self.lost_before, self.lost_after);
    }
  };
  struct GyroState {
    bool any = false;
    GyroSample first;
    std::optional<double> before_s;  ///< it reaches so far beyond its first sample: by a step, not by a gap
    double beyond_s = 0.0;           ///< and beyond its last

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.any, self.first, self.before_s, self.beyond_s);
    }
  };

  AlignedInterval interval_to(const WheelReadings& readings);
  double step_of(std::size_t wheel, double value, double duration_s, bool& anew);
  bool gyro_awaited(double time_s) const;
  bool gyro_is_silent() const;
  GyroReading gyro_at(double time_s) const;
  void forget_samples_before(double time_s);

  std::array<Wheel, kMaxWheels> wheel_{};
  std::vector<std::string> names_;
  std::vector<std::string> places_;  // of the wheels, for messages
  std::size_t wheel_count_;
  WheelUnits units_{};
  std::array<double, kMaxWheels> units_per_turn_{};
  std::array<double, kMaxWheels> units_per_m_{};
  std::array<double, kMaxWheels> counter_range_{};  ///< 0: never wraps
  OnlineAlignmentOptions options_;
  std::optional<Gyro> sensor_;
  double wheels_offset_s_;

  std::optional<double> start_s_;
  bool begun_ = false;  ///< the start is aligned: what follows are intervals
  bool finished_ = false;
  WheelsState wheels_;
  GyroState gyro_;
  GyroReading gyro_start_;  ///< at the end of the last interval
  double first_rate_ = 0.0;
  double last_rate_ = 0.0;
  double newest_s_ = 0.0;               ///< of any stream
  std::vector<WheelReadings> pending_;  ///< wait for the gyro
  std::vector<GyroSample> samples_;     ///< since the last interval's end
};

}  // namespace trundle
