#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

Json bias_json(const Json& odometry) {
  if (!odometry.is_object() || !odometry.contains("gyro_bias_over_time")) return nullptr;
  const Json& history = odometry.at("gyro_bias_over_time");
  const auto time = history.at("time_s").get<std::vector<double>>();
  const auto bias = history.at("rad_s").get<std::vector<double>>();
  const auto sigma = history.at("sigma_rad_s").get<std::vector<double>>();
  return {{"time_s", column_json(time)},
          {"rad_s", column_json(bias)},
          {"sigma_rad_s", column_json(sigma)},
          {"rests", odometry.value("rests", Json::array())},
          {"rest_s", odometry.value("rest_s", Json(nullptr))},
          {"end_rad_s", bias.empty() ? Json(nullptr) : Json(bias.back())},
          {"end_sigma_rad_s", sigma.empty() ? Json(nullptr) : Json(sigma.back())}};
}

}  // namespace

Json gyro_json(const Json& odometry, const Json& info) {
  const Json bias = bias_json(odometry);
  const Json noise = info.is_object() ? info.value("gyro_noise", Json(nullptr)) : Json(nullptr);
  if (bias.is_null() && noise.is_null()) return nullptr;
  return {{"bias", bias}, {"noise", noise}};
}

}  // namespace trundle
