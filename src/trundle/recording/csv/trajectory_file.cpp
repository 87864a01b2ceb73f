#include "trundle/recording/trajectory_file.hpp"

#include <array>
#include <cmath>
#include <iterator>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/quaternion.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace trundle::recording {
namespace {

constexpr std::array<const char*, 6> kCovarianceColumns = {"var_xx", "var_xy", "var_xh",
                                                           "var_yy", "var_yh", "var_hh"};

constexpr double kRounding = 1.0 + 1e-6;  // of six digits, as other programs write them

Matrix3 symmetric(double xx, double xy, double xh, double yy, double yh, double hh) {
  Matrix3 matrix;
  matrix << xx, xy, xh, xy, yy, yh, xh, yh, hh;
  return matrix;
}

/// TUM: t x y z qx qy qz qw, no header.
StreamSource tum_source(const std::filesystem::path& path) {
  StreamSource source;
  source.file = path;
  source.format = {' ', '#', false};
  source.time = ColumnSource{.column = "time_s", .number = 1, .place = path.string()};
  std::size_t number = 2;
  for (const char* name : {"x", "y", "z", "qx", "qy", "qz", "qw"})
    source.columns.push_back({.column = name, .number = number++, .place = path.string()});
  return source;
}

Trajectory with_continuous_heading(Trajectory trajectory) {
  for (std::size_t i = 1; i < trajectory.poses.size(); ++i) {
    double& heading = trajectory.poses[i].pose.heading;
    heading -= 2.0 * kPi * std::round((heading - trajectory.poses[i - 1].pose.heading) / (2.0 * kPi));
  }
  return trajectory;
}

Trajectory read_tum(const std::filesystem::path& path) {
  const StreamSource source = tum_source(path);
  CsvFile file(path, source.format);
  std::vector<Finding> findings;
  const Table table = read_table(source, file, {}, findings);
  Trajectory trajectory;
  for (std::size_t row = 0; row < table.time_s.size(); ++row) {
    const auto number = [&](std::size_t column) { return table.numbers[column][row]; };
    const Quaternion q{number(3), number(4), number(5), number(6)};
    if (!std::isfinite(number(0) + number(1) + q.length2())) continue;
    if (std::abs(q.length2() - 1.0) > 0.1)
      throw InputError(table.origin.place_of(row), "has no unit quaternion", "qx qy qz qw of length 1");
    trajectory.poses.push_back({table.time_s[row], {number(0), number(1), yaw_of(q)}});
  }
  return with_continuous_heading(std::move(trajectory));
}

bool has_covariance(std::string_view text, const std::filesystem::path& path) {
  return CsvTable(text, path.string(), {}).column_named(kCovarianceColumns[0]).has_value();
}

/// Throws InputError where it is none.
void require_covariance(const Matrix3& covariance, const std::string& place) {
  if (!covariance.allFinite())
    throw InputError(place, "has no number in one of its var_ columns", "a covariance, or no such columns");
  for (int i = 0; i < 3; ++i) {
    if (covariance(i, i) < 0.0)
      throw InputError(place, fmt::format("has the negative variance {}", covariance(i, i)),
                       "var_xx, var_yy and var_hh not below 0");
    for (int j = 0; j < i; ++j)
      if (std::abs(covariance(i, j)) > kRounding * std::sqrt(covariance(i, i) * covariance(j, j)))
        throw InputError(
            place, fmt::format("has the covariance {}, more than its variances allow", covariance(i, j)),
            "the root of their product at most");
  }
}

Trajectory read_csv(const std::filesystem::path& path) {
  StreamSource source = native_source(StreamKind::reference, path);
  source.columns.resize(kPoseColumns);
  CsvFile file(path, source.format);
  if (has_covariance(file.head(), path))
    for (const char* name : kCovarianceColumns) source.columns.push_back({name, name});
  std::vector<Finding> findings;
  RowRules rules;
  rules.empty_cells = true;
  const Table table = read_table(source, file, rules, findings);
  Trajectory trajectory, positions;
  for (std::size_t row = 0; row < table.time_s.size(); ++row) {
    const auto number = [&](std::size_t column) { return table.numbers[column][row]; };
    const Pose2 pose{number(0), number(1), number(2)};
    if (!std::isfinite(pose.x) || !std::isfinite(pose.y)) continue;
    positions.poses.push_back({table.time_s[row], {pose.x, pose.y, kNotMeasured}});
    if (!std::isfinite(pose.heading)) continue;
    trajectory.poses.push_back({table.time_s[row], pose});
    if (source.columns.size() == kPoseColumns) continue;
    trajectory.covariances.push_back(
        symmetric(number(3), number(4), number(5), number(6), number(7), number(8)));
    require_covariance(trajectory.covariances.back(), table.origin.place_of(row));
  }
  return trajectory.poses.empty() ? positions : with_continuous_heading(std::move(trajectory));
}

void write(const Trajectory& trajectory, TrajectoryFormat format, const TakeText& take) {
  TrajectoryWriter writer(format, trajectory.has_covariance(), take);
  const Matrix3 none = Matrix3::Zero();
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i)
    writer.add(trajectory.poses[i], trajectory.has_covariance() ? trajectory.covariances[i] : none);
  writer.finish();
}

}  // namespace

