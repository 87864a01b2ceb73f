#pragma once

#include "trundle/chassis/detail/toml_source.hpp"

namespace trundle::chassis::robot_file {

/// The [calibration] table of a robot whose other sections have been read.
CalibrationRecord read_calibration(const Section& section, const Robot& robot);

}  // namespace trundle::chassis::robot_file
