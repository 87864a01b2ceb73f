#include "trundle/pipeline/viewers/shown.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/viewers/writers.hpp"
#include "trundle/slip/find_slip.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::array<std::string_view, 2> kViewerFormats = {"mcap", "wpilog"};

}  // namespace

std::optional<ViewerFormat> viewer_format_named(std::string_view name) {
  for (std::size_t i = 0; i < kViewerFormats.size(); ++i)
    if (kViewerFormats[i] == name) return static_cast<ViewerFormat>(i);
  return std::nullopt;
}

std::string_view name_of(ViewerFormat format) {
  return kViewerFormats[static_cast<std::size_t>(format)];
}

std::vector<std::string> viewer_format_names() {
  return {kViewerFormats.begin(), kViewerFormats.end()};
}

ShownTrajectory shown(std::string name, const Trajectory& trajectory) {
  const auto produce = [&trajectory](const TakePose& take) {
    const Matrix3 unknown = Matrix3::Zero();
    for (std::size_t i = 0; i < trajectory.poses.size(); ++i)
      take(trajectory.poses[i], trajectory.has_covariance() ? trajectory.covariances[i] : unknown);
  };
  return {.name = std::move(name), .has_covariance = trajectory.has_covariance(), .produce = produce};
}

std::vector<ShownSlip> shown_slips(const std::vector<SlipEvent>& events, const Robot& robot) {
  std::vector<ShownSlip> slips;
  for (const SlipEvent& event : events) slips.push_back({event, wheel_of(event, robot)});
  return slips;
}

std::int64_t nanoseconds_of(double time_s, const Shown& shown) {
  constexpr double kNanoseconds = 1e9, kLatest_s = 9e9;  // that 64 bits hold
  const double on_clock_s = time_s + static_cast<double>(shown.time_origin_s);
  if (!(on_clock_s >= 0.0 && on_clock_s < kLatest_s))
    throw CannotAnswer(
        fmt::format("viewers know no time {} s: their clocks begin at 0; time_origin = \"first\" in "
                    "recording.toml makes the first stamp one of the first second",
                    on_clock_s));
  return shown.time_origin_s * 1'000'000'000 + std::llround(time_s * kNanoseconds);
}

OutputFile viewer_file(const std::filesystem::path& path, ViewerFormat format, Shown shown) {
  return {path, "", [format, shown = std::move(shown)](const TakeText& take) {
            format == ViewerFormat::mcap ? write_mcap(shown, take) : write_wpilog(shown, take);
          }};
}

}  // namespace trundle::pipeline
