#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/logs/detail/layouts.hpp"

namespace trundle::recording {
namespace {

using Json = nlohmann::json;

constexpr const char* kExpected = R"({"T": seconds, "phi_l": rad/s, "phi_r": rad/s, "sm": [m, m, rad]})";

struct Tuple {
  double duration_s = 0.0;
  double left_rad_s = 0.0;
  double right_rad_s = 0.0;
  Pose2 motion;
};

Tuple tuple_of(const Json& json, const std::string& where) {
  const auto number = [&](const Json& value, const std::string& name) {
    if (!value.is_number())
      throw InputError(where, fmt::format("{} is missing or not a number", name), kExpected);
    return value.get<double>();
  };
  const auto member = [&](const char* key) { return number(json.value(key, Json()), key); };
  const Json sm = json.value("sm", Json());
  if (!sm.is_array() || sm.size() != 3) throw InputError(where, "sm does not have three numbers", kExpected);
  const Tuple tuple{member("T"),
                    member("phi_l"),
                    member("phi_r"),
                    {number(sm[0], "sm[0]"), number(sm[1], "sm[1]"), number(sm[2], "sm[2]")}};
  if (!(tuple.duration_s > 0.0))
    throw InputError(where, fmt::format("T is {}", tuple.duration_s), "a duration above 0 s");
  return tuple;
}

}  // namespace

void read_tuples(const std::filesystem::path& file, Recording& recording) {
  const std::string text = read_file(file);
  note_input(file, text, recording);
  WheelStream& wheels = recording.wheels;
  wheels.time_s = {0.0};
  wheels.series = {{"left", WheelUnit::rate, {kNotMeasured}}, {"right", WheelUnit::rate, {kNotMeasured}}};
  wheels.origin.file = file.string();
  std::size_t line = 1;
  std::size_t counted = 0;
  for (std::size_t begin = 0; (begin = text.find_first_not_of(" \t\r\n", begin)) != std::string::npos;) {
    line += static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(counted),
                                                text.begin() + static_cast<std::ptrdiff_t>(begin), '\n'));
    counted = begin;
    const std::string where = place(file.string(), line);
    const std::size_t end = text.find('}', begin);
    if (end == std::string::npos) throw InputError(where, "an object is not closed", kExpected);
    const Json json = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                  text.begin() + static_cast<std::ptrdiff_t>(end) + 1, nullptr, false);
    if (!json.is_object()) throw InputError(where, "is no JSON object", kExpected);
    const Tuple tuple = tuple_of(json, where);
    const double start_s = wheels.time_s.back();
    wheels.time_s.push_back(start_s + tuple.duration_s);
    wheels.series[0].value.push_back(tuple.left_rad_s);
    wheels.series[1].value.push_back(tuple.right_rad_s);
    recording.relative_motions.push_back({start_s, wheels.time_s.back(), tuple.motion});
    begin = end + 1;
  }
  if (recording.relative_motions.empty()) throw InputError(file.string(), "is empty", kExpected);
}

}  // namespace trundle::recording
