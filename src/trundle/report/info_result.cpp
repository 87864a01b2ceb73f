#include "trundle/report/info_result.hpp"

#include <array>

#include "trundle/recording/finding.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

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

}  // namespace

InfoResult info_from_json(std::string_view text, std::string_view file_name) {
  InfoResult info{.document = parse_result(text, "info", kInfoRules, file_name), .problems = {}};
  for (const Json& problem : info.document.at("problems"))
    info.problems.push_back(
        {.is_warning = problem.at("severity") == "warning",
         .is_of_gyro_clock = problem.at("kind") == name_of(FindingCode::time_offset),
         .is_of_steering_clock = problem.at("kind") == name_of(FindingCode::steering_time_offset),
         .place = problem.at("place"),
         .message = problem.at("message")});
  return info;
}

}  // namespace trundle::report
