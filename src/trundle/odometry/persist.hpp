#pragma once

#include <array>
#include <bit>

#include "trundle/odometry/odometer.hpp"

namespace trundle::odometry {

// What io/archive.hpp needs to know of odometry.

template <class Archive, class Increment>
void persist_increment(Archive& archive, Increment& increment) {
  archive(increment.time_s, increment.duration_s, increment.turned, increment.gyro_rad, increment.has_gyro,
          increment.gyro_change_rad_s, increment.scrub_turned, increment.speed_turned,
          increment.slip_variance, increment.shaking_m_s2, increment.steering_rad);
}

static_assert(sizeof(OdometerState) == 3224, "another size is another format in io/checkpoint.cpp");

/// Plain numbers, without gaps between them.
template <class Archive, class State>
void persist_odometer_state(Archive& archive, State& state) {
  auto bytes = std::bit_cast<std::array<char, sizeof(OdometerState)>>(state);
  archive(bytes);
  if constexpr (Archive::kReads) state = std::bit_cast<OdometerState>(bytes);
}

template <class Archive, class Odometer>
void persist_odometer(Archive& archive, Odometer& odometer) {
  OdometerState state = odometer.state();
  persist_odometer_state(archive, state);
  if constexpr (Archive::kReads) odometer.resume(state);
}

}  // namespace trundle::odometry
