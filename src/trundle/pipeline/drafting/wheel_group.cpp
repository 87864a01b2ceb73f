#include "trundle/pipeline/drafting/detail/wheel_group.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

namespace trundle::pipeline {
namespace {

using Words = std::vector<std::string>;

/// What was wanted, or is no motion.
bool is_no_measurement(const Words& words) {
  return has_word(words, {"setpoint",   "setpoints", "desired", "target",       "goal",    "reference",
                          "command",    "commanded", "cmd",     "applied",      "voltage", "volts",
                          "current",    "amps",      "temp",    "effort",       "error",   "temperature",
                          "percentage", "percent",   "torque",  "joystick",     "stick",   "axis",
                          "covariance", "camera",    "vision",  "acceleration", "accel",   "power",
                          "kp",         "ki",        "kd",      "optimized",    "stddev",  "header",
                          "qual",       "quality",   "per"}) ||
         (has_word(words, {"motor"}) && has_word(words, {"speed"}) && has_word(words, {"differential"}));
}

bool is_steering(const Words& words) {
  return has_word(words, {"steer", "steering", "angle", "azimuth", "turn", "caster", "swivel"});
}

/// "meters", "deg", "rpm": in the name, or as the format names it.
std::string unit_in(const Words& words, const std::string& unit, WheelQuantity quantity) {
  const auto is = [&](std::initializer_list<std::string_view> any) {
    return has_word(words, any) || std::ranges::find(any, unit) != any.end();
  };
  switch (quantity) {
    case WheelQuantity::angle:
    case WheelQuantity::steering:
      if (is({"deg", "degs", "degree", "degrees"})) return "deg";
      if (is({"rot", "rots", "rotation", "rotations", "rev", "revs", "revolution", "revolutions"}))
        return "rev";
      return {};
    case WheelQuantity::travel: {
      Words all = words;
      all.push_back(unit);
      return length_unit_in(all);
    }
    case WheelQuantity::rate:
      if (is({"rpm"})) return "rpm";
      if (is({"deg", "degs", "degree", "degrees", "dps"})) return "deg/s";
      if (is({"rps", "rot", "rots", "rotations", "rev", "revs"})) return "rev/s";
      return {};
    default:
      return {};
  }
}

/// Nothing: no number of a wheel.
std::optional<WheelQuantity> quantity_of(const Words& words, const std::string& unit) {
  const bool is_rate = has_word(words, {"velocity", "speed", "rate", "vel", "rpm", "rps", "omega", "dps"});
  if (is_steering(words)) return is_rate ? std::nullopt : std::optional(WheelQuantity::steering);
  const bool is_linear =
      has_word(words, {"meters", "metres", "m", "mps", "travel", "distance", "dist"}) || unit == "m";
  // The travel a second of a wheel is no turn of it: its diameter would have to be known.
  if (is_rate) return is_linear ? std::nullopt : std::optional(WheelQuantity::rate);
  if (has_word(words, {"tick", "ticks", "count", "counts", "pulses"})) return WheelQuantity::ticks;
  if (is_linear || has_word(words, {"mm", "cm", "inches", "feet", "odometer"})) return WheelQuantity::travel;
  if (has_word(words, {"position", "rad", "radians", "rotations", "rotation", "deg", "degrees", "rev", "revs",
                       "revolutions", "pos"}))
    return WheelQuantity::angle;
  if (has_word(words, {"encoder", "encoders", "enc"})) return WheelQuantity::ticks;
  return std::nullopt;
}

/// The places of a group tell its wheels apart, and there are several.
bool is_usable(const WheelGroup& group) {
  if (group.wheels.size() < 2 || group.wheels.size() > 8) return false;
  for (std::size_t i = 0; i < group.wheels.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (group.wheels[i].place == group.wheels[j].place) return false;
  return true;
}

int score_of(const WheelGroup& group, const Words& words) {
  // An order, not a measure: what moves before what has the name of a wheel, sides before names, names before
  // units.
  constexpr int kMoves = 100, kWord = 20, kQuantity = 10, kLeftAndRight = 30;  // points
  int score = group.moves ? kMoves : 0;
  score += kQuantity * (static_cast<int>(WheelQuantity::rate) - static_cast<int>(group.quantity));
  for (const std::string_view word :
       {"wheel", "wheels", "drive", "encoder", "ticks", "drivetrain", "odometer"})
    score += has_word(words, {word}) ? kWord : 0;
  const auto has_side = [&](int side) {
    return std::ranges::any_of(group.wheels,
                               [&](const WheelSource& wheel) { return wheel.place.side == side; });
  };
  // What an absolute encoder reads is not yet where the wheel points to.
  if (has_word(words, {"absolute"})) score -= kWord;
  return score + (has_side(1) && has_side(-1) ? kLeftAndRight : 0);
}

std::vector<WheelGroup> all_groups(const logs::LogSummary& summary) {
  struct Named {
    WheelGroup group;
    Words words;
  };
  std::map<std::pair<std::string, WheelQuantity>, Named> groups;
  for (const logs::TopicSummary& topic : summary.topics)
    for (const logs::FieldSummary& field : topic.fields) {
      if (field.is_text || field.values == 0) continue;
      Words words = words_of(topic, field);
      if (is_no_measurement(words)) continue;
      const std::optional<PlacedName> name = placed(words);
      const std::optional<WheelQuantity> quantity = quantity_of(words, field.unit);
      if (!name || !quantity) continue;
      Named& mine = groups[{name->pattern, *quantity}];
      mine.group.quantity = *quantity;
      mine.group.unit = unit_in(words, field.unit, *quantity);
      mine.group.wheels.push_back({name->place, &topic, &field});
      const bool turns = *quantity == WheelQuantity::rate && (field.least != 0.0 || field.most != 0.0);
      mine.group.moves = mine.group.moves || turns || field.changes > 10;
      mine.words = std::move(words);
    }
  std::vector<WheelGroup> usable;
  for (auto& [key, mine] : groups) {
    if (!is_usable(mine.group)) continue;
    mine.group.score = score_of(mine.group, mine.words);
    mine.group.is_of_wheels =
        mine.group.quantity == WheelQuantity::ticks ||
        has_word(mine.words,
                 {"wheel", "wheels", "whl", "drivewhl", "drive", "drivetrain", "encoder", "encoders", "enc",
                  "odometer", "mod", "module", "swerve", "track", "tread", "chassis", "dist", "distance"});
    // "left_rpm" alone is a wheel's; that of a shooter has more of a name.
    if (mine.group.unit == "rpm" && std::ranges::all_of(mine.group.wheels, [](const WheelSource& wheel) {
          return wheel.place.side != 0 && words_of(wheel.field->path).size() == 2;
        }))
      mine.group.is_of_wheels = true;
    usable.push_back(std::move(mine.group));
  }
  std::ranges::stable_sort(usable, std::ranges::greater(), &WheelGroup::score);
  return usable;
}

/// Left before right, front before rear, by their numbers.
void put_in_order(WheelGroup& group) {
  std::ranges::stable_sort(group.wheels, [](const WheelSource& a, const WheelSource& b) {
    const auto key = [](const WheelPlace& place) {
      return std::tuple(place.index.value_or(0), -place.row, -place.side);
    };
    return key(a.place) < key(b.place);
  });
}

}  // namespace

std::vector<WheelGroup> wheel_groups(const logs::LogSummary& summary) {
  std::vector<WheelGroup> groups = all_groups(summary);
  std::erase_if(groups, [](const WheelGroup& group) { return group.quantity == WheelQuantity::steering; });
  for (WheelGroup& group : groups) put_in_order(group);
  return groups;
}

WheelGroup steering_of(const logs::LogSummary& summary, const WheelGroup& wheels) {
  for (WheelGroup& group : all_groups(summary)) {
    if (group.quantity != WheelQuantity::steering || group.wheels.size() != wheels.wheels.size()) continue;
    put_in_order(group);
    const bool same =
        std::ranges::equal(group.wheels, wheels.wheels, {}, &WheelSource::place, &WheelSource::place);
    if (same) return group;
  }
  return {};
}

}  // namespace trundle::pipeline
