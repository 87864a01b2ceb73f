#include "shared_output.hpp"

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::app {

std::string line_of(const Finding& problem) {
  return one_line(fmt::format("{}: {}: {}", word_of(problem.severity), problem.place, describe(problem))) +
         "\n";
}

std::string line_of_nis(const std::optional<double>& mean, const std::optional<double>& median) {
  if (!mean || !median)
    return "  innovations squared (NIS): none, no landmark was seen that was there before\n";
  return fmt::format(
      "  innovations squared (NIS): mean {:.2f}, median {:.2f} (expected if consistent: 2.00, 1.39)\n", *mean,
      *median);
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
