#include "trundle/recording/lengths.hpp"

#include <string_view>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::recording {
namespace {

/// The columns of one stream.
struct Lengths {
  std::string_view stream;
  std::size_t stamps;

  void require(std::string_view column, const std::vector<double>& values) const {
    if (values.size() == stamps) return;
    throw InputError(stream, fmt::format("column '{}' has {} rows", column, values.size()),
                     fmt::format("{}, as time_s has; what was not measured is NaN", stamps));
  }
  void require(const std::vector<WheelSeries>& series) const {
    for (const WheelSeries& one : series) require(one.wheel, one.value);
  }
};

}  // namespace

void require_equal_lengths(const ReferenceStream& reference) {
  const Lengths lengths{"reference", reference.time_s.size()};
  lengths.require("x_m", reference.x_m);
  lengths.require("y_m", reference.y_m);
  lengths.require("heading_rad", reference.heading_rad);
}

void require_equal_lengths(const Recording& recording) {
  const Lengths wheels{"wheels", recording.wheels.time_s.size()};
  wheels.require(recording.wheels.series);
  wheels.require(recording.wheels.steering);
  Lengths{"gyro", recording.gyro.time_s.size()}.require("yaw_rate_rad_s", recording.gyro.yaw_rate_rad_s);
  const Lengths velocity{"velocity", recording.velocity.time_s.size()};
  velocity.require("forward_m_s", recording.velocity.forward_m_s);
  velocity.require("yaw_rate_rad_s", recording.velocity.yaw_rate_rad_s);
  const Lengths commands{"commands", recording.commands.time_s.size()};
  commands.require("forward_m_s", recording.commands.forward_m_s);
  commands.require("yaw_rate_rad_s", recording.commands.yaw_rate_rad_s);
  const Lengths accel{"accel", recording.accel.time_s.size()};
  accel.require("x_m_s2", recording.accel.x_m_s2);
  accel.require("y_m_s2", recording.accel.y_m_s2);
  require_equal_lengths(recording.reference);
}

}  // namespace trundle::recording
