#include "trundle/report/result_documents.hpp"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kRunRules = {
    JsonRule{"stages", kArray},
    JsonRule{"stages/*", kObject},
    JsonRule{"stages/*/name", kString},
    JsonRule{"stages/*/status", kString},
    JsonRule{"stages/*/message", kString},
    JsonRule{"trajectories", kArray | kMissing},
    JsonRule{"trajectories/*/name", kString | kMissing},
    JsonRule{"trajectories/*/file", kString | kMissing},
    JsonRule{"recording", kObject | kMissing},
    JsonRule{"recording/name", kString},
    JsonRule{"robot", kObject | kMissing},
    JsonRule{"robot/used", kString | kMissing},
};
constexpr std::array kInfoRules = {
    JsonRule{"name", kString},
    JsonRule{"streams", kArray},
    JsonRule{"streams/*", kObject},
    JsonRule{"streams/*/stream", kString},
    JsonRule{"streams/*/rows", kNumber},
    JsonRule{"streams/*/start_s", kNumber | kNull},
    JsonRule{"streams/*/end_s", kNumber | kNull},
    JsonRule{"streams/*/rate_hz", kNumber | kNull | kMissing},
    JsonRule{"streams/*/gaps", kNumber | kMissing},
    JsonRule{"streams/*/longest_step_s", kNumber | kNull | kMissing},
    JsonRule{"problems", kArray},
    JsonRule{"problems/*", kObject},
    JsonRule{"problems/*/severity", kString},
    JsonRule{"problems/*/kind", kString},
    JsonRule{"problems/*/place", kString},
    JsonRule{"problems/*/count", kNumber},
    JsonRule{"problems/*/message", kString},
    JsonRule{"missing", kArray},
    JsonRule{"missing/*", kString},
    JsonRule{"gyro_noise", kObject | kMissing},
    JsonRule{"gyro_noise/noise_rad_s_sqrt_hz", kNumber | kNull | kMissing},
    JsonRule{"gyro_noise/allan", kArray | kMissing},
    JsonRule{"gyro_noise/allan/*/tau_s", kNumber | kMissing},
    JsonRule{"gyro_noise/allan/*/deviation_rad_s", kNumber | kNull | kMissing},
};
constexpr std::array kOdometryRules = {
    JsonRule{"gyro_bias_over_time", kObject | kMissing},
    JsonRule{"gyro_bias_over_time/time_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/time_s/*", kNumber | kMissing},
    JsonRule{"gyro_bias_over_time/rad_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/rad_s/*", kNumber | kMissing},
    JsonRule{"gyro_bias_over_time/sigma_rad_s", kArray | kMissing},
    JsonRule{"gyro_bias_over_time/sigma_rad_s/*", kNumber | kMissing},
    JsonRule{"rests", kArray | kMissing},
    JsonRule{"rests/*", kArray | kMissing},
    JsonRule{"rests/*/*", kNumber | kMissing},
};
constexpr std::array kSlipRules = {
    JsonRule{"events", kArray},
    JsonRule{"events/*", kObject},
    JsonRule{"events/*/start_s", kNumber},
    JsonRule{"events/*/end_s", kNumber},
    JsonRule{"events/*/wheel", kString},
    JsonRule{"events/*/kind", kString},
    JsonRule{"events/*/excess_m", kNumber | kNull},
    JsonRule{"events/*/confidence", kNumber | kNull},
    JsonRule{"events/*/excess_sigma_m", kNumber | kNull | kMissing},
    JsonRule{"intervals", kObject},
    JsonRule{"options", kObject | kMissing},
    JsonRule{"options/method", kString | kMissing},
    JsonRule{"timeline", kObject | kMissing},
    JsonRule{"timeline/statistic", kString | kMissing},
    JsonRule{"timeline/limit", kNumber | kMissing},
    JsonRule{"timeline/lower", kNumber | kMissing},
    JsonRule{"timeline/upper", kNumber | kMissing},
    JsonRule{"timeline/end_s", kArray | kMissing},
    JsonRule{"timeline/end_s/*", kNumber | kMissing},
    JsonRule{"timeline/value", kArray | kMissing},
    JsonRule{"timeline/value/*", kNumber | kNull | kMissing},
    JsonRule{"timeline/slipping", kArray | kMissing},
    JsonRule{"timeline/slipping/*", kBool | kMissing},
    JsonRule{"cannot_see", kArray | kMissing},
    JsonRule{"cannot_see/*", kString | kMissing},
    JsonRule{"learned", kObject | kNull},
    JsonRule{"learned/normality", kObject},
    JsonRule{"learned/normality/normal", kBool},
    JsonRule{"learned/histogram", kArray},
    JsonRule{"learned/histogram/*/centre", kNumber | kNull},
    JsonRule{"learned/histogram/*/count", kNumber},
    JsonRule{"learned/quantiles", kArray},
    JsonRule{"learned/quantiles/*", kArray},
};
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
};
constexpr std::array kEvaluationRules = {
    JsonRule{"alignment", kObject | kMissing},
    JsonRule{"alignment/kind", kString | kMissing},
    JsonRule{"reference_noise", kObject | kNull | kMissing},
    JsonRule{"reference_noise/position_sigma_m", kNumber},
    JsonRule{"reference_noise/heading_sigma_rad", kNumber},
};

std::span<const JsonRule> rules_of(std::string_view name) {
  if (name == "run") return kRunRules;
  if (name == "info") return kInfoRules;
  if (name == "odometry") return kOdometryRules;
  if (name == "slip") return kSlipRules;
  if (name == "slam" || name == "slam/slam") return kSlamRules;
  return kEvaluationRules;
}

/// The named arrays of an object are columns of one table.
void expect_same_lengths(const Json& document, const char* name, std::span<const char* const> columns,
                         std::string_view file_name) {
  if (!document.contains(name)) return;
  const Json& table = document.at(name);
  for (const char* column : columns) {
    const std::size_t expected = table.value(columns.front(), Json::array()).size();
    const std::size_t found = table.value(column, Json::array()).size();
    if (!table.contains(column) || found != expected)
      throw InputError(file_name, fmt::format("\"{}.{}\" has {} entries", name, column, found),
                       fmt::format("{}, as \"{}\" has", expected, columns.front()));
  }
}

}  // namespace

Json parse_result_document(std::string_view text, std::string_view name, std::string_view file_name) {
  Json document = parse_json(text, file_name, fmt::format("{}.json as trundle writes it", name));
  if (!document.is_object()) throw InputError(file_name, "is JSON but not an object", "{...}");
  check_rules(document, rules_of(name), file_name);
  constexpr std::array kBias = {"time_s", "rad_s", "sigma_rad_s"};
  constexpr std::array kTimeline = {"end_s", "value", "slipping"};
  expect_same_lengths(document, "gyro_bias_over_time", kBias, file_name);
  expect_same_lengths(document, "timeline", kTimeline, file_name);
  return document;
}

}  // namespace trundle
