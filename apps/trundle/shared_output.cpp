#include "shared_output.hpp"

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::app {

std::string line_of(const Finding& problem) {
  return one_line(fmt::format("{}: {}: {}", word_of(problem.severity), problem.place, describe(problem))) +
         "\n";
}

CLI::Option* add_viewer(CLI::App& command, std::string& format) {
  return command
      .add_option(
          "--export", format,
          "Also write trajectories, map and slips for viewers: mcap (Foxglove, PlotJuggler, ros2 bag), "
          "wpilog (AdvantageScope)")
      ->check(CLI::IsMember(viewer_format_names()));
}

}  // namespace trundle::app
