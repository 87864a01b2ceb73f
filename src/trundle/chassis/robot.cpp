#include "trundle/chassis/robot.hpp"

#include <algorithm>

#include "trundle/chassis/detail/calibration_table.hpp"
#include "trundle/chassis/detail/parse_toml.hpp"
#include "trundle/chassis/detail/robot_keys.hpp"
#include "trundle/chassis/detail/toml_source.hpp"
#include "trundle/io/file.hpp"

namespace trundle::chassis {
namespace {

using namespace robot_file;

template <class... Keys>
std::vector<std::string> names_of(std::vector<std::string> names, const Keys&... keys) {
  (add_names(keys, names), ...);
  return names;
}

constexpr std::string_view kNameExpected =
    "letters, digits, '_' and '-', and neither \"gyro\" nor \"ambiguous\", nor \"_steering\" at its end";

/// Wheel names become names of columns and of parameters, and stand in slip.csv.
bool is_wheel_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || static_cast<unsigned char>(c) >= 0x80U;
  };
  return !name.empty() && std::ranges::all_of(name, allowed) && name != "gyro" && name != "ambiguous" &&
         !name.ends_with("_steering");
}

std::string wheel_name(const Section& section, std::span<const std::string> others) {
  std::string name = text(section, "name", kNameExpected);
  const toml::source_region& where = section.table.get("name")->source();
  if (!is_wheel_name(name)) fail(section.source, where, fmt::format("name is \"{}\"", name), kNameExpected);
  if (std::ranges::find(others, name) != others.end())
    fail(section.source, where, fmt::format("two wheels are named \"{}\"", name),
         "a different name for each");
  return name;
}

WheelKind wheel_kind(const Section& section) {
  if (section.table.get("kind") == nullptr) return WheelKind::fixed;
  std::string expectation;
  for (std::size_t i = 0; i < kWheelKinds.size(); ++i)
    expectation += fmt::format("{}\"{}\"",
                               i == 0                       ? ""
                               : i + 1 < kWheelKinds.size() ? ", "
                                                            : " or ",
                               kWheelKinds[i].second);
  const std::string word = text(section, "kind", expectation);
  for (const auto& [kind, its_word] : kWheelKinds)
    if (its_word == word) return kind;
  fail(section.source, section.table.get("kind")->source(), fmt::format("kind is \"{}\"", word), expectation);
}

int tick_bits(const Section& section) {
  const toml::node* node = section.table.get("tick_bits");
  if (node == nullptr) return 0;
  constexpr Range kBits{[](double v) { return v >= 0.0 && v <= kMostTickBits && v == std::floor(v); },
                        "a whole number between 0 and 64"};
  return static_cast<int>(number(section.source, "tick_bits", *node, kBits));
}

bool is_passive(const Section& section) {
  return truth_value(section, "passive", false);
}

/// Keys that need another one beside them.
template <class T, std::size_t n>
void forbid(const Section& section, const std::array<NumberKey<T>, n>& keys, std::string_view fact,
            std::string_view expectation) {
  for (const NumberKey<T>& key : keys)
    if (const toml::node* node = section.table.get(key.name))
      fail(section.source, node->source(), in(section, fmt::format("{} {}", key.name, fact)), expectation);
}

/// What a wheel without an encoder says: where it stands, and perhaps its steering.
void check_passive(const Section& section, const Wheel& wheel) {
  if (wheel.kind != WheelKind::fixed)
    fail(section.source, section.table.get("kind")->source(), "a passive wheel that may skid sideways",
         "\"fixed\": without an encoder it says nothing else");
  forbid(section, kWheelSize, "of a passive wheel", "it only where a wheel has an encoder");
}

Wheel read_wheel(const Section& section) {
  static const std::vector<std::string> known = names_of({"name", "kind", "tick_bits", "passive", "steered"},
                                                         kWheelPlace, kWheelRoller, kWheelSize, kSteering);
  check_keys(section, known);
  Wheel wheel;
  wheel.kind = wheel_kind(section);
  wheel.tick_bits = tick_bits(section);
  read_numbers(section, kWheelPlace, wheel);
  if (is_passive(section))
    check_passive(section, wheel);
  else
    read_numbers(section, kWheelSize, wheel);
  if (wheel.kind == WheelKind::mecanum)
    read_numbers(section, kWheelRoller, wheel);
  else
    forbid(section, kWheelRoller, "without rollers", "it only where kind is \"mecanum\"");
  if (!truth_value(section, "steered", false)) {
    forbid(section, kSteering, "of a wheel that is not steered", "it only where steered is true");
    return wheel;
  }
  if (wheel.kind != WheelKind::fixed)
    fail(section.source, section.table.get("kind")->source(), "a steered wheel that may skid sideways",
         "\"fixed\" where steered is true");
  read_numbers(section, kSteering, wheel.steering.emplace());
  return wheel;
}

