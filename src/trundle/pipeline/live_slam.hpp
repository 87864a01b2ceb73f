#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/odometry/persist.hpp"
#include "trundle/pipeline/live_line.hpp"
#include "trundle/recording/alignment/aligner.hpp"
#include "trundle/slam/models/metre.hpp"
#include "trundle/slam/slam.hpp"
#include "trundle/slam/step_cutter.hpp"

namespace trundle::pipeline {

struct LiveSlamOptions {
  double window_s = 60.0;    ///< poses older than that are marginalised: it drives for days
  bool unknown_ids = false;  ///< every sighting's landmark is unknown
  double late_s = 0.0;       ///< so much later than its stamp a sighting may come [s]
};

/// The smoother that goes along, reading by reading: what `trundle slam --filter smoother` computes of a
/// recording, to the last bit. A value, like LiveOdometer, of which it is a part.
class LiveSlam {
 public:
  /// The robot has a landmark sensor.
  LiveSlam(const Robot& robot, const Pose2& start, const LiveSlamOptions& options);

  /// Throws InputError where sightings of this stamp come too late, or too many wait for the wheels.
  void require_timely(double stamp_s, std::string_view place) const;
  /// All that was seen at one stamp of the sensor's clock, later than the ones before.
  void see(double stamp_s, const std::vector<Sighting>& sightings);
  void start(double time_s);
  void add(const AlignedInterval& interval);
  /// Counts what is complete, where `newest_s` is the latest stamp of all sensors. Throws CannotAnswer where
  /// what was seen leaves the robot's pose undetermined; nothing is left then to go on with.
  void advance(double newest_s, std::vector<LiveSighted>& sighted);
  /// No more will come.
  void finish(std::vector<LiveSighted>& sighted);

  /// Stamp of the latest sightings.
  [[nodiscard]] std::optional<double> last_s() const { return last_s_; }
  /// After the last interval that was added; nothing before something has been seen.
  [[nodiscard]] std::optional<LiveSlamPose> estimate() const;
  /// The rows of landmarks.csv.
  [[nodiscard]] std::vector<LandmarkRow> map() const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.cutter_, self.filter_, self.waiting_, self.started_, self.seen_, self.last_s_,
            self.instants_);
  }

 private:
  struct Interval {
    Increment increment;
    bool bridged = false;
    bool is_start = false;  ///< of the odometry, and no interval

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      odometry::persist_increment(archive, self.increment);
      archive(self.bridged, self.is_start);
    }
  };

  [[nodiscard]] bool is_complete(const Interval& interval, double newest_s) const;
  void count(const Interval& interval, std::vector<LiveSighted>& sighted);
  void count_steps(std::vector<LiveSighted>& sighted);
  [[nodiscard]] LiveSlamPose slam_pose(PoseEstimate estimate) const;
  [[nodiscard]] std::string name_of(LandmarkId id) const;

  double late_s_;
  double sensor_clock_s_;  ///< added to its stamps
  StepCutter cutter_;
  Metre metre_;
  SlamFilter filter_;
  std::vector<Interval> waiting_;  ///< sightings within them may come yet
  bool started_ = false;           ///< the cutter has
  bool seen_ = false;              ///< something has counted
  std::optional<double> last_s_;
  std::vector<double> instants_;  ///< of sightings that no interval has reached, on the odometry's clock
};

}  // namespace trundle::pipeline
