#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle::calibration {

/// Sense in which a square was driven.
enum class Turn { cw, ccw };

std::string_view name_of(Turn turn);

/// One run around the square: measured end pose minus the end pose of its odometry. Frame: origin at
/// the start, x along the first leg, the same for both senses.
struct SquareRun {
  Turn turn = Turn::cw;
  Pose2 error;                  ///< [m, m, rad]; heading as measured, not wrapped
  std::optional<double> leg_m;  ///< measured chord of a straight leg
  /// Counted on one straight leg; both or none.
  std::optional<double> left_revolutions;
  std::optional<double> right_revolutions;
  std::string name;  ///< "sheet.csv:7" or the recording's name
};

/// All runs of one square.
struct SquareSheet {
  std::string name;
  double side_m = 0.0;  ///< nominal length of a leg
  std::vector<SquareRun> runs;
};

/// Reads `turn,x_m,y_m,heading_deg[,leg_m][,left_revolutions,right_revolutions]`, one row for each run; lines
/// that start with # are comments, one of which may say `# side_m = 2`. docs/umbmark.md. Throws InputError
/// with file, line, fact and expectation. `side_m`: from the command line; must not contradict the comment,
/// and one of them must be there.
SquareSheet read_sheet(const std::filesystem::path& path, std::optional<double> side_m = std::nullopt);
SquareSheet parse_sheet(std::string_view text, std::string_view file_name,
                        std::optional<double> side_m = std::nullopt);

}  // namespace trundle::calibration
