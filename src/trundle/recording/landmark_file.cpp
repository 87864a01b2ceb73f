#include "trundle/recording/landmark_file.hpp"

#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace trundle::recording {
namespace {

constexpr std::array kPositionColumns = {"landmark", "x_m", "y_m"};
constexpr std::array kPositionCovarianceColumns = {"var_xx", "var_xy", "var_yy"};

/// Those that must be there, and those of a covariance where the first of them is.
std::vector<CsvColumn> columns_in(const CsvTable& table) {
  std::vector<const char*> names(kPositionColumns.begin(), kPositionColumns.end());
  if (table.column_named(kPositionCovarianceColumns[0]))
    names.insert(names.end(), kPositionCovarianceColumns.begin(), kPositionCovarianceColumns.end());
  std::vector<CsvColumn> columns;
  for (const char* name : names) {
    const auto index = table.column_named(name);
    if (!index)
      throw InputError(place(table.file(), table.header_line()), fmt::format("has no column '{}'", name),
                       "landmark,x_m,y_m and perhaps var_xx,var_xy,var_yy");
    columns.push_back({*index, columns.empty() ? CellKind::text : CellKind::number, {}});
  }
  return columns;
}

bool is_covariance(const Matrix2& m) {
  return m.lpNorm<Eigen::Infinity>() <= kLargestReading * kLargestReading && m(0, 0) >= 0.0 &&
         m(1, 1) >= 0.0 && m(0, 1) * m(0, 1) <= m(0, 0) * m(1, 1) * (1.0 + 1e-9);
}

void require_sound(const MapLandmark& landmark, const std::string& where) {
  if (landmark.name.empty())
    throw InputError(where, "names no landmark", "a name for every landmark of a map");
  if (!(landmark.position.lpNorm<Eigen::Infinity>() <= kLargestReading))
    throw InputError(where, fmt::format("landmark '{}' has no position", landmark.name),
                     "numbers between -1e9 and 1e9 [m]");
  if (!is_covariance(landmark.covariance))
    throw InputError(where, fmt::format("the covariance of landmark '{}' is none", landmark.name),
                     "var_xx, var_yy >= 0 and var_xy² <= var_xx · var_yy");
}

constexpr double kSame = 1e-6;  // of a covariance that was written twice

/// The columns of as many landmarks.
std::vector<CsvColumn> covariance_columns_in(const CsvTable& table, std::size_t landmarks) {
  std::vector<CsvColumn> columns;
  const auto add = [&](const std::string& name, CellKind kind) {
    const auto index = table.column_named(name);
    if (!index)
      throw InputError(
          place(table.file(), table.header_line()), fmt::format("has no column '{}'", name),
          fmt::format("landmark, axis and cov_0 to cov_{}, for {} landmarks", 2 * landmarks - 1, landmarks));
    columns.push_back({*index, kind, {}});
  };
  add("landmark", CellKind::text);
  add("axis", CellKind::text);
  for (std::size_t i = 0; i < 2 * landmarks; ++i) add(fmt::format("cov_{}", i), CellKind::number);
  return columns;
}

void require_of_map(const Eigen::MatrixXd& covariance, const std::vector<MapLandmark>& map,
                    const std::string& file) {
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const Matrix2 own = covariance.block<2, 2>(at, at);
    if (!((own - map[i].covariance).norm() <= kSame * map[i].covariance.norm()))
      throw InputError(file, fmt::format("has another covariance of landmark '{}' than the map", map[i].name),
                       "the file that was written with the map");
  }
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  correlation.diagonal().array() += kSame;
  const bool symmetric = (correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= kSame;
  if (!symmetric || !is_positive_definite(correlation))
    throw InputError(file, "is no covariance", "a symmetric matrix without negative eigenvalues");
}

}  // namespace

std::filesystem::path covariance_file_of(const std::filesystem::path& map) {
  return map.parent_path() / (map.stem().string() + "_covariance.csv");
}

std::string landmark_covariance_csv(const std::vector<std::string>& names,
                                    const Eigen::MatrixXd& covariance) {
  std::string text = "landmark,axis";
  for (Eigen::Index k = 0; k < covariance.cols(); ++k) text += fmt::format(",cov_{}", k);
  text += "\n";
  for (Eigen::Index row = 0; row < covariance.rows(); ++row) {
    text += text_cell(names[static_cast<std::size_t>(row / 2)]) + (row % 2 == 0 ? ",x" : ",y");
    for (Eigen::Index k = 0; k < covariance.cols(); ++k) text += fmt::format(",{}", covariance(row, k));
    text += "\n";
  }
  return text;
}

Eigen::MatrixXd read_landmark_covariance(const std::filesystem::path& path,
                                         const std::vector<MapLandmark>& map) {
  const std::string text = read_file(path);
  const CsvTable table(text, path.string(), {});
  const CsvRows rows = table.read(covariance_columns_in(table, map.size()));
  if (rows.count() != 2 * map.size())
    throw InputError(path.string(), fmt::format("has {} rows", rows.count()),
                     fmt::format("two for each of the map's {} landmarks", map.size()));
  const auto size = static_cast<Eigen::Index>(rows.count());
  Eigen::MatrixXd covariance(size, size);
  for (std::size_t row = 0; row < rows.count(); ++row) {
    const std::string& name = map[row / 2].name;
    const char* axis = row % 2 == 0 ? "x" : "y";
    if (rows.texts[0][row] != name || rows.texts[1][row] != axis)
      throw InputError(place(table.file(), rows.lines.line_of(row)),
                       fmt::format("is of {} of landmark '{}'", rows.texts[1][row], rows.texts[0][row]),
                       fmt::format("{} of '{}', in the order of the map", axis, name));
    for (Eigen::Index k = 0; k < size; ++k)
      covariance(static_cast<Eigen::Index>(row), k) = rows.numbers[static_cast<std::size_t>(k) + 2][row];
  }
  require_of_map(covariance, map, path.string());
  return covariance;
}

std::string text_cell(const std::string& name) {
  if (!name.starts_with('#') && name.find_first_of("\",") == std::string::npos) return name;
  std::string cell = "\"";
  for (const char c : name) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + '"';
}

std::vector<MapLandmark> read_landmark_map(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  const bool of_mrclam = path.filename() == "Landmark_Groundtruth.dat";  // subject, x, y and their sigmas
  const CsvTable table(text, path.string(),
                       of_mrclam ? CsvFormat{.delimiter = ' ', .header = false} : CsvFormat{});
  const CsvRows rows =
      table.read(of_mrclam ? std::vector<CsvColumn>{{0, CellKind::text}, {1}, {2}} : columns_in(table));
  std::vector<MapLandmark> map;
  std::set<std::string> names;
  for (std::size_t row = 0; row < rows.count(); ++row) {
    const auto number = [&](std::size_t column) { return rows.numbers[column][row]; };
    MapLandmark landmark{rows.texts[0][row], {number(1), number(2)}};
    if (rows.numbers.size() > 3) landmark.covariance << number(3), number(4), number(4), number(5);
    const std::string where = place(table.file(), rows.lines.line_of(row));
    require_sound(landmark, where);
    if (!names.insert(landmark.name).second)
      throw InputError(where, fmt::format("landmark '{}' is there twice", landmark.name),
                       "one row for each landmark");
    map.push_back(std::move(landmark));
  }
  if (map.empty()) throw InputError(path.string(), "holds no landmark", "a row for each landmark");
  return map;
}

}  // namespace trundle::recording
