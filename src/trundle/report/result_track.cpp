#include "trundle/report/result_track.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/geometry/thinning.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/report/csv_columns.hpp"

namespace trundle::report {
namespace {

struct NamedRole {
  std::string_view name;
  TrackRole role;
};
constexpr std::array kRoles = {
    NamedRole{"reference", TrackRole::reference},    NamedRole{"nominal", TrackRole::nominal},
    NamedRole{"odometry", TrackRole::odometry},      NamedRole{"calibrated", TrackRole::odometry},
    NamedRole{"corrected", TrackRole::corrected},    NamedRole{"slip_corrected", TrackRole::corrected},
    NamedRole{"slam/trajectory", TrackRole::online}, NamedRole{"slam/online", TrackRole::online},
    NamedRole{"slam/path", TrackRole::path},         NamedRole{"path", TrackRole::path},
    NamedRole{"slam/smoothed", TrackRole::smoothed}, NamedRole{"smoothed", TrackRole::smoothed},
    NamedRole{"localization", TrackRole::localized}, NamedRole{"localized", TrackRole::localized},
    NamedRole{"trajectory", TrackRole::result},
};
constexpr std::array<std::string_view, 10> kRoleNames = {"reference", "nominal", "odometry", "corrected",
                                                         "online",    "path",    "smoothed", "localized",
                                                         "result",    "other"};
/// The best informed first.
constexpr std::array kMainRoles = {TrackRole::result,    TrackRole::smoothed,  TrackRole::online,
                                   TrackRole::localized, TrackRole::corrected, TrackRole::odometry,
                                   TrackRole::nominal,   TrackRole::other};

Trajectory read_reference(const std::filesystem::path& path) {
  CsvColumns columns(path, {"time_s", "x_m", "y_m"}, {}, {"heading_rad"});
  ReferenceStream stream{.time_s = columns.numbers("time_s"),
                         .x_m = columns.numbers("x_m"),
                         .y_m = columns.numbers("y_m"),
                         .heading_rad = columns.numbers("heading_rad")};
  stream.heading_rad.resize(stream.time_s.size(), std::nan(""));
  return positions_of(stream);
}

void lay_on(Trajectory& trajectory, const Pose2& motion) {
  for (StampedPose& stamped : trajectory.poses) stamped.pose = motion * stamped.pose;
  const Matrix3 turn = world_from_body_axes(motion);
  for (Matrix3& covariance : trajectory.covariances) covariance = turn * covariance * turn.transpose();
}

void compare_by(ResultTrack& track, const ComparedWith& with, Alignment alignment) {
  const Trajectory seen = with.robot ? of_reference_sensor(track.trajectory, *with.robot) : track.trajectory;
  const EvaluateOptions options{.alignment = alignment, .reference_noise = with.noise};
  track.evaluation = evaluate(seen, with.reference, options);
  track.errors = errors_along(seen, with.reference, options);
  track.laid_by = track.evaluation->reference_from_estimate;
  lay_on(track.trajectory, track.laid_by);
}

}  // namespace

std::string_view name_of(TrackRole role) {
  return kRoleNames[static_cast<std::size_t>(role)];
}

TrackRole role_of(std::string_view name) {
  const auto found = std::ranges::find(kRoles, name, &NamedRole::name);
  return found == kRoles.end() ? TrackRole::other : found->role;
}

ResultTrack read_track(const std::filesystem::path& path, const std::string& name) {
  ResultTrack track{.name = name, .role = role_of(name)};
  if (track.role == TrackRole::reference) {
    track.trajectory = read_reference(path);
    return track;
  }
  const Trajectory whole = read_trajectory(path);
  ThinnedTrajectory kept(kMostPosesKept, whole.has_covariance());
  for (std::size_t i = 0; i < whole.poses.size(); ++i)
    kept.add(whole.poses[i], whole.has_covariance() ? whole.covariances[i] : Matrix3::Zero());
  track.left_out = kept.left_out();
  track.trajectory = kept.take();
  return track;
}

void compare(ResultTrack& track, const ComparedWith& with, Alignment alignment) {
  try {
    compare_by(track, with, alignment);
  } catch (const CannotAnswer& first) {
    if (alignment != Alignment::start) {
      track.not_compared = first.what();
      return;
    }
    compare(track, with, Alignment::se2);
  }
}

const ResultTrack* track_of_role(const std::vector<ResultTrack>& tracks, TrackRole role) {
  const auto found = std::ranges::find(tracks, role, &ResultTrack::role);
  return found == tracks.end() ? nullptr : &*found;
}

const ResultTrack* main_track(const std::vector<ResultTrack>& tracks) {
  for (const TrackRole role : kMainRoles)
    if (const ResultTrack* track = track_of_role(tracks, role)) return track;
  return nullptr;
}

}  // namespace trundle::report
