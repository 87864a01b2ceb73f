#include "trundle/simulation/detail/sensor_options.hpp"

#include <algorithm>

namespace trundle::simulation::scenario_file {
namespace {

constexpr std::uint64_t kLandmarkStream = 1;  // of the plan's seed: below those of sessions and runs
constexpr Range kBox{[](double v) { return v > 0.0 && v <= 1e5; }, "metres above 0, at most 100000"};

struct Field {
  int count = 0;
  double box_x_m = 6.0;
  double box_y_m = 6.0;
  double spacing_m = 0.5;
};

constexpr std::array kField{
    NumberKey<Field>{"box_x_m", [](Field& f) -> double& { return f.box_x_m; }, kBox},
    NumberKey<Field>{"box_y_m", [](Field& f) -> double& { return f.box_y_m; }, kBox},
    NumberKey<Field>{"spacing_m", [](Field& f) -> double& { return f.spacing_m; }, kNotNegative},
};

void read_encoders(const Section& outer, EncoderOptions& encoders) {
  read_options(outer, "encoders", {"unit", "quantised", "wrapped"}, kEncoders, encoders,
               [&](const Section& s) {
                 static const std::vector<std::string> units = {"ticks", "metres", "rate"};
                 constexpr WheelUnit values[] = {WheelUnit::ticks, WheelUnit::metres, WheelUnit::rate};
                 if (s.table.contains("unit")) encoders.unit = values[read_word(s, "unit", units)];
                 read_flag(s, "quantised", encoders.quantised);
                 read_flag(s, "wrapped", encoders.wrapped);
               });
}

void read_steered(const Section& outer, const Robot& robot, SteeredOptions& steered) {
  read_options(outer, "steered_wheels", {"unit"}, kSteered, steered, [&](const Section& s) {
    static const std::vector<std::string> units = {"radians", "ticks"};
    if (!s.table.contains("unit")) return;
    steered.unit = read_word(s, "unit", units) == 0 ? WheelUnit::radians : WheelUnit::ticks;
    const auto counts = [](const Wheel& w) { return !w.steering || w.steering->ticks_per_revolution != 0.0; };
    if (steered.unit == WheelUnit::ticks && !std::ranges::all_of(robot.chassis.all_wheels(), counts))
      fail(s.source, s.table.get("unit")->source(), in(s, "ticks of a steering without"),
           "steering_ticks_per_revolution in the robot file");
  });
}

void read_sightings(const Section& outer, SightingOptions& sightings) {
  read_options(outer, "sightings", {"hide_names", "give_map"}, kSightings, sightings, [&](const Section& s) {
    read_flag(s, "hide_names", sightings.hide_names);
    read_flag(s, "give_map", sightings.give_map);
  });
}

void read_reference(const Section& outer, ReferenceOptions& reference) {
  read_options(outer, "reference", {"with_heading", "gap"}, kReference, reference, [&](const Section& s) {
    read_flag(s, "with_heading", reference.with_heading);
    const auto gaps = tables(s, "gap", "[[reference.gap]]");
    if (!gaps.empty()) reference.gaps.clear();
    for (const Section& gap : gaps) {
      check_keys(gap, names_with({}, kSpan));
      read_numbers(gap, kSpan, reference.gaps.emplace_back());
    }
  });
}

void read_partial(const Section& outer, PartialReferenceOptions& partial) {
  const std::vector<std::string> flags = {"end_pose", "distance", "turns", "closed"};
  read_options(outer, "partial_reference", flags, kPartial, partial, [&](const Section& s) {
    read_flag(s, "end_pose", partial.end_pose);
    read_flag(s, "distance", partial.distance);
    read_flag(s, "turns", partial.turns);
    read_flag(s, "closed", partial.closed);
  });
}

}  // namespace

void read_flag(const Section& section, std::string_view key, bool& target) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return;
  if (!node->is_boolean())
    fail(section.source, node->source(), in(section, fmt::format("{} is no truth value", key)),
         "true or false");
  target = node->as_boolean()->get();
}

void read_whole(const Section& section, std::string_view key, int lowest, int highest, int& target) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return;
  const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
  if (!value || *value < lowest || *value > highest)
    fail(section.source, node->source(), in(section, fmt::format("{} is out of range", key)),
         fmt::format("a whole number between {} and {}", lowest, highest));
  target = static_cast<int>(*value);
}

std::size_t read_word(const Section& section, std::string_view key, std::span<const std::string> words) {
  const std::string expectation = fmt::format("one of {}", fmt::join(words, ", "));
  const std::string word = text(section, key, expectation);
  const auto found = std::ranges::find(words, word);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  const std::string meant = nearest_name(word, words);
  fail(section.source, section.table.get(key)->source(), in(section, fmt::format("{} is \"{}\"", key, word)),
       meant.empty() ? expectation : fmt::format("\"{}\"", meant));
}

const std::vector<std::string>& sensor_sections() {
  static const std::vector<std::string> names = {"start", "pace",      "encoders",  "steered_wheels",
                                                 "gyro",  "sightings", "reference", "partial_reference"};
  return names;
}

std::vector<Landmark> read_landmarks(const Section& file, std::uint64_t seed) {
  std::vector<Landmark> landmarks;
  if (const auto section = table(file, "landmarks", "[landmarks]")) {
    check_keys(*section, names_with({"count"}, kField));
    Field field;
    read_whole(*section, "count", 0, 100000, field.count);
    read_numbers(*section, kField, field);
    Random random(seed, kLandmarkStream);
    landmarks = random_landmarks(field.count, field.box_x_m, field.box_y_m, field.spacing_m, random);
  }
  static const std::vector<std::string> known = {"name", "x_m", "y_m"};
  for (const Section& section : tables(file, "landmark", "[[landmark]]")) {
    check_keys(section, known);
    const auto coordinate = [&](std::string_view key) {
      return number(section.source, key, required(section, key, "metres"), kAny);
    };
    landmarks.push_back({text(section, "name", "a string"), {coordinate("x_m"), coordinate("y_m")}});
  }
  return landmarks;
}

void read_sensors(const Section& outer, Scenario& scenario, Pace& pace) {
  const auto nothing_else = [](const Section&) {};
  read_options(outer, "start", {}, kStart, scenario, nothing_else);
  read_options(outer, "pace", {}, kPace, pace, nothing_else);
  read_encoders(outer, scenario.encoders);
  read_steered(outer, scenario.truth, scenario.steered);
  read_options(outer, "gyro", {}, kGyroReadings, scenario.gyro, nothing_else);
  read_sightings(outer, scenario.sightings);
  read_reference(outer, scenario.reference);
  read_partial(outer, scenario.partial);
}

}  // namespace trundle::simulation::scenario_file
