#pragma once

#include <map>
#include <string>
#include <vector>

#include "trundle/odometry/persist.hpp"
#include "trundle/slam/models/motion_sum.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// Cuts increments at the stamps of sightings as they come, and composes what lies between to the steps of a
/// filter: docs/theory/motion-and-sensor.md, eq. 1. All stamps are on the odometry's clock. What slam_input
/// makes of a recording is a loop over it, so both give the same to the last bit.
class StepCutter {
 public:
  /// The robot has a landmark sensor.
  StepCutter(const Robot& robot, const SlamInputOptions& options);

  /// A sighting later than what was advanced through, in order of time; those of one instant one by one.
  void add_sighting(const Sighting& sighting);
  /// The odometry begins: what was seen before is left out.
  void start(double time_s);
  /// An interval, cut where something was seen; all that was seen by its end is known.
  void advance(const Increment& increment, bool bridged);
  /// No more will come: ends a last step, and leaves out what was seen later.
  void finish();

  /// What has been cut since the last call: steps and what belongs to each, and nothing else.
  [[nodiscard]] SlamInput take();
  /// Of the motion since the last step that was cut.
  [[nodiscard]] const MotionSum& motion() const { return motion_; }
  /// How far it has been advanced; the first stamp before.
  [[nodiscard]] double now_s() const { return now_s_; }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_.list; }
  [[nodiscard]] const SystematicErrors& systematic() const { return systematic_; }
  /// Of what was left out.
  [[nodiscard]] std::vector<Finding> findings() const;

  /// Its state, for io/archive.hpp, where take() has been called since it was last advanced. Of a sensor's
  /// clock and of parameters nothing is stored.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.motion_, self.names_, self.waiting_, self.now_s_, self.last_step_s_, self.outside_,
            self.repeated_, self.crowded_);
    odometry::persist_increment(archive, self.before_);
  }

 private:
  /// Numbers for names, in order of first sight.
  struct Names {
    std::map<std::string, LandmarkId> ids;
    std::vector<std::string> list;

    LandmarkId id_of(const std::string& name);
    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.ids, self.list);
    }
  };
  /// A sighting that no interval has reached yet.
  struct Waiting {
    double time_s = 0.0;
    std::string landmark;
    double range_m = 0.0;
    double bearing_rad = 0.0;
    bool operator==(const Waiting&) const = default;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.landmark, self.range_m, self.bearing_rad);
    }
  };

  [[nodiscard]] bool sighting_until(double time_s) const;
  [[nodiscard]] bool stop_until(double time_s) const;
  void move_to(double time_s, const Increment& part, bool bridged);
  void finish_step();
  void finish_sighting_step();
  [[nodiscard]] Observation observed(const Waiting& sighting);
  void forget_first(std::size_t count);

  SlamInputOptions options_;
  LandmarkSensor sensor_;
  SystematicErrors systematic_;
  MotionSum motion_;
  Names names_;
  std::vector<Waiting> waiting_;
  std::size_t first_ = 0;      ///< of waiting_: how many sightings came before it
  std::size_t next_stop_ = 0;  ///< of SlamInputOptions::also_at_s
  std::size_t outside_ = 0;    ///< sightings without odometry
  std::size_t repeated_ = 0;
  std::size_t crowded_ = 0;  ///< sightings, of instants with too many
  Increment before_;         ///< the last interval; of no duration where that was bridged, or is none
  double now_s_ = 0.0;
  double last_step_s_ = 0.0;
  SlamInput input_;
};

}  // namespace trundle::slam
