#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Json ellipse_of(const std::optional<Matrix2>& covariance, double turn_rad) {
  if (!covariance) return nullptr;
  const Matrix2 turn = rotation(turn_rad);
  return ellipse_json(turn * *covariance * turn.transpose());
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

std::vector<double> numbers_of(const std::vector<std::optional<Decision>>& decisions) {
  std::vector<double> numbers;
  for (const auto& decision : decisions)
    numbers.push_back(decision ? static_cast<double>(*decision) : kUnknown);
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

Json map_json(const std::vector<LandmarkRow>& map, const Pose2& laid_by) {
  Json landmarks = Json::array();
  for (const LandmarkRow& landmark : map) {
    const Vector2 place = laid_by * landmark.position;
    landmarks.push_back({{"name", landmark.name},
                         {"x_m", place.x()},
                         {"y_m", place.y()},
                         {"ellipse95", ellipse_of(landmark.covariance, laid_by.heading)},
                         {"sightings", landmark.sightings ? Json(*landmark.sightings) : Json(nullptr)}});
  }
  return {{"landmarks", std::move(landmarks)}};
}

Json particles_json(const ParticleColumns& particles, const Pose2& laid_by) {
  // Dots: more would cover one another, and each makes the page's file larger.
  constexpr std::size_t kMostDrawn = 2000;
  std::vector<double> x, y, weight;
  const std::size_t count = particles.weight.size();
  const std::size_t stride = count / kMostDrawn + 1;
  for (std::size_t i = 0; i < count; i += stride) {
    const Vector2 place = laid_by * Vector2(particles.x_m[i], particles.y_m[i]);
    x.push_back(place.x());
    y.push_back(place.y());
    weight.push_back(particles.weight[i]);
  }
  return {{"particles", count},
          {"drawn", x.size()},
          {"x_m", column_json(x)},
          {"y_m", column_json(y)},
          {"weight", column_json(weight)}};
}

Json filter_json(const FilterColumns& filter, std::size_t most) {
  const std::array<std::span<const double>, 2> pictured = {filter.effective_particles, filter.resampled};
  const std::vector<std::size_t> rows = rows_for_picture(pictured, most);
  return {{"steps", filter.time_s.size()},
          {"drawn", rows.size()},
          {"resampled_steps", std::ranges::count_if(filter.resampled, [](double r) { return r != 0.0; })},
          {"time_s", column_json(filter.time_s, rows)},
          {"effective_particles", column_json(filter.effective_particles, rows)},
          {"greatest_weight",
           filter.greatest_weight ? column_json(*filter.greatest_weight, rows) : Json(nullptr)},
          {"resampled", column_json(filter.resampled, rows)}};
}

Json sightings_json(const SightingColumns& sightings, std::size_t most) {
  const auto [landmark, names] = numbered(sightings.landmark);
  const std::vector<double> decision = numbers_of(sightings.decision);
  const std::array<std::span<const double>, 2> pictured = {sightings.nis, decision};
  const std::vector<std::size_t> rows = rows_for_picture(pictured, most);
  Json decisions = Json::array(), counts = Json::object();
  for (int k = 0; k < kDecisions; ++k) {
    const std::string name(name_of(static_cast<Decision>(k)));
    decisions.push_back(name);
    counts[name] = std::ranges::count(decision, static_cast<double>(k));
  }
  constexpr double kDof = 2.0;  // range and bearing
  const double mean = mean_of(sightings.nis);
  return {{"sightings", sightings.time_s.size()},
          {"drawn", rows.size()},
          {"decisions", decisions},
          {"counts", counts},
          {"landmarks", names},
          {"time_s", column_json(sightings.time_s, rows)},
          {"landmark", column_json(landmark, rows)},
          {"decision", column_json(decision, rows)},
          {"nis", column_json(sightings.nis, rows)},
          {"nis_mean", std::isnan(mean) ? Json(nullptr) : Json(mean)},
          {"nis_expected", kDof},
          {"nis_bounds95", {chi_squared_limit(0.975, kDof), chi_squared_limit(0.025, kDof)}}};
}

}  // namespace trundle::report
