#pragma once

#include "trundle/simulation/drive.hpp"

namespace trundle::simulation {

// What each sensor reports of a drive. Stamps are true time + scenario.start_s − the sensor's true time
// offset.

WheelStream read_encoders(const Scenario& scenario, const Drive& drive);
/// For a robot without wheels: the velocity stream instead.
VelocityStream read_velocity(const Scenario& scenario, const Drive& drive);

struct GyroReadings {
  GyroStream stream;
  double last_bias_rad_s = 0.0;
};
/// Empty when the true robot has no gyro.
GyroReadings read_gyro(const Scenario& scenario, const Drive& drive);
ReferenceStream read_reference(const Scenario& scenario, const Drive& drive);
PartialReference read_partial_reference(const Scenario& scenario, const Drive& drive);
/// Empty when the true robot has no landmark sensor.
std::vector<Sighting> read_sightings(const Scenario& scenario, const Drive& drive);

}  // namespace trundle::simulation
