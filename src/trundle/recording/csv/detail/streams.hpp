#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::recording {

enum class StreamKind {
  wheels,
  gyro,
  commands,
  accel,
  velocity,
  sightings,
  reference,
  relative_motion,
  landmarks
};
inline constexpr std::array kStreamKinds = {
    StreamKind::wheels,   StreamKind::gyro,      StreamKind::commands,  StreamKind::accel,
    StreamKind::velocity, StreamKind::sightings, StreamKind::reference, StreamKind::relative_motion,
    StreamKind::landmarks};

/// The name of a stream's file and of its table in recording.toml.
std::string_view file_name_of(StreamKind kind);
std::string_view table_name_of(StreamKind kind);
/// Its columns besides the stamps, named as in the native file; none for wheels, whose columns are named
/// after the robot's.
std::vector<ColumnSource> columns_of(StreamKind kind);
/// Of a reference the first are x, y and heading; what follows is a quaternion, latitude and longitude. Of
/// sightings they are name, range and bearing; what follows is the place in the sensor's frame.
inline constexpr std::size_t kPoseColumns = 3;
/// Of a gyro whose angle alone was recorded [rad], in place of its rate: a map may name it.
inline constexpr std::string_view kYawAngle = "yaw_rad";
/// "time_s", or "start_s" where rows are intervals.
std::string_view stamp_column_of(StreamKind kind);

/// A column of wheels.csv: "left_ticks" is wheel "left" in ticks, "front_steering_rad" the steering of
/// "front". Nothing for other names.
struct WheelColumn {
  std::string wheel;
  WheelUnit unit = WheelUnit::ticks;
  bool is_steering = false;

  bool operator==(const WheelColumn&) const = default;
};
std::optional<WheelColumn> wheel_column(std::string_view name);
/// Several columns for one wheel: leaves the first in the order of WheelUnit.
void keep_preferred(std::vector<ColumnSource>& columns);
std::string column_name(const WheelSeries& series);
std::string steering_column_name(const WheelSeries& series);

/// The native file of a stream in a folder.
StreamSource native_source(StreamKind kind, const std::filesystem::path& file);

/// Among the inputs, once.
void note_input(const InputFile& input, Recording& recording);
/// By what was read of it.
void note_input(const std::filesystem::path& file, std::string_view text, Recording& recording);
/// Reads one stream into its place in the recording, and notes its file.
void read_stream(StreamKind kind, const StreamSource& source, Recording& recording);
/// The same of rows that were read already, from a log.
void take_stream(StreamKind kind, const StreamSource& source, Table rows, Recording& recording);

/// No stream has a row.
[[nodiscard]] bool is_empty(const Recording& recording);

}  // namespace trundle::recording
