#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// Where the robot was; null where the track does not say.
Json place_json(const ResultTrack* track, double time_s) {
  if (track == nullptr) return nullptr;
  const auto pose = pose_at(track->trajectory, time_s, std::numeric_limits<double>::infinity());
  return pose ? Json{{"x_m", pose->x}, {"y_m", pose->y}} : Json(nullptr);
}

Json event_json(const SlipRow& event, const ResultTrack* track) {
  Json json = to_json(event);
  json["start"] = place_json(track, event.start_s);
  json["end"] = place_json(track, event.end_s);
  return json;
}

Json timeline_json(const SlipTimeline& timeline, std::size_t most) {
  const std::vector<double> slipping(timeline.slipping.begin(), timeline.slipping.end());
  const std::array<std::span<const double>, 2> pictured = {timeline.value, slipping};
  const std::vector<std::size_t> rows = rows_for_picture(pictured, most);
  return {{"intervals", timeline.value.size()},
          {"drawn", rows.size()},
          {"statistic", timeline.statistic},
          {"lower", or_null(timeline.lower)},
          {"upper", or_null(timeline.upper ? timeline.upper : timeline.limit)},
          {"end_s", column_json(timeline.end_s, rows)},
          {"value", column_json(timeline.value, rows)},
          {"slipping", column_json(slipping, rows)}};
}

}  // namespace

Json slip_json(const SlipResult& slip, const ResultTrack* track, std::size_t rows) {
  Json events = Json::array();
  for (const SlipRow& event : slip.events) events.push_back(event_json(event, track));
  return {{"events", std::move(events)},
          {"counts", slip.counts},
          {"timeline", slip.timeline ? timeline_json(*slip.timeline, rows) : Json(nullptr)},
          {"learned", slip.learned},
          {"cannot_see", slip.cannot_see}};
}

}  // namespace trundle::report
