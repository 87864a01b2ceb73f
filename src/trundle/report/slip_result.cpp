#include "trundle/report/slip_result.hpp"

#include <array>
#include <cmath>

#include "trundle/report/csv_columns.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

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
    JsonRule{"events/*/by_chance", kNumber | kNull | kMissing},
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
    JsonRule{"timeline/status", kArray | kMissing},
    JsonRule{"timeline/status/*", kString | kMissing},
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

std::optional<double> number_in(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

double number_or_nan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::nan("");
}

Json number_or_null(double value) {
  return std::isnan(value) ? Json() : Json(value);
}

Json to_json(const SlipTimeline& timeline) {
  Json json = {{"statistic", timeline.statistic}};
  if (timeline.lower) json["lower"] = *timeline.lower;
  if (timeline.upper) json["upper"] = *timeline.upper;
  if (timeline.limit) json["limit"] = *timeline.limit;
  json["end_s"] = timeline.end_s;
  json["value"] = Json::array();
  for (const double value : timeline.value) json["value"].push_back(number_or_null(value));
  json["status"] = timeline.status;
  json["slipping"] = timeline.slipping;
  return json;
}

SlipRow event_from_json(const Json& json) {
  SlipRow event{.start_s = json.at("start_s"),
                .end_s = json.at("end_s"),
                .wheel = json.at("wheel"),
                .kind = json.at("kind"),
                .excess_m = number_or_nan(json.at("excess_m")),
                .confidence = number_or_nan(json.at("confidence"))};
  if (json.contains("excess_sigma_m")) event.excess_sigma_m = number_or_nan(json.at("excess_sigma_m"));
  if (json.contains("by_chance")) event.by_chance = number_or_nan(json.at("by_chance"));
  return event;
}

SlipTimeline timeline_from_json(const Json& json) {
  SlipTimeline timeline{.statistic = json.value("statistic", ""),
                        .limit = number_in(json, "limit"),
                        .lower = number_in(json, "lower"),
                        .upper = number_in(json, "upper"),
                        .end_s = json.at("end_s"),
                        .status = json.value("status", std::vector<std::string>()),
                        .slipping = json.at("slipping")};
  for (const Json& value : json.at("value")) timeline.value.push_back(number_or_nan(value));
  return timeline;
}

}  // namespace

Json to_json(const SlipRow& event) {
  Json json = {{"start_s", event.start_s},
               {"end_s", event.end_s},
               {"wheel", event.wheel},
               {"kind", event.kind},
               {"excess_m", number_or_null(event.excess_m)},
               {"confidence", number_or_null(event.confidence)}};
  if (event.excess_sigma_m) json["excess_sigma_m"] = number_or_null(*event.excess_sigma_m);
  if (event.by_chance) json["by_chance"] = number_or_null(*event.by_chance);
  return json;
}

Json to_json(const SlipResult& slip) {
  Json json = {{"intervals", slip.counts}, {"events", Json::array()}};
  for (const SlipRow& event : slip.events) json["events"].push_back(to_json(event));
  if (slip.timeline) json["timeline"] = to_json(*slip.timeline);
  json["learned"] = slip.learned;
  json["cannot_see"] = slip.cannot_see;
  return json;
}

SlipResult slip_from_json(std::string_view text, std::string_view file_name) {
  constexpr std::array kTimeline = {"end_s", "value", "slipping"};
  const Json document = parse_result(text, "slip", kSlipRules, file_name);
  expect_same_lengths(document, "timeline", kTimeline, file_name);
  SlipResult slip{.counts = document.at("intervals"),
                  .learned = document.value("learned", Json()),
                  .cannot_see = document.value("cannot_see", std::vector<std::string>())};
  for (const Json& event : document.at("events")) slip.events.push_back(event_from_json(event));
  if (document.contains("timeline")) slip.timeline = timeline_from_json(document.at("timeline"));
  return slip;
}

SlipResult slip_from_csv(const std::filesystem::path& csv) {
  const CsvColumns columns(csv, {"start_s", "end_s", "excess_m", "confidence"}, {"wheel", "kind"},
                           {"excess_sigma_m", "by_chance"});
  SlipResult slip;
  for (std::size_t i = 0; i < columns.count(); ++i) {
    const auto number = [&](const char* name) { return columns.numbers(name)[i]; };
    SlipRow event{.start_s = number("start_s"),
                  .end_s = number("end_s"),
                  .wheel = columns.texts("wheel")[i],
                  .kind = columns.texts("kind")[i],
                  .excess_m = number("excess_m"),
                  .confidence = number("confidence")};
    if (columns.has("excess_sigma_m")) event.excess_sigma_m = number("excess_sigma_m");
    if (columns.has("by_chance")) event.by_chance = number("by_chance");
    slip.events.push_back(std::move(event));
  }
  return slip;
}

}  // namespace trundle::report
