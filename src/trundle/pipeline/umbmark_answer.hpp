#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/calibration/squares/umbmark.hpp"
#include "trundle/pipeline/calibration_answer.hpp"

namespace trundle::pipeline {

/// What `trundle umbmark` is asked, besides the robot.
struct UmbmarkQuestion {
  std::vector<std::string> inputs;    ///< one sheet, or recordings of square runs
  std::optional<double> side_m = {};  ///< nominal side of the square; a sheet may say it itself
  SquareMethod method = SquareMethod::orientation;
  std::string export_format = {};  ///< of another stack, as files_of has it; empty: none
};

/// Whether the input is a sheet that somebody wrote. Throws InputError where it is one of several.
[[nodiscard]] bool is_sheet(const UmbmarkQuestion& question);

/// Recordings need the side. Throws as read_sheet, read_recordings and umbmark.
CalibrationAnswer answer_umbmark(const UmbmarkQuestion& question, const RobotFile& nominal);

}  // namespace trundle::pipeline
