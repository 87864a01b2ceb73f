#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/csv_columns.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

/// Where the robot was; null where the track does not say.
Json place_json(const ResultTrack* track, double time_s) {
  if (track == nullptr) return nullptr;
  const auto pose = pose_at(track->trajectory, time_s, std::numeric_limits<double>::infinity());
  return pose ? Json{{"x_m", pose->x}, {"y_m", pose->y}} : Json(nullptr);
}

Json with_places(Json events, const ResultTrack* track) {
  for (Json& event : events) {
    event["start"] = place_json(track, event.at("start_s"));
    event["end"] = place_json(track, event.at("end_s"));
  }
  return events;
}

std::vector<double> column_of(const Json& values) {
  std::vector<double> column;
  for (const Json& value : values) {
    if (value.is_boolean())
      column.push_back(value.get<bool>() ? 1.0 : 0.0);
    else
      column.push_back(value.is_number() ? value.get<double>() : std::nan(""));
  }
  return column;
}

Json timeline_json(const Json& document) {
  if (!document.contains("timeline")) return nullptr;
  const Json& timeline = document.at("timeline");
  const std::vector<double> value = column_of(timeline.at("value"));
  const std::vector<double> slipping = column_of(timeline.at("slipping"));
  const std::array<std::span<const double>, 2> pictured = {value, slipping};
  const std::vector<std::size_t> rows = rows_for_picture(pictured);
  return {{"intervals", value.size()},
          {"drawn", rows.size()},
          {"statistic", timeline.at("statistic")},
          {"lower", timeline.value("lower", Json(nullptr))},
          {"upper", timeline.value("upper", timeline.value("limit", Json(nullptr)))},
          {"end_s", column_json(column_of(timeline.at("end_s")), rows)},
          {"value", column_json(value, rows)},
          {"slipping", column_json(slipping, rows)}};
}

}  // namespace

Json slip_json(const Json& document, const ResultTrack* track) {
  return {{"events", with_places(document.at("events"), track)},
          {"counts", document.at("intervals")},
          {"timeline", timeline_json(document)},
          {"learned", document.value("learned", Json(nullptr))},
          {"cannot_see", document.value("cannot_see", Json::array())}};
}

Json slip_json(const std::filesystem::path& csv, const ResultTrack* track) {
  const CsvColumns columns(csv, {"start_s", "end_s", "excess_m", "confidence"}, {"wheel", "kind"},
                           {"excess_sigma_m"});
  Json events = Json::array();
  for (std::size_t i = 0; i < columns.count(); ++i) {
    Json event = {{"start_s", columns.numbers("start_s")[i]}, {"end_s", columns.numbers("end_s")[i]}};
    event["wheel"] = columns.texts("wheel")[i];
    event["kind"] = columns.texts("kind")[i];
    event["excess_m"] = columns.numbers("excess_m")[i];
    event["confidence"] = columns.numbers("confidence")[i];
    if (columns.has("excess_sigma_m")) event["excess_sigma_m"] = columns.numbers("excess_sigma_m")[i];
    events.push_back(std::move(event));
  }
  return {{"events", with_places(std::move(events), track)},
          {"counts", nullptr},
          {"timeline", nullptr},
          {"learned", nullptr},
          {"cannot_see", Json::array()}};
}

}  // namespace trundle
