#pragma once

#include <string>

#include "trundle/pipeline/calibration_answer.hpp"

#include "command.hpp"

namespace trundle::app {

/// Where the result of a calibration goes: options of `calibrate` and `umbmark`.
struct CalibrationOutput {
  std::string robot_path;     ///< -o: the calibrated robot file; empty: nothing is written
  std::string export_format;  ///< --export: of another stack; empty: none
};
void add_calibration_output(CLI::App& command, CalibrationOutput& output);

/// Writes the robot file, calibration.json and the export beside it, then prints the table (or the document).
/// Everything is computed before the first file is written. Throws as export_robot and write_file do.
void finish_calibration(const CalibrationAnswer& answer, const CalibrationOutput& output,
                        const Common& common);

/// Parameters before and after with their sigmas, errors before and after, what cannot be determined,
/// warnings.
std::string table_of(const CalibrationResult& result);

}  // namespace trundle::app
