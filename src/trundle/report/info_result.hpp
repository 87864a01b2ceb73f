#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// What the health check found wrong.
struct HealthProblem {
  bool is_warning = true;             ///< else a note
  bool is_of_gyro_clock = false;      ///< which a calibration may have set since
  bool is_of_steering_clock = false;  ///< likewise
  std::string place;
  std::string message;
};

/// info.json.
struct InfoResult {
  nlohmann::ordered_json document;  ///< all of it: the page shows it
  std::vector<HealthProblem> problems;
};

/// Throws InputError with file, what stands there and what was expected.
InfoResult info_from_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
