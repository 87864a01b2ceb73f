#include <cmath>
#include <string>

#include "trundle/simulation/drive.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/simulation/sensors.hpp"
#include "trundle/simulation/steering.hpp"

namespace trundle::simulation {
namespace {

Trajectory trajectory_of(const Drive& drive, double start_s) {
  Trajectory trajectory;
  trajectory.poses.reserve(drive.moments.size());
  for (const Moment& moment : drive.moments)
    trajectory.poses.push_back({moment.time_s + start_s, moment.body});
  return trajectory;
}

bool crowded(const std::vector<Landmark>& landmarks, const Vector2& position, double spacing_m) {
  for (const Landmark& landmark : landmarks)
    if ((landmark.position - position).norm() < spacing_m) return true;
  return false;
}

}  // namespace

Simulation simulate(const Scenario& scenario) {
  const Drive driven = drive(scenario);
  Simulation simulation;
  Recording& recording = simulation.recording;
  if (scenario.truth.chassis.wheel_count > 0) {
    recording.wheels = read_encoders(scenario, driven);
    recording.wheels.steering = read_steering(scenario, driven);
  } else {
    recording.velocity = read_velocity(scenario, driven);
  }
  GyroReadings gyro = read_gyro(scenario, driven);
  recording.gyro = std::move(gyro.stream);
  recording.reference = read_reference(scenario, driven);
  recording.partial = read_partial_reference(scenario, driven);
  recording.sightings = read_sightings(scenario, driven);
  if (scenario.sightings.rate_hz > 0.0 && scenario.sightings.give_map)
    recording.landmarks = scenario.landmarks;
  simulation.truth = {trajectory_of(driven, scenario.start_s), driven.slips, gyro.last_bias_rad_s};
  return simulation;
}

std::vector<Landmark> random_landmarks(int count, double box_x_m, double box_y_m, double spacing_m,
                                       Random& random) {
  constexpr int kTries = 100;  // then the box is taken to be full, and the landmark stands too close
  std::vector<Landmark> landmarks;
  for (int i = 0; i < count; ++i) {
    Vector2 position;
    for (int tries = 0; tries < kTries; ++tries) {
      position = {random.uniform(-0.5, 0.5) * box_x_m, random.uniform(-0.5, 0.5) * box_y_m};
      if (!crowded(landmarks, position, spacing_m)) break;
    }
    landmarks.push_back({std::to_string(i + 1), position});
  }
  return landmarks;
}

}  // namespace trundle::simulation
