#include "trundle/pipeline/live_line.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/reader.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/slip/find_slip.hpp"

namespace trundle::pipeline {
namespace {

using Line = nlohmann::json;  // finds a name among a hundred thousand

constexpr const char* kForm = R"({"time_s": ..., "wheels": {...}, "gyro": ...})";

double finite(const Line& value, std::string_view name, std::string_view place) {
  if (value.is_number() && std::isfinite(value.get<double>())) return value.get<double>();
  throw InputError(place, fmt::format("'{}' is no finite number", name), "a number");
}

/// The same limits as in the files of a recording.
double reading(const Line& value, std::string_view name, bool is_count, std::string_view place) {
  const double largest = is_count ? recording::kLargestCount : recording::kLargestReading;
  const double number = finite(value, name, place);
  if (std::abs(number) <= largest) return number;
  throw InputError(place, fmt::format("'{}' is {}", name, number),
                   is_count ? "a count between -2^64 and 2^64" : "a number between -1e9 and 1e9");
}

/// Of the line, or within what it gives of a sensor.
double time_of(const Line& line, std::string_view place) {
  if (const auto at = line.find("time_s"); at != line.end()) return finite(*at, "time_s", place);
  for (const char* sensor : {"wheels", "gyro"})
    if (const auto at = line.find(sensor); at != line.end() && at->is_object() && at->contains("time_s"))
      return finite(at->at("time_s"), "time_s", place);
  throw InputError(place, "has no 'time_s'", kForm);
}

/// Names of wheels without a unit are of counts, too.
bool is_count(std::string_view name) {
  return !name.ends_with("_m") && !name.ends_with("_rad") && !name.ends_with("_rad_s");
}

std::vector<std::pair<std::string, double>> wheels_in(const Line& line, std::string_view place) {
  std::vector<std::pair<std::string, double>> wheels;
  const auto at = line.find("wheels");
  if (at == line.end()) return wheels;
  if (!at->is_object())
    throw InputError(place, "'wheels' is no object", R"({"left_ticks": ..., "right_ticks": ...})");
  for (const auto& [name, value] : at->items())
    if (name != "time_s") wheels.emplace_back(name, reading(value, name, is_count(name), place));
  return wheels;
}

/// {"gyro": rate} or {"gyro": {"yaw_rate_rad_s": rate}}.
std::optional<double> gyro_in(const Line& line, std::string_view place) {
  const auto at = line.find("gyro");
  if (at == line.end()) return std::nullopt;
  if (!at->is_object()) return reading(*at, "gyro", false, place);
  const auto rate = at->find("yaw_rate_rad_s");
  if (rate == at->end()) throw InputError(place, "'gyro' has no 'yaw_rate_rad_s'", "the rate, in rad/s");
  return reading(*rate, "yaw_rate_rad_s", false, place);
}

/// {"landmark": ..., "range_m": ..., "bearing_rad": ...}; a landmark may be a number, or none.
Sighting sighting_in(const Line& one, std::string_view place) {
  Sighting sighting;
  if (!one.is_object())
    throw InputError(place, "a sighting is no object",
                     R"({"landmark": ..., "range_m": ..., "bearing_rad": ...})");
  for (const auto& [name, to] :
       {std::pair("range_m", &sighting.range_m), std::pair("bearing_rad", &sighting.bearing_rad)}) {
    const auto value = one.find(name);
    if (value == one.end())
      throw InputError(place, fmt::format("a sighting has no '{}'", name), "range and bearing");
    *to = reading(*value, name, false, place);
  }
  const auto landmark = one.find("landmark");
  if (landmark == one.end() || landmark->is_null()) return sighting;
  if (landmark->is_number_integer())
    sighting.landmark = landmark->dump();
  else if (landmark->is_string())
    sighting.landmark = landmark->get<std::string>();
  else
    throw InputError(place, "'landmark' is no name", "a text, a whole number or null");
  return sighting;
}

std::vector<Sighting> sightings_in(const Line& line, std::string_view place) {
  std::vector<Sighting> sightings;
  const auto at = line.find("sightings");
  if (at == line.end()) return sightings;
  if (!at->is_array()) throw InputError(place, "'sightings' is no array", "one object for each sighting");
  for (const Line& one : *at) sightings.push_back(sighting_in(one, place));
  return sightings;
}

bool wants_map(const Line& line, std::string_view place) {
  const auto at = line.find("map");
  if (at == line.end()) return false;
  if (!at->is_boolean()) throw InputError(place, "'map' is neither true nor false", R"("map": true)");
  return at->get<bool>();
}

void print_pose(std::string& text, const Pose2& pose, const Matrix3& P) {
  text += fmt::format(R"("x_m":{},"y_m":{},"heading_rad":{},"var_xx":{},"var_xy":{},"var_xh":{},"var_yy":{},)"
                      R"("var_yh":{},"var_hh":{})",
                      pose.x, pose.y, pose.heading, P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2));
}

std::string quoted_wheel(int wheel, const Robot& robot) {
  return dumped(wheel == kAmbiguous ? "ambiguous" : robot.wheel_names[static_cast<std::size_t>(wheel)]);
}

void print_event(std::string& text, const SlipEvent& event, const Robot& robot) {
  text += fmt::format(
      R"({{"start_s":{},"end_s":{},"wheel":{},"kind":"{}","excess_m":{},"confidence":{},"excess_sigma_m":{}}})",
      event.start_s, event.end_s, quoted_wheel(event.wheel, robot), name_of(event.kind), event.excess_m,
      event.confidence, event.excess_sigma_m);
}

void print_verdict(std::string& text, const SlipVerdict& verdict, const Robot& robot) {
  text += fmt::format(R"(,"status":"{}")", name_of(verdict.status));
  if (verdict.status == SlipStatus::judged)
    text += fmt::format(R"(,"chi2":{},"limit":{})", verdict.chi2, verdict.limit);
  if (verdict.slipping) text += R"(,"wheel":)" + quoted_wheel(verdict.wheel, robot);
  text += R"(,"ended":[)";
  for (std::size_t i = 0; i < verdict.ended_count; ++i) {
    if (i > 0) text += ',';
    print_event(text, verdict.ended[i], robot);
  }
  text += ']';
}

void print_slip(std::string& text, const LiveSlip& slip, const Robot& robot) {
  text += fmt::format(R"(,"slip":{{"slipping":{},"decided":{})", slip.slipping, slip.verdict.has_value());
  if (slip.verdict) print_verdict(text, *slip.verdict, robot);
  text += R"(,"corrected":{)";
  print_pose(text, slip.pose, slip.covariance);
  text += "}}";
}

void print_slam(std::string& text, const LiveSlamPose& slam) {
  text += R"(,"slam":{)";
  print_pose(text, slam.pose, slam.covariance);
  text += fmt::format(R"(,"landmarks":{}}})", slam.landmarks);
}

void print_sighting(std::string& text, const LiveSightingReport& sighting) {
  const ObservationReport& report = sighting.report;
  text += fmt::format(R"({{"landmark":{},"decision":"{}")",
                      sighting.landmark.empty() ? "null" : dumped(sighting.landmark),
                      report::name_of(report.decision));
  if (report.nis > 0.0)
    text += fmt::format(R"(,"range_innovation_m":{},"bearing_innovation_rad":{},"nis":{})",
                        report.innovation.x(), report.innovation.y(), report.nis);
  text += '}';
}

}  // namespace

