#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle {

/// A landmark of a map, and how well it is known.
struct MapLandmark {
  std::string name;
  Vector2 position;
  Matrix2 covariance = Matrix2::Zero();
};

/// Reads landmarks.csv: landmark, x_m, y_m and, where the file has them, var_xx, var_xy, var_yy. Throws
/// InputError when there is no landmark, a name repeats, or a number is missing or no covariance.
std::vector<MapLandmark> read_landmark_map(const std::filesystem::path& path);

/// A name as a cell that reads back as the same: in quotes where it holds a comma or a quote, which is
/// doubled, or would be taken for a comment.
std::string text_cell(const std::string& name);

}  // namespace trundle
