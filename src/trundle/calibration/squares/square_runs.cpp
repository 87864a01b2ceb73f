#include "trundle/calibration/squares/square_runs.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/recording/trajectory_file.hpp"

namespace trundle::calibration {
namespace {

/// The reference is not interpolated across longer ones, as in EvaluateOptions.
constexpr double kLongestReferenceGap_s = 0.5;
constexpr std::size_t kPosesInPicture = 500;  // of one run
/// A leg is where odometry heads along a side of the square within this.
constexpr double kLegHeading = radians(10.0);

/// Odometry and reference of one run, both from their common start and in its frame.
struct SquareTracks {
  Trajectory odometry;
  Trajectory reference;  ///< of the body, at the same stamps; one pose at the end: only that was measured
};

[[noreturn]] void refuse(const Recording& recording, const std::string& why) {
  throw CannotAnswer(recording.name + ": " + why);
}

/// The reference as poses of the body, turns kept, stamps on the robot's clock.
Trajectory body_reference(const Recording& recording, const Robot& robot) {
  Trajectory trajectory = reference_trajectory(recording);
  const Pose2 reference_from_body = robot.body_from_reference.inverse();
  double heading = trajectory.poses.empty() ? 0.0 : trajectory.poses.front().pose.heading;
  for (StampedPose& stamped : trajectory.poses) {
    heading = stamped.pose.heading = unwrap_angle(stamped.pose.heading, heading);
    stamped.pose = stamped.pose * reference_from_body;
    stamped.time_s += robot.reference_time_offset_s;
  }
  return trajectory;
}

void start_at_origin(Trajectory& trajectory) {
  const Pose2 start_from_world = trajectory.poses.front().pose.inverse();
  for (StampedPose& stamped : trajectory.poses) stamped.pose = start_from_world * stamped.pose;
}

SquareTracks common_tracks(const Trajectory& odometry, const Trajectory& reference) {
  SquareTracks tracks;
  for (const StampedPose& estimated : odometry.poses) {
    const auto measured = pose_at(reference, estimated.time_s, kLongestReferenceGap_s);
    if (!measured) continue;
    tracks.odometry.poses.push_back(estimated);
    tracks.reference.poses.push_back({estimated.time_s, *measured});
  }
  return tracks;
}

/// pose_at turns the short way, the track does not: its headings made continuous again.
void keep_turns(Trajectory& trajectory) {
  for (std::size_t i = 1; i < trajectory.poses.size(); ++i)
    trajectory.poses[i].pose.heading =
        unwrap_angle(trajectory.poses[i].pose.heading, trajectory.poses[i - 1].pose.heading);
}

/// The end pose that recording.toml tells of the run as a whole, its turns as odometry has them.
std::optional<Pose2> measured_end(const PartialReference& partial, double odometry_heading) {
  if (partial.end_x_m && partial.end_y_m && partial.end_heading_rad)
    return Pose2{partial.end_x_m->value, partial.end_y_m->value,
                 unwrap_angle(partial.end_heading_rad->value, odometry_heading)};
  if (partial.closed && partial.closed_heading) return Pose2{0.0, 0.0, unwrap_angle(0.0, odometry_heading)};
  return std::nullopt;
}

SquareTracks tracks_of(const Recording& recording, const Robot& robot) {
  SquareTracks tracks;
  tracks.odometry = integrate(recording, robot, {.with_covariance = false}).trajectory;
  if (tracks.odometry.poses.size() < 2) refuse(recording, "holds no motion");
  const Trajectory reference = body_reference(recording, robot);
  if (!reference.poses.empty()) {
    tracks = common_tracks(tracks.odometry, reference);
    if (tracks.odometry.poses.size() < 2) refuse(recording, "odometry and reference have no time in common");
    keep_turns(tracks.reference);
    start_at_origin(tracks.odometry);
    start_at_origin(tracks.reference);
    return tracks;
  }
  const StampedPose end = tracks.odometry.poses.back();
  const auto measured = measured_end(recording.partial, end.pose.heading);
  if (!measured)
    refuse(recording, "no reference: square runs need a trajectory or an end pose with its heading");
  tracks.reference.poses = {{end.time_s, *measured}};
  return tracks;
}

Turn sense_of(const Recording& recording, const SquareTracks& tracks) {
  const double turned = tracks.reference.poses.back().pose.heading;
  if (std::abs(turned) < kPi || std::abs(turned) > 3.0 * kPi)
    refuse(recording,
           fmt::format("turns by {:.0f} degrees in all: that is no run around a square", degrees(turned)));
  return turned > 0.0 ? Turn::ccw : Turn::cw;
}

double distance(const Pose2& a, const Pose2& b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

/// Chord of one leg over the chord that odometry believes in; nothing where that leg was not driven as such.
std::optional<double> leg_ratio(const SquareTracks& tracks, double leg_heading, double side_m) {
  const auto& odometry = tracks.odometry.poses;
  const auto heads_along = [&](const StampedPose& p) {
    return std::abs(p.pose.heading - leg_heading) < kLegHeading;
  };
  const auto first = std::ranges::find_if(odometry, heads_along);
  const auto last = std::find_if(odometry.rbegin(), odometry.rend(), heads_along).base();
  if (last - first < 2) return std::nullopt;
  const auto i = static_cast<std::size_t>(first - odometry.begin());
  const auto j = static_cast<std::size_t>(last - odometry.begin()) - 1;
  const double estimated = distance(odometry[i].pose, odometry[j].pose);
  if (estimated < 0.5 * side_m) return std::nullopt;
  return distance(tracks.reference.poses[i].pose, tracks.reference.poses[j].pose) / estimated;
}

std::optional<double> mean_leg(const SquareTracks& tracks, Turn turn, double side_m) {
  if (tracks.reference.poses.size() < 2) return std::nullopt;
  double sum = 0.0;
  for (int leg = 0; leg < 4; ++leg) {
    const auto ratio = leg_ratio(tracks, (turn == Turn::ccw ? 0.5 : -0.5) * kPi * leg, side_m);
    if (!ratio) return std::nullopt;
    sum += *ratio;
  }
  return side_m * sum / 4.0;
}

SquareRun run_of(const Recording& recording, const SquareTracks& tracks, double side_m) {
  const Pose2 estimated = tracks.odometry.poses.back().pose;
  const Pose2 measured = tracks.reference.poses.back().pose;
  SquareRun run;
  run.turn = sense_of(recording, tracks);
  run.error = {measured.x - estimated.x, measured.y - estimated.y, measured.heading - estimated.heading};
  run.leg_m = mean_leg(tracks, run.turn, side_m);
  run.name = recording.name;
  return run;
}

TrajectoryError error_of(const SquareTracks& tracks) {
  TrajectoryError error;
  const std::size_t offset = tracks.odometry.poses.size() - tracks.reference.poses.size();
  const double count = static_cast<double>(tracks.reference.poses.size());
  for (std::size_t i = 0; i < tracks.reference.poses.size(); ++i) {
    const Pose2& estimated = tracks.odometry.poses[i + offset].pose;
    const Pose2& measured = tracks.reference.poses[i].pose;
    const double off = distance(estimated, measured);
    error.position_rms_m += off * off / count;
    error.position_max_m = std::max(error.position_max_m, off);
    error.heading_rms_rad += std::pow(measured.heading - estimated.heading, 2) / count;
  }
  error.position_rms_m = std::sqrt(error.position_rms_m);
  error.heading_rms_rad = std::sqrt(error.heading_rms_rad);
  const Pose2& end = tracks.reference.poses.back().pose;
  const Pose2& estimated_end = tracks.odometry.poses.back().pose;
  error.end_x_m = end.x - estimated_end.x;
  error.end_y_m = end.y - estimated_end.y;
  error.end_heading_rad = end.heading - estimated_end.heading;
  error.path_m = path_lengths(tracks.odometry).back();
  return error;
}

/// Replaces the predictions for a sheet by what the same counts give.
void reprocess(std::span<const Recording> recordings, double side_m, CalibrationResult& result) {
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const SquareTracks before = tracks_of(recordings[i], result.nominal);
    const SquareTracks after = tracks_of(recordings[i], result.calibrated);
    RunResult& run = result.runs[i];
    run.session = recordings[i].session;
    run.before = error_of(before);
    run.after = error_of(after);
    run.nominal = thinned(before.odometry, kPosesInPicture);
    run.calibrated = thinned(after.odometry, kPosesInPicture);
    if (before.reference.poses.size() > 1) run.reference = thinned(before.reference, kPosesInPicture);
  }
  result.e_max_after_m = e_max(means_of(end_errors_of_square_runs(recordings, result.calibrated, side_m)));
  result.after_meaning = "reprocessed";
}

int sessions_of(std::span<const Recording> recordings) {
  std::set<std::string> sessions;
  for (const Recording& recording : recordings) sessions.insert(recording.session);
  return static_cast<int>(sessions.size());
}

std::string name_of_all(std::span<const Recording> recordings) {
  return recordings.size() == 1 ? recordings.front().name : fmt::format("{} recordings", recordings.size());
}

}  // namespace

SquareSheet end_errors_of_square_runs(std::span<const Recording> recordings, const Robot& robot,
                                      double side_m) {
  if (!(std::isfinite(side_m) && side_m > 0.0))
    throw InputError("--side-m", fmt::format("the side is {}", side_m), "a length above 0 m");
  SquareSheet sheet = {.name = name_of_all(recordings), .side_m = side_m, .runs = {}};
  for (const Recording& recording : recordings)
    sheet.runs.push_back(run_of(recording, tracks_of(recording, robot), side_m));
  return sheet;
}

CalibrationResult umbmark(std::span<const Recording> recordings, const Robot& nominal, double side_m,
                          SquareMethod method) {
  CalibrationResult result = umbmark(end_errors_of_square_runs(recordings, nominal, side_m), nominal, method);
  reprocess(recordings, side_m, result);
  const int sessions = sessions_of(recordings);
  if (sessions > 1)
    result.warnings.push_back(
        fmt::format("runs of {} sessions are taken as one: calibrate keeps the sessions apart", sessions));
  finish_square_result(result);
  return result;
}

}  // namespace trundle::calibration
