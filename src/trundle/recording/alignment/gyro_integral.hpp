#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "trundle/chassis/chassis.hpp"
#include "trundle/recording/alignment/usual_step.hpp"

namespace trundle::recording {

/// The integral of a gyro's raw readings on the robot's clock, sample by sample, read off between the samples
/// by linear interpolation of the angle, never of a rate across a gap.
class GyroIntegral {
 public:
  GyroIntegral(const Gyro& gyro, double longest_step_s)
      : offset_s_(gyro.time_offset_s), max_rate_rad_s_(gyro.max_rate_rad_s), usual_step_(longest_step_s) {}

  /// By the sensor's clock, which must grow: false where it does not, and the sample is left out. The rate is
  /// the mean since the sample before; NaN: not measured.
  bool add(double time_s, double yaw_rate_rad_s);

  /// The angle at one time.
  struct Reading {
    bool known = false;
    double angle = 0.0;
    std::size_t lost_before = 0;  ///< steps without a usable rate up to the sample before the time, or at it
    std::size_t lost_after = 0;   ///< and up to the sample after it, or at it

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.known, self.angle, self.lost_before, self.lost_after);
    }
  };
  /// Beyond its ends a gyro holds its rate for a step, its first or last: samples of two sensors never start
  /// and end together. `is_silent`: it will not be heard again.
  [[nodiscard]] Reading at(double time_s, bool is_silent = false) const;
  /// What it turned between two readings [rad]; nothing where it has a gap or was saturated.
  [[nodiscard]] static std::optional<double> turn(const Reading& start, const Reading& end);
  /// A rate is the mean over so long: that of a single sample is mostly noise.
  static constexpr double kRateOver_s = 0.1;
  /// Its rate up to a time at which it was read; NaN where it has not been measured.
  [[nodiscard]] double rate_before(double time_s, const Reading& there) const;

  [[nodiscard]] bool is_heard() const { return first_s_.has_value(); }
  [[nodiscard]] double last_s() const { return samples_.back().time_s; }
  /// Whether a sample may still come that changes what is read off at this time.
  [[nodiscard]] bool is_awaited(double time_s) const;
  [[nodiscard]] double longest_step_s() const { return usual_step_.longest_s(); }
  [[nodiscard]] std::size_t saturated() const { return saturated_; }

  /// Nothing will be asked of earlier times.
  void forget_before(double time_s);

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.usual_step_, self.first_s_, self.before_s_, self.beyond_s_, self.first_rate_,
            self.last_rate_, self.saturated_, self.samples_);
  }

 private:
  struct Sample {
    double time_s = 0.0;
    double angle = 0.0;
    std::size_t lost = 0;  ///< steps without a usable rate up to here

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.angle, self.lost);
    }
  };
  std::vector<Sample>::const_iterator first_at_or_after(double time_s) const;

  double offset_s_;
  double max_rate_rad_s_;
  UsualStep usual_step_;
  std::optional<double> first_s_;
  std::optional<double> before_s_;  ///< it reaches so far before its first sample: a step, not a gap
  double beyond_s_ = 0.0;           ///< and beyond its last
  double first_rate_ = 0.0;
  double last_rate_ = 0.0;
  std::size_t saturated_ = 0;
  std::vector<Sample> samples_;
};

}  // namespace trundle::recording
