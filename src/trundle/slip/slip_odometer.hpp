#pragma once

#include <algorithm>

#include "trundle/odometry/odometer.hpp"
#include "trundle/slip/detector.hpp"
#include "trundle/slip/merge.hpp"

namespace trundle::slip {

/// Odometry that knows when not to trust a wheel: judges the readings interval by interval, and integrates
/// them corrected. Readings are integrated as they come; when the interval they belong to turns out to slip,
/// the pose goes back to where it began and takes the corrected ones. Bounded time, no heap after
/// construction; a copy continues independently. docs/slip.md.
class SlipOdometer {
 public:
  struct Options {
    Odometer::Options odometry = {};  ///< with learn_gyro_bias the slip test uses the bias learned so far
    SlipOptions slip = {};
  };

  /// Throws CannotAnswer where the robot's sensors cannot show its motion or its slip.
  SlipOdometer(const Robot& robot, const Options& options);

  /// The verdict on the interval that this increment completes, if it completes one.
  /// `command`: what became of the commanded motion since the increment before.
  std::optional<SlipVerdict> step(const Increment& increment, CommandChange command = {});
  /// An increment whose course is not known: ends the interval and is not judged.
  SlipVerdict step_across_gap(const Increment& increment);
  /// Ends the slip that lasts, if any.
  SlipVerdict finish() { return detector_.finish(); }

  [[nodiscard]] const Odometer& odometer() const { return odometer_; }
  [[nodiscard]] const SlipDetector& detector() const { return detector_; }
  /// How the increments of the interval that is not complete yet are corrected for now.
  [[nodiscard]] const SlipCorrection& applied() const { return applied_; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    persist_odometer(archive, self.odometer_);
    persist_odometer_state(archive, self.interval_start_);
    archive(self.detector_, self.merger_, self.command_, self.applied_, self.part_count_);
    for (std::size_t i = 0; i < std::min(self.part_count_, self.parts_.size()); ++i)
      persist_increment(archive, self.parts_[i]);
  }

 private:
  /// Of an interval: so many at 256 Hz and 0.25 s.
  static constexpr std::size_t kMostParts = 64;

  void keep(const Increment& increment);
  void redo(const SlipCorrection& correction);

  Odometer odometer_;
  SlipDetector detector_;
  IncrementMerger merger_;
  CommandChange command_;
  OdometerState interval_start_;
  SlipCorrection applied_;  ///< to the increments of this interval, so far
  double shortest_part_s_;  ///< increments that are shorter are kept as one
  std::array<Increment, kMostParts> parts_;
  std::size_t part_count_ = 0;
};

}  // namespace trundle::slip
