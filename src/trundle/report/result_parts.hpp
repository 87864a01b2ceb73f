#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/report/results.hpp"

namespace trundle::report {

// The parts of a result in the report's document (docs/report-json.md), each a value of its own. `rows`: as
// many as a picture keeps (picture_rows.hpp).

/// "tracks" and "errors".
nlohmann::ordered_json tracks_json(const std::vector<ResultTrack>& tracks, std::size_t rows);
nlohmann::ordered_json errors_json(const std::vector<ResultTrack>& tracks, std::size_t rows);

/// "slip": each event with its place on the track.
nlohmann::ordered_json slip_json(const SlipResult& slip, const ResultTrack* track, std::size_t rows);

/// "gyro": the bias over time by odometry and by SLAM, the Allan deviation; null where there is nothing.
nlohmann::ordered_json gyro_json(const Results& results);

/// "map": landmarks with ellipses, laid on the reference by the motion that laid its trajectory.
nlohmann::ordered_json map_json(const std::vector<LandmarkRow>& map, const Pose2& laid_by);
/// "particles": the last cloud of a particle filter, laid as its map is.
nlohmann::ordered_json particles_json(const ParticleColumns& particles, const Pose2& laid_by);
/// Of "growth": an online estimate as it grew, laid as its trajectory is.
nlohmann::ordered_json growth_json(const GrowthResult& growth, const Pose2& laid_by, std::size_t rows);
/// "filter": N_eff and resampling; "sightings": NIS, decisions.
nlohmann::ordered_json filter_json(const FilterColumns& filter, std::size_t rows);
nlohmann::ordered_json sightings_json(const SightingColumns& sightings, std::size_t rows);

/// "answers" and "attention": what stands on the first screen, of results whose other parts are these.
nlohmann::ordered_json answers_json(const nlohmann::ordered_json& parts);
nlohmann::ordered_json attention_json(const nlohmann::ordered_json& parts, const Results& results);

/// {"x_m", ...} of an ellipse.
nlohmann::ordered_json ellipse_json(const Matrix2& covariance);

}  // namespace trundle::report
