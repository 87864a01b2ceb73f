#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

#include "trundle/calibration/result.hpp"

namespace trundle::report {

/// What stands under "format" and "format_version" of a calibration.json.
inline constexpr std::string_view kCalibrationFormat = "trundle-calibration";
inline constexpr int kCalibrationFormatVersion = 1;

/// A calibration as the document that docs/calibration-json.md describes: SI units, radians, everything the
/// page draws already computed. What is unknown or not finite is null; text that is not UTF-8 is repaired.
/// `provenance` is put in as it is.
nlohmann::ordered_json calibration_json(const CalibrationResult& result,
                                        const nlohmann::ordered_json& provenance);

/// A calibration.json, and what follows from it besides what the page draws.
struct CalibrationDocument {
  nlohmann::ordered_json document;
  bool sets_gyro_clock = false;      ///< then nothing is left to do about a gyro that is late
  bool sets_steering_clock = false;  ///< likewise
};
CalibrationDocument calibration_document(const CalibrationResult& result,
                                         const nlohmann::ordered_json& provenance);
/// Throws as parse_calibration_json.
CalibrationDocument calibration_from_json(std::string_view text, std::string_view file_name);

/// Reads such a document back. Throws InputError with file (and line, when it is not JSON at all), what
/// stands there and what was expected. `file_name` is for the messages only.
nlohmann::ordered_json parse_calibration_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
