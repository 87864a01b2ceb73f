#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// Null where there is none.
Json bias_json(const std::optional<BiasOverTime>& bias) {
  if (!bias) return nullptr;
  return {{"time_s", column_json(bias->time_s)},
          {"rad_s", column_json(bias->rad_s)},
          {"sigma_rad_s", column_json(bias->sigma_rad_s)}};
}

Json last_of(const std::vector<double>& values) {
  return values.empty() ? Json(nullptr) : Json(values.back());
}

Json at_rest_json(const std::optional<OdometryResult>& odometry) {
  if (!odometry || !odometry->bias) return nullptr;
  Json bias = bias_json(odometry->bias);
  bias["rests"] = odometry->rests;
  bias["rest_s"] = or_null(odometry->rest_s);
  bias["end_rad_s"] = last_of(odometry->bias->rad_s);
  bias["end_sigma_rad_s"] = last_of(odometry->bias->sigma_rad_s);
  return bias;
}

}  // namespace

Json gyro_json(const Results& results) {
  const Json bias = at_rest_json(results.odometry);
  const Json by_filter = results.slam ? bias_json(results.slam->bias) : Json(nullptr);
  const Json noise = results.info ? results.info->document.value("gyro_noise", Json(nullptr)) : Json(nullptr);
  if (bias.is_null() && by_filter.is_null() && noise.is_null()) return nullptr;
  return {{"bias", bias}, {"slam_bias", by_filter}, {"noise", noise}};
}

}  // namespace trundle::report
