#include "start_pose.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace trundle::app {
namespace {

/// Beyond it a double tells no millimetres, and nothing on Earth is there.
constexpr double kFarthest = 1e8;

[[noreturn]] void refuse_start(const std::string& text) {
  throw CLI::ValidationError(
      "--start",
      fmt::format("'{}' is not three numbers X,Y,DEG [m, m, degrees] within ±{:g}", text, kFarthest));
}

}  // namespace

Pose2 start_pose_from(const std::string& text) {
  std::array<double, 3> number{};
  const char* at = text.data();
  const char* end = at + text.size();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, number[i]);
    const bool separated = i == 2 ? next == end : next != end && *next == ',';
    if (error != std::errc{} || !separated || !(std::abs(number[i]) <= kFarthest)) refuse_start(text);
    at = next + 1;
  }
  return {number[0], number[1], radians(number[2])};
}

}  // namespace trundle::app
