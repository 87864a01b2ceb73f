#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/logs/detail/layouts.hpp"

namespace trundle::recording {
namespace {

namespace fs = std::filesystem;

constexpr int kMostRobots = 5;  ///< subjects up to here are robots

fs::path file_of(const fs::path& folder, int robot, const char* what) {
  return folder / fmt::format("Robot{}_{}.dat", robot, what);
}

}  // namespace

std::vector<int> mrclam_robots(const fs::path& folder) {
  std::vector<int> robots;
  for (int robot = 1; robot <= kMostRobots; ++robot)
    if (fs::exists(file_of(folder, robot, "Odometry"))) robots.push_back(robot);
  return robots;
}

namespace {

/// Columns separated by spaces, without header, '#' comments: time first where there are stamps.
StreamSource source_of(StreamKind kind, const fs::path& file) {
  StreamSource source;
  source.file = file;
  source.place = file.string();
  source.format = {.delimiter = ' ', .comment = '#', .header = false};
  source.time = ColumnSource{.column = "time_s", .number = 1, .place = file.string()};
  source.columns = columns_of(kind);
  if (kind == StreamKind::reference || kind == StreamKind::sightings) source.columns.resize(kPoseColumns);
  std::size_t number = 2;
  for (ColumnSource& column : source.columns) {
    column.number = number++;
    column.name.clear();
    column.place = file.string();
  }
  return source;
}

/// The rows of a file of numbers without stamps.
std::vector<std::vector<double>> numbers_in(const fs::path& path, std::size_t columns, Recording& recording) {
  const std::string text = read_file(path);
  note_input(path, text, recording);
  const CsvTable table(text, path.string(), {.delimiter = ' ', .comment = '#', .header = false});
  if (table.columns() < columns)
    throw InputError(place(path.string(), table.header_line()),
                     fmt::format("has {} columns", table.columns()), fmt::format("{} columns", columns));
  std::vector<CsvColumn> wanted;
  for (std::size_t i = 0; i < columns; ++i) wanted.push_back({i});
  return table.read(wanted).numbers;
}

/// A row's velocity holds until the next row; as the mean since the row before it stands one row later.
void hold_until_next(std::vector<double>& velocity) {
  for (std::size_t row = velocity.size(); row-- > 1;) velocity[row] = velocity[row - 1];
}

void read_landmarks(const fs::path& folder, Recording& recording) {
  const fs::path file = folder / "Landmark_Groundtruth.dat";
  if (!fs::exists(file)) return;
  const auto columns = numbers_in(file, 3, recording);
  for (std::size_t row = 0; row < columns[0].size(); ++row)
    recording.landmarks.push_back({fmt::format("{}", columns[0][row]), {columns[1][row], columns[2][row]}});
}

/// Measurements name barcodes: they become subject numbers.
void read_measurements(const fs::path& folder, const fs::path& file, Recording& recording) {
  const fs::path barcodes = folder / "Barcodes.dat";
  if (!fs::exists(barcodes))
    throw InputError(barcodes.string(), "does not exist", "the barcodes of the subjects");
  read_stream(StreamKind::sightings, source_of(StreamKind::sightings, file), recording);
  const auto columns = numbers_in(barcodes, 2, recording);
  std::map<std::string, double> subject_of;
  for (std::size_t row = 0; row < columns[0].size(); ++row)
    subject_of[fmt::format("{}", columns[1][row])] = columns[0][row];
  std::vector<Sighting> kept;
  std::size_t unknown = 0;
  for (Sighting& sighting : recording.sightings) {
    const auto subject = subject_of.find(sighting.landmark);
    if (subject == subject_of.end()) {
      ++unknown;
    } else if (subject->second <= kMostRobots) {
      sighting.landmark = fmt::format("{}", subject->second);
      recording.robot_sightings.push_back(std::move(sighting));
    } else {
      sighting.landmark = fmt::format("{}", subject->second);
      kept.push_back(std::move(sighting));
    }
  }
  recording.sightings = std::move(kept);
  const auto note = [&](FindingCode code, std::size_t count) {
    if (count > 0) recording.findings.push_back({Severity::note, code, file.string(), count});
  };
  note(FindingCode::sighting_of_a_robot, recording.robot_sightings.size());
  note(FindingCode::unknown_barcode, unknown);
}

}  // namespace

bool is_mrclam(const fs::path& folder) {
  return !mrclam_robots(folder).empty();
}

void read_mrclam(const fs::path& folder, int robot_number, Recording& recording) {
  const std::vector<int> robots = mrclam_robots(folder);
  const int robot = robot_number == 0 && robots.size() == 1 ? robots.front() : robot_number;
  if (std::find(robots.begin(), robots.end(), robot) == robots.end())
    throw InputError(folder.string(),
                     robot_number == 0 ? fmt::format("holds the robots {}", fmt::join(robots, ", "))
                                       : fmt::format("holds no robot {}", robot_number),
                     fmt::format("--robot-number with one of {}", fmt::join(robots, ", ")));
  recording.name += fmt::format("_Robot{}", robot);
  recording.seen_as = fmt::format("{}", robot);
  const auto read = [&](StreamKind kind, const fs::path& file) {
    if (kind == StreamKind::sightings) return read_measurements(folder, file, recording);
    read_stream(kind, source_of(kind, file), recording);
  };
  read(StreamKind::velocity, file_of(folder, robot, "Odometry"));
  hold_until_next(recording.velocity.forward_m_s);
  hold_until_next(recording.velocity.yaw_rate_rad_s);
  if (const fs::path file = file_of(folder, robot, "Measurement"); fs::exists(file))
    read(StreamKind::sightings, file);
  if (const fs::path file = file_of(folder, robot, "Groundtruth"); fs::exists(file))
    read(StreamKind::reference, file);
  read_landmarks(folder, recording);
}

}  // namespace trundle::recording
