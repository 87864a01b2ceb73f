#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/report/odometry_result.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::report {

/// slam.json.
struct SlamSummary {
  nlohmann::ordered_json document;  ///< all of it: the page shows it
  std::optional<BiasOverTime> bias = {};
  std::vector<std::string> robots = {};  ///< of several together: the path of each is in a folder of its name
};

/// A row of landmarks.csv.
struct LandmarkRow {
  std::string name;
  Vector2 position = Vector2::Zero();
  std::optional<Matrix2> covariance = {};
  std::optional<double> sightings = {};
};

/// particles.csv in columns.
struct ParticleColumns {
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> weight;
};

/// steps.csv in columns.
struct FilterColumns {
  std::vector<double> time_s;
  std::vector<double> effective_particles;
  std::vector<double> resampled;                       ///< 1 where it was
  std::optional<std::vector<double>> greatest_weight;  ///< of one particle
};

/// innovations.csv in columns.
struct SightingColumns {
  std::vector<double> time_s;
  std::vector<std::string> landmark;              ///< empty: which is not known
  std::vector<std::optional<Decision>> decision;  ///< nothing: the file says another word
  std::vector<double> nis;                        ///< NaN: there is none
};

/// "matched"
std::string_view name_of(Decision decision);
inline constexpr int kDecisions = 4;

// From the files; `name` is that of the document without extension. Each throws InputError with file, what
// stands there and what was expected.
SlamSummary slam_from_json(std::string_view text, std::string_view name, std::string_view file_name);
std::vector<LandmarkRow> landmarks_from_csv(const std::filesystem::path& csv);
ParticleColumns particles_from_csv(const std::filesystem::path& csv);
FilterColumns filter_from_csv(const std::filesystem::path& csv);
SightingColumns sightings_from_csv(const std::filesystem::path& csv);

}  // namespace trundle::report
