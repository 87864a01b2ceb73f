#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/odometry/persist.hpp"
#include "trundle/odometry/uncertain.hpp"
#include "trundle/pipeline/live_line.hpp"
#include "trundle/pipeline/live_slam.hpp"
#include "trundle/recording/alignment/aligner.hpp"

namespace trundle::pipeline {

struct LiveOptions {
  Pose2 start = {};  ///< at the first reading of the wheels
  SlipOptions slip = {};
  AlignerOptions alignment = {};
  LiveSlamOptions slam = {};  ///< of a robot with a landmark sensor
};

/// Odometry with covariance, the gyro's bias and slip, pose and map from sightings, reading by reading: what
/// `trundle odometry`, `trundle slip --corrected` and `trundle slam` compute of a recording, to the last bit.
/// A value: a copy goes on by itself, and so does a LiveOdometer of the same robot and options that is given
/// the state (io/archive.hpp).
class LiveOdometer {
 public:
  /// Throws CannotAnswer where the robot's sensors cannot determine its motion.
  LiveOdometer(const Robot& robot, const LiveOptions& options);

  /// Appends what the line completes to `estimates`: usually one for each reading of the wheels. Throws
  /// InputError where the line does not suit the robot, is not later than the one before it, or is the
  /// first that is more than a day away; it is then left out. Where all lines are more than a day before the
  /// very first, that one was garbled, and it starts again. Throws CannotAnswer where what was seen leaves
  /// the pose undetermined; from then on it is odometry alone.
  void take(const LiveLine& line, std::string_view place, std::vector<LiveEstimate>& estimates);
  /// Not later than what has been taken of the same sensors, or without a reading of them.
  [[nodiscard]] bool is_known(const LiveLine& line) const;
  /// What waited for further readings.
  void finish(std::vector<LiveEstimate>& estimates);
  /// What sightings have made of the pose that counted with the last line, or at the end.
  [[nodiscard]] std::vector<LiveSighted> take_sighted() { return std::exchange(sighted_, {}); }
  /// As known now; empty without a landmark sensor.
  [[nodiscard]] std::vector<LandmarkRow> map() const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.aligner_, self.started_, self.slipping_, self.wheels_s_, self.gyro_s_, self.map_s_,
            self.suspect_s_, self.moves_on_, self.units_, self.steering_units_);
    persist_odometer(archive, self.odometer_);
    if (self.slip_) archive(*self.slip_);
    bool has_slam = self.slam_.has_value();
    archive(has_slam);
    if constexpr (Archive::kReads)
      if (!has_slam) self.slam_.reset();
    if (self.slam_) archive(*self.slam_);
  }

 private:
  [[nodiscard]] bool has_reading(const LiveLine& line) const;
  void require_suitable(const LiveLine& line, std::string_view place) const;
  void require_near(double time_s, std::string_view place);
  [[nodiscard]] std::optional<double> last_s() const;
  void advance_slam();
  void take_wheels(const LiveLine& line, std::string_view place);
  void take_intervals(std::vector<LiveEstimate>& estimates);
  LiveEstimate step(const AlignedInterval& interval);
  LiveEstimate estimate_at(double time_s) const;

  Robot robot_;
  LiveOptions options_;
  Aligner aligner_;
  UncertainParameters uncertain_;
  Odometer odometer_;
  std::optional<SlipOdometer> slip_;
  std::optional<LiveSlam> slam_;
  std::vector<LiveSighted> sighted_;
  bool started_ = false;  ///< the start has been told
  bool slipping_ = false;
  std::optional<double> wheels_s_;  ///< stamps of the latest readings
  std::optional<double> gyro_s_;
  std::optional<double> map_s_;      ///< when the map was asked for
  std::optional<double> suspect_s_;  ///< a stamp far away that was refused: another one there confirms it
  bool moves_on_ = false;            ///< a second stamp came after the first
  WheelUnits units_{};
  WheelUnits steering_units_{};
};

/// `settings` says in words all that the odometer depends on besides the input: a checkpoint goes on under
/// the same alone.
void write_live_checkpoint(const std::filesystem::path& path, const std::string& settings,
                           const LiveOdometer& odometer);
/// Throws InputError where the file is no checkpoint of trundle live, or of other settings.
void read_live_checkpoint(const std::filesystem::path& path, const std::string& settings,
                          LiveOdometer& odometer);

}  // namespace trundle::pipeline
