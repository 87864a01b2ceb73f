#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

/// The columns of what was known of the bias; null where the document has none.
Json bias_json(const Json& document) {
  if (!document.is_object() || !document.contains("gyro_bias_over_time")) return nullptr;
  Json columns;
  for (const auto& [name, values] : document.at("gyro_bias_over_time").items())
    columns[name] = column_json(values.get<std::vector<double>>());
  return columns;
}

Json last_of(const Json& document, const char* column) {
  const Json& values = document.at("gyro_bias_over_time").at(column);
  return values.empty() ? Json(nullptr) : values.back();
}

Json at_rest_json(const Json& odometry) {
  Json bias = bias_json(odometry);
  if (bias.is_null()) return bias;
  bias["rests"] = odometry.value("rests", Json::array());
  bias["rest_s"] = odometry.value("rest_s", Json(nullptr));
  bias["end_rad_s"] = last_of(odometry, "rad_s");
  bias["end_sigma_rad_s"] = last_of(odometry, "sigma_rad_s");
  return bias;
}

}  // namespace

Json gyro_json(const Json& odometry, const Json& slam, const Json& info) {
  const Json bias = at_rest_json(odometry);
  const Json by_filter = bias_json(slam);
  const Json noise = info.is_object() ? info.value("gyro_noise", Json(nullptr)) : Json(nullptr);
  if (bias.is_null() && by_filter.is_null() && noise.is_null()) return nullptr;
  return {{"bias", bias}, {"slam_bias", by_filter}, {"noise", noise}};
}

}  // namespace trundle
