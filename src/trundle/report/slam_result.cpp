#include "trundle/report/slam_result.hpp"

#include <algorithm>
#include <array>

#include "trundle/report/csv_columns.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, kDecisions> kDecisionNames = {"matched", "created", "rejected",
                                                                     "invalid"};

constexpr std::array kSlamRules = {
    JsonRule{"options", kObject},
    JsonRule{"options/filter", kString},
    JsonRule{"options/particles", kString | kMissing},
    JsonRule{"seed", kNumber | kNull | kMissing},
    JsonRule{"landmarks", kNumber},
    JsonRule{"sightings", kObject},
    JsonRule{"sightings/matched", kNumber},
    JsonRule{"sightings/rejected", kNumber},
    JsonRule{"nis", kObject},
    JsonRule{"nis/mean", kNumber | kNull},
    JsonRule{"smallest_effective_share", kNumber | kNull | kMissing},
    JsonRule{"robots", kArray | kMissing},
    JsonRule{"robots/*", kObject | kMissing},
    JsonRule{"robots/*/name", kString | kMissing},
};

std::optional<Decision> decision_named(const std::string& name) {
  const auto found = std::ranges::find(kDecisionNames, name);
  if (found == kDecisionNames.end()) return std::nullopt;
  return static_cast<Decision>(found - kDecisionNames.begin());
}

std::optional<Matrix2> covariance_in(const CsvColumns& columns, std::size_t i) {
  if (!columns.has("var_xx") || !columns.has("var_xy") || !columns.has("var_yy")) return std::nullopt;
  Matrix2 covariance;
  covariance << columns.numbers("var_xx")[i], columns.numbers("var_xy")[i], columns.numbers("var_xy")[i],
      columns.numbers("var_yy")[i];
  return covariance;
}

}  // namespace

std::string_view name_of(Decision decision) {
  return kDecisionNames[static_cast<std::size_t>(decision)];
}

SlamSummary slam_from_json(std::string_view text, std::string_view name, std::string_view file_name) {
  SlamSummary slam{.document = parse_result(text, name, kSlamRules, file_name)};
  slam.bias = bias_from_json(slam.document, file_name);
  if (slam.document.contains("robots"))
    for (const Json& robot : slam.document["robots"])
      if (const auto called = robot.find("name"); called != robot.end())
        slam.robots.push_back(called->get<std::string>());
  return slam;
}

std::vector<LandmarkRow> landmarks_from_csv(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"x_m", "y_m"}, {"landmark"}, {"var_xx", "var_xy", "var_yy", "sightings"});
  std::vector<LandmarkRow> landmarks;
  for (std::size_t i = 0; i < columns.count(); ++i) {
    LandmarkRow landmark{.name = columns.texts("landmark")[i],
                         .position = {columns.numbers("x_m")[i], columns.numbers("y_m")[i]},
                         .covariance = covariance_in(columns, i)};
    if (columns.has("sightings")) landmark.sightings = columns.numbers("sightings")[i];
    landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

ParticleColumns particles_from_csv(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"x_m", "y_m", "heading_rad", "weight"});
  return {columns.numbers("x_m"), columns.numbers("y_m"), columns.numbers("weight")};
}

FilterColumns filter_from_csv(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"time_s", "sightings", "effective_particles", "resampled"}, {},
                           {"greatest_weight"});
  FilterColumns filter{.time_s = columns.numbers("time_s"),
                       .effective_particles = columns.numbers("effective_particles"),
                       .resampled = columns.numbers("resampled"),
                       .greatest_weight = {}};
  if (columns.has("greatest_weight")) filter.greatest_weight = columns.numbers("greatest_weight");
  return filter;
}

SightingColumns sightings_from_csv(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"time_s", "nis"}, {"landmark", "decision"});
  SightingColumns sightings{.time_s = columns.numbers("time_s"),
                            .landmark = columns.texts("landmark"),
                            .decision = {},
                            .nis = columns.numbers("nis")};
  for (const std::string& name : columns.texts("decision"))
    sightings.decision.push_back(decision_named(name));
  return sightings;
}

}  // namespace trundle::report
