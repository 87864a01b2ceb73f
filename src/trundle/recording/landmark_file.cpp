#include "trundle/recording/landmark_file.hpp"

#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv.hpp"

namespace trundle {
namespace {

constexpr double kFarthest_m = 1e9;
constexpr std::array kPositionColumns = {"landmark", "x_m", "y_m"};
constexpr std::array kCovarianceColumns = {"var_xx", "var_xy", "var_yy"};

/// Those that must be there, and those of a covariance where the first of them is.
std::vector<CsvColumn> columns_in(const CsvTable& table) {
  std::vector<const char*> names(kPositionColumns.begin(), kPositionColumns.end());
  if (table.column_named(kCovarianceColumns[0]))
    names.insert(names.end(), kCovarianceColumns.begin(), kCovarianceColumns.end());
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
  return m.lpNorm<Eigen::Infinity>() <= kFarthest_m * kFarthest_m && m(0, 0) >= 0.0 && m(1, 1) >= 0.0 &&
         m(0, 1) * m(0, 1) <= m(0, 0) * m(1, 1) * (1.0 + 1e-9);
}

void require_sound(const MapLandmark& landmark, const std::string& where) {
  if (landmark.name.empty())
    throw InputError(where, "names no landmark", "a name for every landmark of a map");
  if (!(landmark.position.lpNorm<Eigen::Infinity>() <= kFarthest_m))
    throw InputError(where, fmt::format("landmark '{}' has no position", landmark.name),
                     "numbers between -1e9 and 1e9 [m]");
  if (!is_covariance(landmark.covariance))
    throw InputError(where, fmt::format("the covariance of landmark '{}' is none", landmark.name),
                     "var_xx, var_yy >= 0 and var_xy² <= var_xx · var_yy");
}

}  // namespace

std::string text_cell(const std::string& name) {
  if (!name.starts_with('#') && name.find_first_of("\",") == std::string::npos) return name;
  std::string cell = "\"";
  for (const char c : name) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + '"';
}

std::vector<MapLandmark> read_landmark_map(const std::filesystem::path& path) {
  const MappedFile file(path);
  const CsvTable table(file.text(), path.string(), {});
  const CsvRows rows = table.read(columns_in(table));
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

}  // namespace trundle
