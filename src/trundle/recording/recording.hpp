#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/finding.hpp"
#include "trundle/recording/line_map.hpp"
#include "trundle/recording/reference_noise.hpp"

namespace trundle::recording {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// In order of precedence where a file gives several for one wheel.
enum class WheelUnit {
  ticks,    ///< cumulative counts, possibly wrapped
  radians,  ///< cumulative angle
  metres,   ///< cumulative travel
  rate,     ///< [rad/s], the mean over (t_{k−1}, t_k]
};

/// Where a stream was read: nothing for streams made in memory.
struct StreamOrigin {
  std::string file;
  LineMap lines;
  double time_offset_s = 0.0;  ///< that recording.toml had added to the stamps

  /// "file:line" of a row, the file alone or "row n" where that is all that is known.
  [[nodiscard]] std::string place_of(std::size_t row) const;
};

/// One wheel's column in wheels.csv; NaN where the cell was empty.
struct WheelSeries {
  std::string wheel;
  WheelUnit unit = WheelUnit::ticks;
  std::vector<double> value;
};

struct WheelStream {
  std::vector<double> time_s;
  std::vector<WheelSeries> series;
  std::vector<WheelSeries> steering = {};  ///< angles of steered wheels, in ticks or radians
  StreamOrigin origin = {};
};

struct GyroStream {
  std::vector<double> time_s;
  std::vector<double> yaw_rate_rad_s;  ///< the mean over (t_{k−1}, t_k], NaN where the cell was empty
  StreamOrigin origin = {};
};

/// commands.csv and velocity.csv. Velocities are the mean over (t_{k−1}, t_k].
struct VelocityStream {
  std::vector<double> time_s;
  std::vector<double> forward_m_s;
  std::vector<double> yaw_rate_rad_s;
  StreamOrigin origin = {};
};

struct AccelStream {
  std::vector<double> time_s;
  std::vector<double> x_m_s2;
  std::vector<double> y_m_s2;
};

struct Sighting {
  double time_s = 0.0;
  std::string landmark;  ///< empty: unknown
  double range_m = 0.0;
  double bearing_rad = 0.0;
};

struct Landmark {
  std::string name;
  Vector2 position;
};

/// reference.csv: NaN where not measured; the heading continuous within each stretch without a gap.
struct ReferenceStream {
  std::vector<double> time_s;
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> heading_rad;
  StreamOrigin origin = {};

  [[nodiscard]] bool has_positions() const;  ///< any
  [[nodiscard]] bool has_headings() const;   ///< any
};

/// Displacements of the reference sensor in its own frame over intervals, as scan matching gives them.
struct RelativeMotion {
  double start_s = 0.0;
  double end_s = 0.0;
  Pose2 motion;
};

/// A measured number and its 1σ.
struct Measured {
  double value = 0.0;
  double sigma = 0.0;
};

/// What was measured of a run as a whole, of the reference sensor: the [reference] table of recording.toml.
/// 'Start' and 'end' are the first and the last instant of the recording's increments.
struct PartialReference {
  std::optional<Measured> closed;  ///< ends where it started: value 0, sigma of x and of y each [m]
  std::optional<Measured>
      closed_heading;                  ///< and heads as it started, full turns aside: value 0, sigma [rad]
  std::optional<Measured> distance_m;  ///< straight line from start to end, not the length of the path
  std::optional<Measured> turns;    ///< net turning, full turns, counter-clockwise positive; sigma in turns
  std::optional<Measured> end_x_m;  ///< end position in the frame of the start pose
  std::optional<Measured> end_y_m;
  std::optional<Measured> end_heading_rad;  ///< of the end in the frame of the start, full turns aside

  [[nodiscard]] bool empty() const;
};

/// Sigmas that a [reference] table takes where it names none.
inline constexpr double kDefaultPositionSigma = 0.005;                ///< [m], by tape measure
inline constexpr double kDefaultHeadingSigma = 0.017453292519943295;  ///< [rad], one degree

/// Everything one folder holds. Streams that are absent are empty.
struct Recording {
  std::string name;                ///< of the folder
  std::string session;             ///< recordings of one session share it; default: the parent folder
  std::int64_t time_origin_s = 0;  ///< the second of the files' clock that is 0 of all stamps here
  WheelStream wheels;
  GyroStream gyro;
  VelocityStream velocity;
  VelocityStream commands;
  AccelStream accel;
  std::vector<Sighting> sightings;
  std::string seen_as = {};  ///< what other robots' sightings of this one name; empty: not said
  std::vector<Sighting> robot_sightings =
      {};  ///< of other robots' markers, which are no landmarks: they move
  ReferenceStream reference;
  std::vector<RelativeMotion> relative_motions;
  PartialReference partial;
  ReferenceSigmas reference_noise = {};  ///< of the trajectory, as its owner states it
  std::vector<Landmark> landmarks;
  std::vector<Finding> findings;
  std::vector<InputFile> inputs;

  [[nodiscard]] bool has_reference() const;
};

struct ReadOptions {
  int robot_number = 0;  ///< UTIAS MRCLAM folders hold several robots; 0: not given
  std::string map = {};  ///< a recording.toml that says what is in a log; empty: the one in or beside it
  std::vector<std::string> msg_path = {};  ///< folders with .msg files, for logs that hold no definitions

  bool operator==(const ReadOptions&) const = default;
};

/// Reads a recording folder: native CSV files, recording.toml, or a known layout (UTIAS MRCLAM); or a log
/// (ROS bags, MCAP, ...) by a recording.toml, whose tables then take their topics from it, whatever log they
/// name. Throws InputError with file, line, fact and expectation.
Recording read_recording(const std::filesystem::path& folder, const ReadOptions& options = {});

/// What the text of a recording.toml maps, were it in that file. Throws as read_recording() does.
Recording read_mapped_by(std::string_view text, const std::filesystem::path& file,
                         const std::vector<std::filesystem::path>& message_folders = {});

/// Numbers of the robots that a UTIAS MRCLAM folder holds, in order; none where it is no such folder.
[[nodiscard]] std::vector<int> mrclam_robots(const std::filesystem::path& folder);

/// The recording.toml in a log's folder, or beside the log; nothing: there is none.
[[nodiscard]] std::optional<std::filesystem::path> map_beside_log(const std::filesystem::path& log);

/// The recordings below a folder: the folder itself if it is one, else those of its sub-folders in name
/// order. Throws InputError where there is none, and says what is there instead.
[[nodiscard]] std::vector<std::filesystem::path> recordings_below(const std::filesystem::path& folder);

/// Writes the native files of a recording into a folder, all or none: read_recording gives the same streams,
/// and whatever else recording.toml said of them.
void write_recording(const Recording& recording, const std::filesystem::path& folder);

}  // namespace trundle::recording
