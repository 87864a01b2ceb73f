#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/evaluation/errors_along.hpp"
#include "trundle/report/compared_with.hpp"

namespace trundle::report {

/// What a trajectory of a result is.
enum class TrackRole {
  reference,
  nominal,    ///< odometry with the robot file as given
  odometry,   ///< with the robot that is used
  corrected,  ///< for slip
  online,     ///< of a landmark filter: from what was seen up to then
  path,       ///< of its best particle
  smoothed,   ///< from all that was seen
  localized,  ///< on a known map
  result,     ///< the best there is
  other,
};
std::string_view name_of(TrackRole role);

/// Of a longer trajectory some are left out: it is drawn and compared all the same.
inline constexpr std::size_t kMostPosesKept = 500'000;

/// One trajectory of a result, and how far it is from the reference.
struct ResultTrack {
  std::string name;  ///< "slam/trajectory"
  TrackRole role = TrackRole::other;
  Trajectory trajectory = {};  ///< laid on the reference where there is one
  std::size_t left_out = 0;    ///< poses that were thinned out
  Pose2 laid_by = {};          ///< the motion that did so
  std::optional<Evaluation> evaluation = {};
  ErrorsAlong errors = {};
  std::string not_compared = {};  ///< why there is a reference but no evaluation; empty: nothing to say
};

/// By the name of its file, from the folder and without extension.
TrackRole role_of(std::string_view name);

/// trajectory.csv, .tum or reference.csv; headings that a reference lacks are NaN.
ResultTrack read_track(const std::filesystem::path& path, const std::string& name);

/// Evaluates a track, as seen by the reference sensor, against the reference and lays it on it. Where the
/// alignment asks for a heading that was not measured, se2 is used instead; where nothing can be compared,
/// the track says why.
void compare(ResultTrack& track, const ComparedWith& with, Alignment alignment);

/// The one that the rest of a result refers to: the best informed; null where there is none.
const ResultTrack* main_track(const std::vector<ResultTrack>& tracks);
const ResultTrack* track_of_role(const std::vector<ResultTrack>& tracks, TrackRole role);

}  // namespace trundle::report
