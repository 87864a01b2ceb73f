#pragma once

#include <array>

#include "trundle/odometry/dead_reckon.hpp"
#include "trundle/odometry/motion_model.hpp"

namespace trundle::odometry {

/// What dead_reckon integrates: twists ξ = T u, one column of T and of u for each input.
struct Reckoning {
  const double* T;
  std::array<const double*, kMaxInputs> inputs;
  std::size_t input_count;
  std::size_t rows;
  Pose2 start;
};

/// The same where wheels are steered: twists by SteeredModel. Inputs as Reckoning's.
struct SteeredReckoning {
  const SteeredModel& model;
  std::array<const double*, kMaxInputs> inputs;
  std::array<const double*, kMaxWheels> steering;
  std::size_t rows;
  Pose2 start;

  /// Of one row.
  Increment increment(std::size_t row) const;
};

/// The poses of Odometer::step, with the same bits on every machine.
void reckon(const Reckoning& task, const PoseColumns& poses);
void reckon(const SteeredReckoning& task, const PoseColumns& poses);

}  // namespace trundle::odometry
