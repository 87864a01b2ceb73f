#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/report/calibration_parts.hpp"
#include "trundle/report/intervals.hpp"
#include "trundle/report/or_null.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// As a person reads it: millimetres, degrees.
std::string in_words(double value, const std::string& unit) {
  if (unit == "m") return fmt::format("{:.2g} mm", 1000.0 * value);
  if (unit == "rad") return fmt::format("{:.2g}°", degrees(value));
  if (unit == "rad/s") return fmt::format("{:.2g}°/s", degrees(value));
  return unit == "1" ? fmt::format("{:.2g}", value) : fmt::format("{:.2g} {}", value, unit);
}

std::string reason_held(const ParameterEstimate& estimate) {
  const std::string prior = in_words(estimate.sigma_prior, estimate.unit);
  if (!std::isfinite(estimate.sigma_data) || estimate.sigma_data <= 0.0)
    return fmt::format("Held at nominal: these runs say nothing about it (it may plausibly be ±{} off).",
                       prior);
  return fmt::format(
      "Held at nominal: from these runs alone it would be known to ±{} (1σ), "
      "and it may plausibly be only ±{} off.",
      in_words(estimate.sigma_data, estimate.unit), prior);
}

/// (value − nominal) / total sigma; nothing for a held parameter or without a sigma.
std::optional<double> sigmas_from_nominal(const ParameterEstimate& estimate) {
  const double sigma = estimate.sigma_total;
  if (!estimate.observable || !(sigma > 0.0)) return {};
  return (estimate.value - estimate.nominal) / sigma;
}

Json parameter_json(const ParameterEstimate& estimate, int sessions) {
  Json parameter = {{"name", estimate.name},
                    {"unit", estimate.unit},
                    {"nominal", estimate.nominal},
                    {"value", estimate.value},
                    {"observable", estimate.observable}};
  parameter["sigma_within"] = estimate.observable ? Json(estimate.sigma_within) : Json(nullptr);
  parameter["sigma_between"] = estimate.observable ? or_null(estimate.sigma_between) : Json(nullptr);
  parameter["sigma_total"] = estimate.observable ? Json(estimate.sigma_total) : Json(nullptr);
  parameter["interval95_within"] = or_null(interval95_within(estimate));
  parameter["interval95_between"] = or_null(interval95_between(estimate, sessions));
  parameter["sigmas_from_nominal"] = or_null(sigmas_from_nominal(estimate));
  parameter["sigma_data"] = estimate.sigma_data;
  parameter["sigma_prior"] = estimate.sigma_prior;
  parameter["reason_held"] = estimate.observable ? Json(nullptr) : Json(reason_held(estimate));
  return parameter;
}

Json rows_of_matrix(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(Json::array());
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) rows.back().push_back(matrix(i, j));
  }
  return rows;
}

/// Zero where a parameter has no variance of its own.
Eigen::MatrixXd correlation_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(sigma.size(), sigma.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i)
    for (Eigen::Index j = 0; j < sigma.size(); ++j)
      if (i != j && sigma(i) > 0.0 && sigma(j) > 0.0)
        correlation(i, j) = std::clamp(covariance(i, j) / (sigma(i) * sigma(j)), -1.0, 1.0);
  return correlation;
}

/// The components of a direction that matter, largest first, signed so that the largest is positive.
using Component = std::pair<std::string, double>;
std::vector<Component> leading_components(const ObservableDirection& direction,
                                          std::span<const ParameterEstimate> parameters) {
  std::vector<Component> components;
  const std::size_t count = std::min(direction.direction.size(), parameters.size());
  for (std::size_t i = 0; i < count; ++i) components.emplace_back(parameters[i].name, direction.direction[i]);
  std::ranges::stable_sort(
      components, [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
  if (components.empty()) return components;
  const double largest = components.front().second;
  constexpr double kMatters =
      0.25;  // of the largest: others have less than a sixteenth of its share in the direction
  std::erase_if(components,
                [&](const Component& c) { return !(std::abs(c.second) >= kMatters * std::abs(largest)); });
  if (largest < 0.0)
    for (Component& component : components) component.second = -component.second;
  return components;
}

std::string enumerated(std::span<const std::string> names) {
  if (names.empty()) return {};
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) text += (i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

/// "left.diameter and right.diameter together against track".
std::string direction_in_words(std::span<const Component> components) {
  std::vector<std::string> with;
  std::vector<std::string> against;
  for (const auto& [name, weight] : components) (weight >= 0.0 ? with : against).push_back(name);
  std::string text = enumerated(with);
  if (with.size() > 1) text += " together";
  if (!against.empty()) text += " against " + enumerated(against);
  return text;
}

Json direction_json(const ObservableDirection& direction, std::span<const ParameterEstimate> parameters) {
  const std::vector<Component> components = leading_components(direction, parameters);
  const bool positive = direction.singular_value > 0.0;
  Json parts = Json::array();
  for (const auto& [name, weight] : components) parts.push_back({{"name", name}, {"weight", weight}});
  return {{"words", direction_in_words(components)},
          {"singular_value", direction.singular_value},
          {"log10_singular_value", positive ? Json(std::log10(direction.singular_value)) : Json(nullptr)},
          {"told", direction.singular_value >= 1.0},
          {"parts", std::move(parts)},
          {"direction", direction.direction}};
}

}  // namespace

Json parameters_json(const CalibrationResult& result) {
  Json parameters = Json::array();
  for (const ParameterEstimate& estimate : result.parameters)
    parameters.push_back(parameter_json(estimate, result.sessions));
  return parameters;
}

Json correlation_json(const CalibrationResult& result) {
  Json names = Json::array();
  for (const ParameterEstimate& estimate : result.parameters)
    if (estimate.observable) names.push_back(estimate.name);
  return {{"names", std::move(names)},
          {"within", rows_of_matrix(correlation_of(result.covariance_within))},
          {"total", rows_of_matrix(correlation_of(result.covariance_total))},
          {"covariance_within", rows_of_matrix(result.covariance_within)},
          {"covariance_total", rows_of_matrix(result.covariance_total)}};
}

Json influence_json(const CalibrationResult& result) {
  if (result.after_run.empty()) return nullptr;
  Json parameters = Json::array();
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    if (!result.parameters[j].observable) continue;
    const auto of = [&](const std::vector<Eigen::VectorXd>& runs) {
      Json values = Json::array();
      for (const Eigen::VectorXd& run : runs) values.push_back(run[static_cast<Eigen::Index>(j)]);
      return values;
    };
    parameters.push_back({{"name", result.parameters[j].name},
                          {"without", of(result.without_run)},
                          {"after", of(result.after_run)},
                          {"sigma_after", of(result.sigma_after_run)}});
  }
  return {{"parameters", std::move(parameters)}};
}

Json directions_json(const CalibrationResult& result) {
  Json directions = Json::array();
  for (const ObservableDirection& direction : result.directions)
    directions.push_back(direction_json(direction, result.parameters));
  return directions;
}

}  // namespace trundle::report
