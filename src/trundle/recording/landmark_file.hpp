#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle::recording {

/// A landmark of a map, and how well it is known.
struct MapLandmark {
  std::string name;
  Vector2 position;
  Matrix2 covariance = Matrix2::Zero();
};

/// Reads landmarks.csv: landmark, x_m, y_m and, where the file has them, var_xx, var_xy, var_yy. Throws
/// InputError when there is no landmark, a name repeats, or a number is missing or no covariance.
[[nodiscard]] std::vector<MapLandmark> read_landmark_map(const std::filesystem::path& path);

/// The file beside a map that has the covariance of all its landmarks: `landmarks_covariance.csv` of
/// `landmarks.csv`.
[[nodiscard]] std::filesystem::path covariance_file_of(const std::filesystem::path& map);
/// It as text: two rows for each landmark, `landmark,axis` (x or y) and the covariance [m²] with x and y of
/// each, in the order of the map.
[[nodiscard]] std::string landmark_covariance_csv(const std::vector<std::string>& names,
                                                  const Eigen::MatrixXd& covariance);
/// Reads it. Throws InputError when its landmarks, or their own covariances, are not those of the map, or it
/// is no covariance.
[[nodiscard]] Eigen::MatrixXd read_landmark_covariance(const std::filesystem::path& path,
                                                       const std::vector<MapLandmark>& map);

/// A name as a cell that reads back as the same: in quotes where it holds a comma or a quote, which is
/// doubled, or would be taken for a comment.
[[nodiscard]] std::string text_cell(const std::string& name);

}  // namespace trundle::recording
