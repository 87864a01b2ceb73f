#pragma once

#include <filesystem>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/report/result_files.hpp"
#include "trundle/report/result_track.hpp"

namespace trundle {

// The parts of a result in the report's document (docs/report-json.md), each a value of its own.

/// "tracks" and "errors".
nlohmann::ordered_json tracks_json(const std::vector<ResultTrack>& tracks);
nlohmann::ordered_json errors_json(const std::vector<ResultTrack>& tracks);

/// "slip": from slip.json where it is there, else from slip.csv; each event with its place on the track.
nlohmann::ordered_json slip_json(const nlohmann::ordered_json& document, const ResultTrack* track);
nlohmann::ordered_json slip_json(const std::filesystem::path& csv, const ResultTrack* track);

/// "gyro": the bias over time from odometry.json and slam.json, the Allan deviation from info.json; any may
/// be null.
nlohmann::ordered_json gyro_json(const nlohmann::ordered_json& odometry, const nlohmann::ordered_json& slam,
                                 const nlohmann::ordered_json& info);

/// "map": landmarks with ellipses, laid on the reference by the motion that laid its trajectory.
nlohmann::ordered_json map_json(const std::filesystem::path& csv, const Pose2& laid_by);
/// "particles": the last cloud of a particle filter, laid as its map is.
nlohmann::ordered_json particles_json(const std::filesystem::path& csv, const Pose2& laid_by);
/// "filter": N_eff and resampling; "sightings": NIS, decisions.
nlohmann::ordered_json filter_json(const std::filesystem::path& csv);
nlohmann::ordered_json sightings_json(const std::filesystem::path& csv);

/// "answers" and "attention": what stands on the first screen, of a result that is complete otherwise.
nlohmann::ordered_json answers_json(const nlohmann::ordered_json& result);
nlohmann::ordered_json attention_json(const nlohmann::ordered_json& result);

/// {"x_m", ...} of an ellipse.
nlohmann::ordered_json ellipse_json(const Matrix2& covariance);

}  // namespace trundle