Trajectory reference_trajectory(const Recording& recording) {
  const ReferenceStream& reference = recording.reference;
  Trajectory trajectory;
  for (std::size_t row = 0; row < reference.time_s.size(); ++row) {
    const Pose2 pose{reference.x_m[row], reference.y_m[row], reference.heading_rad[row]};
    if (std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading))
      trajectory.poses.push_back({reference.time_s[row], pose});
  }
  return trajectory;
}

Trajectory read_trajectory(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw InputError(path.string(), "does not exist",
                     fmt::format("a trajectory; `trundle odometry RECORDING --robot ROBOT -o {}` writes one",
                                 path.filename().string()));
  Trajectory trajectory = path.extension() == ".tum" ? read_tum(path) : read_csv(path);
  if (trajectory.poses.empty())
    throw InputError(path.string(), "holds no pose", "rows of time, x, y and heading");
  return trajectory;
}

Trajectory as_written(const Trajectory& trajectory) {
  Trajectory written;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const auto& [time_s, pose] = trajectory.poses[i];
    const bool is_next = written.poses.empty() || time_s > written.poses.back().time_s;
    if (!is_next || !std::isfinite(pose.x) || !std::isfinite(pose.y) || !std::isfinite(pose.heading))
      continue;
    written.poses.push_back({time_s, pose});
    if (!trajectory.has_covariance()) continue;
    const Matrix3& c = trajectory.covariances[i];
    written.covariances.push_back(symmetric(c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)));
  }
  return with_continuous_heading(std::move(written));
}

TrajectoryWriter::TrajectoryWriter(TrajectoryFormat format, bool with_covariance, const TakeText& take)
    : format_(format), with_covariance_(with_covariance), take_(take) {
  if (format_ == TrajectoryFormat::tum) return;
  text_ = "time_s,x_m,y_m,heading_rad";
  if (with_covariance_)
    for (const char* name : kCovarianceColumns) fmt::format_to(std::back_inserter(text_), ",{}", name);
  end_line();
}

void TrajectoryWriter::add(const StampedPose& stamped, const Matrix3& c) {
  const auto& [time_s, pose] = stamped;
  const auto line = std::back_inserter(text_);
  if (format_ == TrajectoryFormat::tum) {
    fmt::format_to(line, FMT_COMPILE("{} {} {} 0 0 0 {} {}"), time_s, pose.x, pose.y,
                   std::sin(pose.heading / 2.0), std::cos(pose.heading / 2.0));
  } else {
    fmt::format_to(line, FMT_COMPILE("{},{},{},{}"), time_s, pose.x, pose.y, pose.heading);
    if (with_covariance_)
      fmt::format_to(line, FMT_COMPILE(",{},{},{},{},{},{}"), c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2),
                     c(2, 2));
  }
  end_line();
}

void TrajectoryWriter::end_line() {
  constexpr std::size_t kPiece = 1 << 16;  // bytes
  text_.push_back('\n');
  if (text_.size() >= kPiece) finish();
}

void TrajectoryWriter::finish() {
  take_(text_);
  text_.clear();
}

void write_csv(const Trajectory& trajectory, const TakeText& take) {
  write(trajectory, TrajectoryFormat::csv, take);
}

void write_tum(const Trajectory& trajectory, const TakeText& take) {
  write(trajectory, TrajectoryFormat::tum, take);
}

std::string to_csv(const Trajectory& trajectory) {
  std::string text;
  write_csv(trajectory, [&](std::string_view piece) { text += piece; });
  return text;
}

std::string to_tum(const Trajectory& trajectory) {
  std::string text;
  write_tum(trajectory, [&](std::string_view piece) { text += piece; });
  return text;
}

}  // namespace trundle::recording
