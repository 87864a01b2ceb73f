#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "trundle/logs/field_reader.hpp"

namespace trundle::recording {

/// Which axis of an inertial sensor points up, by what it measures: at rest and on average an accelerometer
/// reads gravity upwards; where it reads none, the orientation that a sensor_msgs/Imu may hold is asked.
class UpAxis {
 public:
  UpAxis(const logs::Layout& layout, logs::Encoding encoding);

  void add(const logs::Message& message);

  struct Answer {
    std::size_t axis = 2;       ///< 0: x
    double sign = 1.0;          ///< -1: it points down
    std::string evidence = {};  ///< "accelerometer" or "orientation"; empty: neither says, z is taken
  };
  [[nodiscard]] Answer answer() const;

 private:
  std::vector<logs::FieldReader> acceleration_;  ///< none: the message has none
  std::vector<logs::FieldReader> orientation_;
  std::array<double, 3> acceleration_sum_{};
  std::array<double, 3> up_sum_{};
  std::size_t messages_ = 0;
};

}  // namespace trundle::recording
