#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/counter.hpp"
#include "trundle/recording/alignment/usual_step.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// The readings of all wheels at one time, in the order of the robot's wheels; NaN: not read. Of a robot
/// without wheels, its velocity: forwards [m/s] and yaw rate [rad/s].
struct WheelReadings {
  double time_s = 0.0;
  std::array<double, kMaxWheels> value{};
  std::array<double, kMaxWheels> steering{};  ///< of steered wheels, as Chassis::all_wheels()
};

/// Of each wheel's readings.
using WheelUnits = std::array<WheelUnit, kMaxWheels>;

/// What a wheel's counter did within an interval.
struct CounterFinding {
  CounterEvent event = CounterEvent::none;
  std::size_t reading = 0;  ///< at which of those that were added, counted from 0

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.event, self.reading);
  }
};

/// What the wheels' readings sum up to, reading by reading: an odometer's rows. A row is complete when it is
/// known of all wheels: an empty cell waits for that wheel's next reading and is filled in between, but not
/// across a gap; a count that no usual speed explains waits for the next one (Counter).
class WheelSums {
 public:
  struct Options {
    double shortest_gap_s = 0.5;   ///< UsualStep
    double usual_speed_m_s = 1.0;  ///< Counter
  };
  WheelSums(const Robot& robot, const Options& options);

  /// What the wheels give, before they give anything. Throws InputError when a wheel lacks what turns its
  /// readings into revolutions.
  void set_units(const WheelUnits& units);

  /// Stamps must grow: false where they do not, and the reading is left out.
  bool add(const WheelReadings& readings);
  /// No more will come.
  void finish();

  struct Row {
    double time_s = 0.0;                   ///< by the robot's clock
    double longest_step_s = 0.0;           ///< from the row before, or it is a gap
    std::array<double, kMaxWheels> sum{};  ///< in the readings' unit, times seconds of rates; NaN: not known
    bool broken = false;                   ///< since the row before a step was not measured
    std::array<CounterFinding, kMaxWheels> found{};  ///< since then

    /// What happened at a row that is left out concerns the interval that it lies in.
    void take_over(const Row& left_out);

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.longest_step_s, self.sum, self.broken, self.found);
    }
  };
  /// Whether a row is complete.
  [[nodiscard]] bool has_next() const { return !rows_.empty() && is_known(rows_.front()); }
  /// The first complete row, which must be there.
  [[nodiscard]] const Row& next() const { return rows_.front(); }
  [[nodiscard]] Row take_next();

  /// Of each wheel: divides sums into revolutions; 1 for a velocity.
  [[nodiscard]] double units_per_turn(std::size_t wheel) const { return units_per_turn_[wheel]; }
  [[nodiscard]] std::size_t count() const { return sums_.size(); }
  /// Time of the first complete row, and of the last reading; nothing before them.
  [[nodiscard]] const std::optional<double>& start_s() const { return start_s_; }
  [[nodiscard]] const std::optional<double>& last_s() const { return last_s_; }
  /// What is added to the wheels' stamps.
  [[nodiscard]] double offset_s() const { return offset_s_; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.units_);
    if constexpr (Archive::kReads) {
      const WheelUnits units = self.units_;
      self.set_units(units);
    }
    archive(self.sums_, self.rows_, self.left_out_, self.added_, self.usual_step_, self.last_s_,
            self.start_s_, self.finished_);
  }

 private:
  /// Of one wheel, up to the last reading that was decided.
  struct Sum {
    Counter counter{{}};
    std::optional<double> time_s;
    double value = 0.0;
    std::optional<double> velocity;  ///< of a motion that follows the readings with a lag

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.counter, self.time_s, self.value, self.velocity);
    }
  };

  void read(std::size_t wheel, double value, const Row& row);
  double mean_of_motion(Sum& sum, double read, double duration_s) const;
  void settle(std::size_t wheel, const CounterStep& step, double longest_step_s);
  bool is_known(const Row& row) const;
  bool stays_unknown(const Row& row) const;
  void leave_out_unknown();

  std::vector<Wheel> wheels_;
  std::vector<std::string> names_;
  std::vector<std::string> places_;  // of the wheels, for messages
  Options options_;
  double offset_s_;
  double lag_s_;  ///< of the motion behind a velocity
  WheelUnits units_{};
  std::array<double, kMaxWheels> units_per_turn_{};

  std::vector<Sum> sums_;
  std::vector<Row> rows_;  ///< that are not taken
  Row left_out_;           ///< what happened at those since, of which all will never be known
  std::size_t added_ = 0;
  UsualStep usual_step_;
  std::optional<double> last_s_;
  std::optional<double> start_s_;
  bool finished_ = false;
};

}  // namespace trundle::recording
