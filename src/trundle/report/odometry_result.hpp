#pragma once

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// What was known of the gyro's bias, in columns.
struct BiasOverTime {
  std::vector<double> time_s;
  std::vector<double> rad_s;
  std::vector<double> sigma_rad_s;
};

/// What the page draws of odometry.json.
struct OdometryResult {
  std::optional<BiasOverTime> bias = {};
  std::vector<std::pair<double, double>> rests = {};  ///< stretches of standing still [s]
  std::optional<double> rest_s = {};                  ///< their sum
};

nlohmann::ordered_json to_json(const BiasOverTime& bias);
/// Nothing where the document of odometry or SLAM has none. Throws InputError where it is malformed, or its
/// columns are not equally long.
std::optional<BiasOverTime> bias_from_json(const nlohmann::ordered_json& document,
                                           std::string_view file_name);

/// Throws InputError with file, what stands there and what was expected.
OdometryResult odometry_from_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
