#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"

namespace trundle::pipeline {

struct CalibrationAnswer {
  Provenance provenance;
  CalibrationResult result;  ///< its robot names the provenance
};

/// What `trundle calibrate` does. Throws as calibrate.
CalibrationAnswer answer_calibration(std::span<const Recording> training, std::span<const Recording> hold_out,
                                     const RobotFile& nominal, const CalibrateOptions& options);

/// What `trundle calibrate --landmarks` does. Throws as calibrate_from_landmarks.
CalibrationAnswer answer_landmark_calibration(std::span<const Recording> training,
                                              std::span<const Recording> hold_out, const RobotFile& nominal,
                                              const CalibrateOptions& options);

/// The robot takes the provenance along.
void add_provenance(const Provenance& provenance, CalibrationResult& result);

/// What `calibrate` and `umbmark` write: the robot, calibration.json beside it and, when a format is named
/// (export_formats), the words of that stack. Throws as export_robot.
std::vector<OutputFile> files_of(const CalibrationAnswer& answer, const std::filesystem::path& robot,
                                 const std::string& export_format = {});

/// What stands in calibration.json.
nlohmann::ordered_json document_of(const CalibrationAnswer& answer);

}  // namespace trundle::pipeline
