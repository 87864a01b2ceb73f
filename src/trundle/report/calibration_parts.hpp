#pragma once

#include <cstddef>
#include <span>

#include <nlohmann/json_fwd.hpp>

#include "trundle/calibration/result.hpp"

namespace trundle::report {

// The parts of a calibration.json (docs/calibration-json.md), each a value of its own.

/// "parameters": an array, with intervals and, for a held one, the sentence why.
nlohmann::ordered_json parameters_json(const CalibrationResult& result);
/// "correlation": names and matrices of the observable parameters.
nlohmann::ordered_json correlation_json(const CalibrationResult& result);
/// "directions": an array, each with what it is in words.
nlohmann::ordered_json directions_json(const CalibrationResult& result);
/// "runs": an array, with the trajectories to draw.
nlohmann::ordered_json runs_json(std::span<const RunResult> runs);
/// A calibration.json whose runs are drawn with at most about so many rows: every n-th of them and the last.
nlohmann::ordered_json with_thinned_runs(nlohmann::ordered_json document, std::size_t rows);
/// "influence": the parameters without each run, and after the first so many; null where it is not known.
nlohmann::ordered_json influence_json(const CalibrationResult& result);
/// "errors": before and after, over the training and over the hold-out runs.
nlohmann::ordered_json errors_json(std::span<const RunResult> runs);
/// "end_points": the scatter of the closed runs by turn, before and after.
nlohmann::ordered_json end_points_json(std::span<const RunResult> runs);

}  // namespace trundle::report
