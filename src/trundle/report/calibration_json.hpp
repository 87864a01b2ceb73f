#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/calibration/result.hpp"

namespace trundle {

/// What stands under "format" and "format_version" of a calibration.json.
inline constexpr std::string_view kCalibrationFormat = "trundle-calibration";
inline constexpr int kCalibrationFormatVersion = 1;

/// A calibration as the document that docs/calibration-json.md describes: SI units, radians, everything the
/// page draws already computed. What is unknown or not finite is null; text that is not UTF-8 is repaired.
/// `provenance` is put in as it is.
nlohmann::ordered_json calibration_json(const CalibrationResult& result,
                                        const nlohmann::ordered_json& provenance);

/// Reads such a document back. Throws InputError with file (and line, when it is not JSON at all), what
/// stands there and what was expected. `file_name` is for the messages only.
nlohmann::ordered_json parse_calibration_json(std::string_view text, std::string_view file_name);

}  // namespace trundle
