#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/csv_columns.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, 4> kDecisions = {"matched", "created", "rejected", "invalid"};
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Json ellipse_of(const CsvColumns& columns, std::size_t i, double turn_rad) {
  if (!columns.has("var_xx") || !columns.has("var_xy") || !columns.has("var_yy")) return nullptr;
  Matrix2 covariance;
  covariance << columns.numbers("var_xx")[i], columns.numbers("var_xy")[i], columns.numbers("var_xy")[i],
      columns.numbers("var_yy")[i];
  const Matrix2 turn = rotation(turn_rad);
  return ellipse_json(turn * covariance * turn.transpose());
}

/// The same numbers for the same names, in the order of first sight.
std::pair<std::vector<double>, std::vector<std::string>> numbered(const std::vector<std::string>& names) {
  std::map<std::string, std::size_t> places;
  std::vector<double> numbers;
  std::vector<std::string> order;
  for (const std::string& name : names) {
    const auto [found, is_new] = places.try_emplace(name, order.size());
    if (is_new) order.push_back(name);
    numbers.push_back(name.empty() ? kUnknown : static_cast<double>(found->second));
  }
  return {std::move(numbers), std::move(order)};
}

std::vector<double> numbers_of_decisions(const std::vector<std::string>& words) {
  std::vector<double> numbers;
  for (const std::string& word : words) {
    const auto found = std::ranges::find(kDecisions, word);
    numbers.push_back(found == kDecisions.end() ? kUnknown : static_cast<double>(found - kDecisions.begin()));
  }
  return numbers;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value;
    ++count;
  }
  return count == 0 ? kUnknown : sum / static_cast<double>(count);
}

}  // namespace

Json map_json(const std::filesystem::path& csv, const Pose2& laid_by) {
  const CsvColumns columns(csv, {"x_m", "y_m"}, {"landmark"}, {"var_xx", "var_xy", "var_yy", "sightings"});
  Json landmarks = Json::array();
  for (std::size_t i = 0; i < columns.count(); ++i) {
    const Vector2 place = laid_by * Vector2(columns.numbers("x_m")[i], columns.numbers("y_m")[i]);
    landmarks.push_back(
        {{"name", columns.texts("landmark")[i]},
         {"x_m", place.x()},
         {"y_m", place.y()},
         {"ellipse95", ellipse_of(columns, i, laid_by.heading)},
         {"sightings", columns.has("sightings") ? Json(columns.numbers("sightings")[i]) : Json(nullptr)}});
  }
  return {{"landmarks", std::move(landmarks)}};
}

Json particles_json(const std::filesystem::path& csv, const Pose2& laid_by) {
  constexpr std::size_t kMostDrawn = 2000;
  const CsvColumns columns(csv, {"x_m", "y_m", "heading_rad", "weight"});
  std::vector<double> x, y, weight;
  const std::size_t stride = columns.count() / kMostDrawn + 1;
  for (std::size_t i = 0; i < columns.count(); i += stride) {
    const Vector2 place = laid_by * Vector2(columns.numbers("x_m")[i], columns.numbers("y_m")[i]);
    x.push_back(place.x());
    y.push_back(place.y());
    weight.push_back(columns.numbers("weight")[i]);
  }
  return {{"particles", columns.count()},
          {"drawn", x.size()},
          {"x_m", column_json(x)},
          {"y_m", column_json(y)},
          {"weight", column_json(weight)}};
}

Json filter_json(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"time_s", "sightings", "effective_particles", "resampled"}, {},
                           {"greatest_weight"});
  const std::vector<double>& effective = columns.numbers("effective_particles");
  const std::array<std::span<const double>, 2> pictured = {effective, columns.numbers("resampled")};
  const std::vector<std::size_t> rows = rows_for_picture(pictured);
  const auto& resampled = columns.numbers("resampled");
  return {{"steps", columns.count()},
          {"drawn", rows.size()},
          {"resampled_steps", std::ranges::count_if(resampled, [](double r) { return r != 0.0; })},
          {"time_s", column_json(columns.numbers("time_s"), rows)},
          {"effective_particles", column_json(effective, rows)},
          {"greatest_weight", columns.has("greatest_weight")
                                  ? column_json(columns.numbers("greatest_weight"), rows)
                                  : Json(nullptr)},
          {"resampled", column_json(resampled, rows)}};
}

Json sightings_json(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"time_s", "nis"}, {"landmark", "decision"});
  const auto [landmark, names] = numbered(columns.texts("landmark"));
  const std::vector<double> decision = numbers_of_decisions(columns.texts("decision"));
  const std::array<std::span<const double>, 2> pictured = {columns.numbers("nis"), decision};
  const std::vector<std::size_t> rows = rows_for_picture(pictured);
  Json counts = Json::object();
  for (std::size_t k = 0; k < kDecisions.size(); ++k)
    counts[std::string(kDecisions[k])] = std::ranges::count(decision, static_cast<double>(k));
  constexpr double kDof = 2.0;  // range and bearing
  const double mean = mean_of(columns.numbers("nis"));
  return {{"sightings", columns.count()},
          {"drawn", rows.size()},
          {"decisions", kDecisions},
          {"counts", counts},
          {"landmarks", names},
          {"time_s", column_json(columns.numbers("time_s"), rows)},
          {"landmark", column_json(landmark, rows)},
          {"decision", column_json(decision, rows)},
          {"nis", column_json(columns.numbers("nis"), rows)},
          {"nis_mean", std::isnan(mean) ? Json(nullptr) : Json(mean)},
          {"nis_expected", kDof},
          {"nis_bounds95", {chi_squared_limit(0.975, kDof), chi_squared_limit(0.025, kDof)}}};
}

}  // namespace trundle