LiveLine parse_live_line(std::string_view line, std::string_view place) {
  const Line document = Line::parse(line, nullptr, false);
  if (!document.is_object()) throw InputError(place, "is no JSON object", kForm);
  LiveLine result;
  result.time_s = time_of(document, place);
  result.wheels = wheels_in(document, place);
  result.yaw_rate_rad_s = gyro_in(document, place);
  result.sightings = sightings_in(document, place);
  result.wants_map = wants_map(document, place);
  if (result.wheels.empty() && !result.yaw_rate_rad_s && !document.contains("sightings") && !result.wants_map)
    throw InputError(place, "has no reading", kForm);
  return result;
}

std::string line_of(const LiveEstimate& estimate, const Robot& robot) {
  std::string text = fmt::format(R"({{"time_s":{},)", estimate.time_s);
  print_pose(text, estimate.pose, estimate.covariance);
  text += fmt::format(R"(,"at_rest":{})", estimate.at_rest);
  if (estimate.gyro_bias)
    text += fmt::format(R"(,"gyro_bias":{{"rad_s":{},"sigma_rad_s":{}}})", estimate.gyro_bias->rad_s,
                        std::sqrt(estimate.gyro_bias->variance));
  if (estimate.slip)
    print_slip(text, *estimate.slip, robot);
  else
    text += R"(,"slip":null)";
  if (estimate.slam) print_slam(text, *estimate.slam);
  return text + "}";
}

std::string line_of(const LiveSighted& sighted) {
  std::string text = fmt::format(R"({{"time_s":{},"sightings":[)", sighted.time_s);
  for (std::size_t i = 0; i < sighted.sightings.size(); ++i) {
    if (i > 0) text += ',';
    print_sighting(text, sighted.sightings[i]);
  }
  text += ']';
  print_slam(text, sighted.slam);
  return text + "}";
}

std::string line_of(double time_s, const std::vector<LandmarkRow>& map) {
  std::string text = fmt::format(R"({{"time_s":{},"map":[)", time_s);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Matrix2 P = map[i].covariance.value_or(Matrix2::Zero());
    text += fmt::format(
        R"({}{{"landmark":{},"x_m":{},"y_m":{},"var_xx":{},"var_xy":{},"var_yy":{},"sightings":{}}})",
        i > 0 ? "," : "", dumped(map[i].name), map[i].position.x(), map[i].position.y(), P(0, 0), P(0, 1),
        P(1, 1), map[i].sightings.value_or(0.0));
  }
  return text + "]}";
}

}  // namespace trundle::pipeline
