#include "trundle/report/odometry_result.hpp"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kOdometryRules = {
    JsonRule{"rest_s", kNumber | kNull | kMissing},
    JsonRule{"rests", kArray | kMissing},
    JsonRule{"rests/*", kArray | kMissing},
    JsonRule{"rests/*/*", kNumber | kMissing},
};
constexpr std::array kBiasRules = {
    JsonRule{"gyro_bias_over_time", kObject | kMissing},
    JsonRule{"gyro_bias_over_time/time_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/time_s/*", kNumber | kMissing},
    JsonRule{"gyro_bias_over_time/rad_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/rad_s/*", kNumber | kMissing},
    JsonRule{"gyro_bias_over_time/sigma_rad_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/sigma_rad_s/*", kNumber | kMissing},
};

}  // namespace

Json to_json(const BiasOverTime& bias) {
  return {{"time_s", bias.time_s}, {"rad_s", bias.rad_s}, {"sigma_rad_s", bias.sigma_rad_s}};
}

std::optional<BiasOverTime> bias_from_json(const Json& document, std::string_view file_name) {
  constexpr std::array kColumns = {"time_s", "rad_s", "sigma_rad_s"};
  if (!document.contains("gyro_bias_over_time")) return std::nullopt;
  check_rules(document, kBiasRules, file_name);
  expect_same_lengths(document, "gyro_bias_over_time", kColumns, file_name);
  const Json& columns = document.at("gyro_bias_over_time");
  return BiasOverTime{columns.at("time_s"), columns.at("rad_s"), columns.at("sigma_rad_s")};
}

OdometryResult odometry_from_json(std::string_view text, std::string_view file_name) {
  const Json document = parse_result(text, "odometry", kOdometryRules, file_name);
  OdometryResult odometry{.bias = bias_from_json(document, file_name)};
  for (const Json& rest : document.value("rests", Json::array())) {
    if (rest.size() != 2)
      throw InputError(file_name,
                       fmt::format("\"rests[{}]\" has {} numbers", odometry.rests.size(), rest.size()), "2");
    odometry.rests.emplace_back(rest[0], rest[1]);
  }
  if (const Json rest_s = document.value("rest_s", Json()); rest_s.is_number())
    odometry.rest_s = rest_s.get<double>();
  return odometry;
}

}  // namespace trundle::report
