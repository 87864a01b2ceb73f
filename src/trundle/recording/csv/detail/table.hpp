#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/recording/csv/detail/csv_file.hpp"
#include "trundle/recording/csv/reader.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// Where one column of a stream comes from.
struct ColumnSource {
  std::string column;      ///< of the stream, e.g. "left_ticks"
  std::string name = {};   ///< in the file; empty: by number
  std::size_t number = 0;  ///< 1-based
  double scale = 1.0;      ///< unit and sign: stream value = cell · scale
  CellKind kind = CellKind::number;
  bool optional = false;   ///< may be missing: then NaN, or empty text
  std::string place = {};  ///< in recording.toml, for errors; empty: in the file's header
  std::string topic = {};  ///< of a log, where it is another than the stream's; `name` is then a field's path
};

/// Travel of two wheels that is rebuilt from poses, which a controller computed of it.
struct RebuiltWheels {
  double separation_m = 0.0;  ///< that the controller took
  std::string left = "left";
  std::string right = "right";
};

/// A transform of a log between a frame and its parent, or its inverse.
struct TransformStep {
  std::string parent, child;
  bool is_inverse = false;
};

/// How a file is read as a stream.
struct StreamSource {
  std::filesystem::path file;
  CsvFormat format;
  std::optional<ColumnSource> time;  ///< nothing: row k is at k / rate_hz
  double rate_hz = 0.0;
  TimeScale time_scale;
  double time_offset_s = 0.0;
  std::optional<double> start_s;  ///< rows before are left out
  std::optional<double> end_s;    ///< and rows after
  std::string place = {};         ///< of its table in recording.toml; empty: a native file
  bool increments = false;        ///< counts and metres since the row before
  std::string topic = {};         ///< of a log; empty: the file is a table, or each column has its own
  std::optional<RebuiltWheels> rebuilt = {};  ///< the columns are those of a reference: a pose
  std::vector<ColumnSource> columns;
  /// Of a log: poses of the last frame in the first, through these; none: the columns are fields.
  std::vector<TransformStep> transforms = {};
  std::vector<std::string> frames = {};  ///< the pair that recording.toml names
  /// Of an Imu whose mounting is known: the body's vertical in the sensor's axes.
  std::optional<std::array<double, 3>> vertical = {};
  std::string vertical_evidence = {};  ///< what says so: "transform from base_link"
};

/// The rows of a stream; one entry in `numbers` or `texts` for each of the source's columns, in their order.
struct Table {
  StreamOrigin origin;
  std::vector<double> time_s;
  std::vector<std::vector<double>> numbers;
  std::vector<std::vector<std::string>> texts;
};

/// What a stream's rows must be like; other rows are dropped, counted and reported.
struct RowRules {
  bool repeated_stamps =
      false;  ///< several rows may share a stamp (sightings); then rows out of order are sorted
  bool empty_cells = false;  ///< empty cells mean 'not measured' and are no problem (reference)
  bool gaps = true;          ///< gaps between stamps are reported
  double slowest_s = 10.0;   ///< stamps that step farther in the median are not in seconds
};

/// Drops, sorts and sums rows as the source and the rules ask; reports what was found.
void clean(Table& table, const StreamSource& source, const RowRules& rules, std::vector<Finding>& findings);

/// Throws InputError where a number of a column is beyond what can be measured.
void require_plausible(const std::vector<double>& values, const ColumnSource& column,
                       const StreamOrigin& origin);

/// Whether a source is a log's.
bool is_of_log(const StreamSource& source);

/// Cleans the rows of a source as they were read, from whatever file. Appends to `findings`.
Table finish_table(Table rows, const StreamSource& source, const RowRules& rules,
                   std::vector<Finding>& findings);

/// Reads and cleans the source's file: docs/log-faults.md says which rows are dropped. Appends to `findings`.
Table read_table(const StreamSource& source, CsvFile& file, const RowRules& rules,
                 std::vector<Finding>& findings);

/// The first stamp of the file, in seconds, before origin and offset; nothing when there is none.
std::optional<double> first_stamp(const StreamSource& source);

/// The median step between stamps; 0 when there are fewer than two.
double median_step(std::span<const double> time_s);
/// The longest step between stamps that is no gap: max(0.5 s, 5 medians).
double longest_step(std::span<const double> time_s);

}  // namespace trundle::recording
