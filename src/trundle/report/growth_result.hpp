#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/geometry/pose2.hpp"
#include "trundle/report/slam_result.hpp"

namespace trundle::report {

/// What an online estimate was at some moment.
struct GrowthSnapshot {
  double time_s = 0.0;
  Pose2 pose;
  Matrix2 covariance = Matrix2::Zero();  ///< of the position, in world axes
  std::vector<Vector2> path;             ///< as known then
  std::vector<LandmarkRow> landmarks;
};

/// growth.json: an online estimate as it grew.
struct GrowthResult {
  std::string robot = {};  ///< of several in one world; empty: there is but one
  std::vector<GrowthSnapshot> snapshots;
  std::vector<double> moved_time_s;  ///< stamps of sightings, and how far they moved the pose then
  std::vector<double> moved_m;
};

/// The same where `by` moves it to.
[[nodiscard]] GrowthResult placed(GrowthResult growth, const Pose2& by);

[[nodiscard]] nlohmann::ordered_json to_json(const GrowthResult& growth);
/// Throws InputError with file, what stands there and what was expected.
GrowthResult growth_from_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
