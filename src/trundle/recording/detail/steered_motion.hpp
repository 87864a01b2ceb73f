#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/alignment/steering_angles.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// The motion of a body whose wheels do not skid, by the angles of those that are steered and by how far
/// wheels roll, with the clock of the steering moved. What wheels on two sides of the body roll differently
/// tells a turn without the steering, and does not count.
class SteeredMotion {
 public:
  /// The readings must outlive it. Throws as align() does.
  SteeredMotion(const Recording& recording, const AlignedReadings& readings, const Robot& robot);
  /// The same by angles that are means over so long.
  [[nodiscard]] SteeredMotion smoothed(double over_s) const;

  struct Twists {
    std::vector<Twist2> twist;  ///< of each increment
    std::vector<bool> lost;     ///< its course is not known, or the steering leaves it open
  };
  /// With `later_s` added to the time offset of every steered wheel.
  [[nodiscard]] Twists twists(double later_s) const;

  [[nodiscard]] const AlignedReadings& readings() const { return readings_; }
  /// Usual step of the steering that is read most rarely; 0 where none is.
  [[nodiscard]] double steering_step_s() const { return steering_step_s_; }

 private:
  std::optional<Vector3> direction(const std::array<double, kMaxWheels>& steering_rad) const;

  const AlignedReadings& readings_;
  Chassis chassis_;
  SteeringAngles angles_;
  double steering_step_s_ = 0.0;
  double longest_step_s_ = 0.0;          ///< of the steering that is no gap
  Matrix3 unsteered_ = Matrix3::Zero();  ///< LᵀL of the lateral rows of the others
  double size_m_ = 0.0;                  ///< of the robot: what a turn of 1 rad moves
};

}  // namespace trundle::recording
