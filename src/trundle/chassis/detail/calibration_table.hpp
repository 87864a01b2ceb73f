#pragma once

#include "trundle/chassis/detail/toml_source.hpp"

namespace trundle::robot_file {

/// The [calibration] table of a robot whose other sections have been read.
CalibrationRecord read_calibration(const Section& section, const Robot& robot);

}  // namespace trundle::robot_file
