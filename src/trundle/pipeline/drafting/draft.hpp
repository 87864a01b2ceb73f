#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trundle/chassis/chassis.hpp"
#include "trundle/logs/survey.hpp"
#include "trundle/recording/logs/detail/transforms.hpp"

namespace trundle::pipeline {

/// Where a column of a stream comes from.
struct DraftColumn {
  std::string column;      ///< of the stream: "left_rad"
  std::string topic = {};  ///< where it is not the stream's
  std::string field;       ///< of a message, or a column of a CSV file
  std::string unit = {};   ///< as recording.toml takes it; empty: that of the column
  double scale = 1.0;
};

/// A table of recording.toml.
struct DraftStream {
  std::string table;       ///< "wheels"
  std::string file;        ///< as recording.toml names it
  std::string topic = {};  ///< empty: a CSV file, or each column has its own
  std::vector<DraftColumn> columns = {};
  std::string time_unit = {};  ///< of CSV files: "ns"; empty: seconds
  std::string format = {};     ///< of CSV files: its lines in recording.toml; empty: the usual one
  std::optional<double> rebuilt_separation_m =
      {};                       ///< wheels from poses, and the distance they are computed with
  std::string reason = {};      ///< why it was taken, for whoever reads the draft
  std::string body_frame = {};  ///< of a gyro whose mounting on it the log's transforms say
};

/// A wheel of robot.toml; what is not known is written as a comment, and named among what to fill in.
struct DraftWheel {
  std::string name;
  std::optional<double> x_m = {}, y_m = {};  ///< in the body frame: x forward, y to the left
  chassis::WheelKind kind = chassis::WheelKind::fixed;
  bool is_steered = false;
  std::optional<double> diameter_m = {};
  std::optional<double> recorded_diameter_m = {};  ///< with which the log made metres of turns
  bool needs_ticks = false;                        ///< the log has counts
};

/// Where a landmark sensor stands and points.
struct DraftMount {
  double x_m = 0.0, y_m = 0.0, heading_deg = 0.0;
};

/// What a gyro reads at rest.
struct DraftGyro {
  double bias_rad_s = 0.0;
  double noise_rad_s_sqrt_hz = 0.0;
  double noise_sigma = 0.0;
  double rest_s = 0.0;  ///< how long it was seen at rest
};

/// The two files, and what a person has to do with them.
struct Draft {
  std::string robot_name;
  std::vector<DraftWheel> wheels;
  bool has_gyro = false;
  std::optional<DraftGyro> gyro = {};  ///< nothing: its rests do not show it
  bool has_landmark_sensor = false;
  std::optional<DraftMount> landmark_sensor = {};  ///< nothing: the log does not say
  std::vector<DraftStream> streams;
  std::vector<DraftStream> alternatives;  ///< what might be a stream as well: comments
  std::vector<std::string> to_fill_in;    ///< one line each; empty: no edit is needed
  std::vector<std::string> notes;         ///< what was taken for granted
  std::vector<std::string> sources;       ///< of geometry: "robot.urdf: wheel radius 0.033 m of left_wheel"
};

[[nodiscard]] std::string robot_toml(const Draft& draft);
[[nodiscard]] std::string recording_toml(const Draft& draft);

/// Where a wheel is, as other files say it.
struct WheelGeometry {
  std::string joint;
  std::optional<double> x_m = {}, y_m = {}, radius_m = {};
};
/// What a URDF or the parameters of a controller say of a robot.
struct RobotGeometry {
  std::string robot_name = {};
  std::vector<WheelGeometry> wheels = {};            ///< by joint
  std::optional<double> wheel_separation_m = {};     ///< of a controller; negative: left is right
  std::optional<double> separation_multiplier = {};  ///< of what the URDF says, where it names no separation
  std::optional<double> wheel_radius_m = {}, right_wheel_radius_m = {};
  bool is_mecanum = false;
};

/// Joints that turn without end, where they are in the frame of the robot's root and how large their wheels
/// are. Throws InputError where it is no URDF (xacro must be expanded before).
[[nodiscard]] RobotGeometry read_urdf(const std::filesystem::path& path);
/// Parameters of diff_drive_controller or mecanum_drive_controller (ROS 1 and 2). Throws InputError.
[[nodiscard]] RobotGeometry read_controller(const std::filesystem::path& path);

/// Parameters that a log holds by their names (ArduPilot's PARM).
using LogParameters = std::map<std::string, double, std::less<>>;
[[nodiscard]] LogParameters read_parameters(const std::filesystem::path& log);

/// Of a topic's sensor, nothing where the log does not say where it stands.
using MountingOf = std::function<std::optional<recording::Mounting>(const std::string& topic)>;

struct DraftQuestion {
  std::string file;  ///< as recording.toml names it: the log, or what comes before the names of CSV files
  logs::LogSummary summary = {};
  LogParameters parameters = {};
  std::optional<RobotGeometry> urdf = {}, controller = {};
  bool is_csv = false;          ///< the topics are files, the fields their columns
  MountingOf mounting_of = {};  ///< empty: nothing says
};
/// Which topics and fields look like which streams. Never fails: what is not found is named in `to_fill_in`.
[[nodiscard]] Draft draft_of(const DraftQuestion& question);

/// Radius and separation with which a controller computed the odometry of the same log from its wheels'
/// angles, by least squares; nothing where the draft's wheels have no angles, or these do not explain the
/// odometry.
[[nodiscard]] std::optional<RobotGeometry> geometry_from_odometry(const std::filesystem::path& log,
                                                                  const Draft& draft,
                                                                  const std::string& odometry_topic);

/// What the rests of the drafted recording, which is to be in that file, show of its gyro. Nothing where they
/// leave the noise open by more than a tenth, where the resolution of its readings hides it, or where they
/// are differences of angles, which say nothing of a rate's noise.
[[nodiscard]] std::optional<DraftGyro> gyro_at_rest(
    const Draft& draft, const std::filesystem::path& file,
    const std::vector<std::filesystem::path>& message_folders);

/// The CSV files of a folder as if they were topics of a log; `metadata` is what recording.toml has to say of
/// their format. Throws InputError where there is none.
[[nodiscard]] logs::LogSummary survey_tables(const std::filesystem::path& folder);

}  // namespace trundle::pipeline