void read_wheels(const Section& file, Robot& robot) {
  std::vector<std::string> names, passive_places;
  for (const Section& section : tables(file, "wheel", "[[wheel]]")) {
    if (names.size() == kMaxWheels)
      fail(section.source, section.table.source(), fmt::format("more than {} wheels", kMaxWheels),
           fmt::format("at most {}", kMaxWheels));
    const Wheel wheel = read_wheel(section);
    names.push_back(wheel_name(section, names));
    const bool passive = is_passive(section);
    passive ? robot.chassis.add_passive(wheel) : robot.chassis.add(wheel);
    (passive ? robot.passive_names : robot.wheel_names).push_back(names.back());
    (passive ? passive_places : robot.wheel_places)
        .push_back(place(section.source.name, section.table.source().begin.line));
  }
  if (robot.wheel_names.empty() && !names.empty())
    throw InputError(passive_places.front(), "every wheel is passive", "one with an encoder");
  robot.wheel_places.insert(robot.wheel_places.end(), passive_places.begin(), passive_places.end());
}

/// Reads a section of nothing but numbers; says whether it is there.
template <class T, std::size_t n>
bool read_section(const Section& file, std::string_view key, const std::array<NumberKey<T>, n>& keys,
                  T& target) {
  const std::optional<Section> section = table(file, key, fmt::format("[{}]", key));
  if (!section) return false;
  check_keys(*section, names_of({}, keys));
  read_numbers(*section, keys, target);
  return true;
}

/// Of a robot without wheels.
void read_velocity(const Section& file, Robot& robot) {
  if (!read_section(file, "velocity", kVelocity, robot.chassis.velocity)) return;
  if (robot.wheel_names.empty()) return;
  fail(file.source, file.table.get("velocity")->source(), "[velocity] of a robot with wheels",
       "either [[wheel]] or [velocity]: its motion comes from the one or the other");
}

Robot read(const Section& file) {
  static const std::vector<std::string> known =
      names_of({"name", "wheel", "wheels", "velocity", "gyro", "landmark_sensor", "noise", "reference_sensor",
                "marker", "calibration"},
               kChassis);
  check_keys(file, known);
  Robot robot;
  robot.file = file.source.name;
  if (file.table.contains("name")) robot.name = text(file, "name", "a string");
  read_numbers(file, kChassis, robot.chassis);
  read_wheels(file, robot);
  read_section(file, "wheels", kAllWheels, robot.chassis);
  read_velocity(file, robot);
  if (Gyro gyro; read_section(file, "gyro", kGyro, gyro)) robot.chassis.gyro = gyro;
  if (LandmarkSensor sensor; read_section(file, "landmark_sensor", kLandmarkSensor, sensor))
    robot.landmark_sensor = sensor;
  read_section(file, "noise", kNoise, robot.chassis.noise);
  read_section(file, "reference_sensor", kReferenceSensor, robot);
  read_section(file, "marker", kMarker, robot);
  if (const auto section = table(file, "calibration", "[calibration]"))
    robot.calibration = read_calibration(*section, robot);
  return robot;
}

}  // namespace

std::vector<Eigen::Index> CalibrationRecord::uncertain() const {
  std::vector<Eigen::Index> indices;
  for (Eigen::Index i = 0; i < std::ssize(parameters); ++i)
    if (parameters[static_cast<std::size_t>(i)].observable ||
        (i < covariance.rows() && covariance(i, i) > 0.0))
      indices.push_back(i);
  return indices;
}

std::string place_of(const Robot& robot) {
  if (!robot.file.empty()) return robot.file;
  return robot.name.empty() ? "robot" : fmt::format("robot '{}'", robot.name);
}

const std::string& wheel_name(const Robot& robot, std::size_t wheel) {
  const std::size_t measured = robot.wheel_names.size();
  return wheel < measured ? robot.wheel_names[wheel] : robot.passive_names[wheel - measured];
}

std::string place_of_wheel(const Robot& robot, std::size_t wheel) {
  return wheel < robot.wheel_places.size() ? robot.wheel_places[wheel] : place_of(robot);
}

Robot parse_robot(std::string_view toml, std::string_view file_name) {
  const Source source{toml, file_name};
  const toml::table table = parse_toml(toml, file_name);
  return read({source, table, ""});
}

Robot read_robot(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw InputError(path.string(), "does not exist",
                     fmt::format("a robot file: docs/robot.md describes it, and `trundle calibrate RECORDING "
                                 "--robot NOMINAL -o {}` writes a calibrated one",
                                 path.filename().string()));
  return parse_robot(read_file(path), path.string());
}

}  // namespace trundle::chassis
