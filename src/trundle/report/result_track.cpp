#include "trundle/report/result_track.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/increments.hpp"
#include "trundle/report/csv_columns.hpp"

namespace trundle {
namespace {

struct Role {
  std::string_view name;
  std::string_view role;
};
constexpr std::array kRoles = {
    Role{"reference", "reference"},    Role{"nominal", "nominal"},
    Role{"odometry", "odometry"},      Role{"calibrated", "odometry"},
    Role{"corrected", "corrected"},    Role{"slip_corrected", "corrected"},
    Role{"slam/trajectory", "online"}, Role{"slam/online", "online"},
    Role{"slam/path", "path"},         Role{"path", "path"},
    Role{"slam/smoothed", "smoothed"}, Role{"smoothed", "smoothed"},
    Role{"localization", "localized"}, Role{"localized", "localized"},
    Role{"trajectory", "result"},
};
/// The best informed first.
constexpr std::array<std::string_view, 8> kMainRoles = {"result",    "smoothed", "online",  "localized",
                                                        "corrected", "odometry", "nominal", "other"};

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

std::string role_of(std::string_view name) {
  const auto found = std::ranges::find(kRoles, name, &Role::name);
  return std::string(found == kRoles.end() ? "other" : found->role);
}

ResultTrack read_track(const std::filesystem::path& path, const std::string& name) {
  ResultTrack track{.name = name,
                    .role = role_of(name),
                    .trajectory = {},
                    .laid_by = {},
                    .evaluation = {},
                    .errors = {},
                    .not_compared = {}};
  track.trajectory = track.role == "reference" ? read_reference(path) : read_trajectory(path);
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

const ResultTrack* track_of_role(const std::vector<ResultTrack>& tracks, std::string_view role) {
  const auto found = std::ranges::find(tracks, role, &ResultTrack::role);
  return found == tracks.end() ? nullptr : &*found;
}

const ResultTrack* main_track(const std::vector<ResultTrack>& tracks) {
  for (const std::string_view role : kMainRoles)
    if (const ResultTrack* track = track_of_role(tracks, role)) return track;
  return nullptr;
}

}  // namespace trundle
