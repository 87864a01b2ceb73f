#include "trundle/pipeline/drafting/detail/found_wheels.hpp"

#include <algorithm>
#include <array>

namespace trundle::pipeline {
namespace {

std::string_view suffix_of(WheelQuantity quantity) {
  switch (quantity) {
    case WheelQuantity::ticks:
      return "_ticks";
    case WheelQuantity::travel:
      return "_m";
    case WheelQuantity::rate:
      return "_rad_s";
    default:
      return "_rad";
  }
}

/// "left_wheel_joint" of "position[name=left_wheel_joint]".
std::string joint_in(const std::string& path) {
  const std::size_t equals = path.find('=');
  return equals == std::string::npos || !path.ends_with(']')
             ? std::string()
             : path.substr(equals + 1, path.size() - equals - 2);
}

/// Wheels of types that a format itself defines: their numbers mean sides.
struct KnownWheels {
  std::string_view type, left, right;
  WheelQuantity quantity;
};
constexpr std::array kKnownWheels = {
    KnownWheels{"WENC", "Dist0", "Dist1", WheelQuantity::travel},
    KnownWheels{"wheel_encoders", "wheel_angle[1]", "wheel_angle[0]", WheelQuantity::angle}};

}  // namespace

FoundWheels wheels_of(const WheelGroup& group, const WheelGroup& steering) {
  FoundWheels found{.quantity = group.quantity};
  found.moves = group.moves;
  for (std::size_t i = 0; i < group.wheels.size(); ++i) {
    const WheelSource& source = group.wheels[i];
    FoundWheel wheel{.name = wheel_name(source.place),
                     .place = source.place,
                     .joint = joint_in(source.field->path),
                     .column = {}};
    wheel.column = {.column = wheel.name + std::string(suffix_of(group.quantity)),
                    .topic = source.topic->topic,
                    .field = source.field->path,
                    .unit = group.unit};
    if (!steering.wheels.empty())
      wheel.steering = DraftColumn{.column = wheel.name + "_steering_rad",
                                   .topic = steering.wheels[i].topic->topic,
                                   .field = steering.wheels[i].field->path,
                                   .unit = steering.unit};
    found.wheels.push_back(std::move(wheel));
  }
  return found;
}

std::optional<FoundWheels> known_wheels(const logs::LogSummary& summary) {
  for (const logs::TopicSummary& topic : summary.topics)
    for (const KnownWheels& known : kKnownWheels) {
      if (topic.type != known.type || topic.messages == 0) continue;
      FoundWheels found{.quantity = known.quantity};
      for (const auto& [side, path] : {std::pair(1, known.left), std::pair(-1, known.right)}) {
        const auto field = std::ranges::find(topic.fields, path, &logs::FieldSummary::path);
        if (field == topic.fields.end()) continue;
        const WheelPlace place{.side = side};
        const std::string name = wheel_name(place);
        found.moves = found.moves || field->changes > 10;
        found.wheels.push_back({.name = name,
                                .place = place,
                                .joint = {},
                                .column = {.column = name + std::string(suffix_of(known.quantity)),
                                           .topic = topic.topic,
                                           .field = std::string(path)}});
      }
      if (found.wheels.size() == 2) return found;
    }
  return std::nullopt;
}

}  // namespace trundle::pipeline
