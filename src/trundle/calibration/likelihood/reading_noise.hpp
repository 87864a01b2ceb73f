#pragma once

#include <array>
#include <optional>

#include "trundle/chassis/chassis.hpp"
#include "trundle/recording/alignment/increments.hpp"

namespace trundle::calibration {

/// By how much sensors read wrong, of all by which motion and readings differ; nothing: by all of it.
struct ReadingNoise {
  std::array<std::optional<double>, kMaxWheels> wheel_per_sqrt_m{};
  std::optional<double> gyro_rad_s_sqrt_hz{};
};

/// Of skid wheels, by how much what they read jumps from one reading to the next: so much they read wrong at
/// most. Beyond that they scrub: they are read rightly, and the ground moves otherwise. Of other wheels,
/// none. docs/theory/effective-track.md, eq. 3.
[[nodiscard]] ReadingNoise noise_in_readings(const recording::Increments& increments, const Chassis& chassis);

/// The chassis with the noise of readings alone.
[[nodiscard]] Chassis as_read(const Chassis& chassis, const ReadingNoise& noise);

}  // namespace trundle::calibration
