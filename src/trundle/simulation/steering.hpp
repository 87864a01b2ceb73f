#pragma once

#include <span>
#include <vector>

#include "trundle/simulation/command.hpp"
#include "trundle/simulation/drive.hpp"
#include "trundle/simulation/kinematics.hpp"

namespace trundle::simulation {

/// What the steerings of the wheels read without noise, as Increment::steering_rad.
struct SteeringPlan {
  std::vector<SteeringReadings> at;      ///< those times
  std::vector<SteeringReadings> within;  ///< the middle of the interval after each, but for the last
};

/// Each steered wheel stands as the commanded motion of its place asks for, and turns the shorter way, a
/// wheel that then rolls backwards included. Where its place rests it turns evenly from the angle before to
/// the one after. docs/theory/simulation.md, eq. 4.
SteeringPlan plan_steering(const Scenario& scenario, const Kinematics& kinematics, const Command& command,
                           std::span<const double> times_s);

/// The column of each steered wheel, noise and rounding to counts included.
std::vector<WheelSeries> read_steering(const Scenario& scenario, const Drive& drive);

}  // namespace trundle::simulation
