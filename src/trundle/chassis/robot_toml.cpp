#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

#include "trundle/chassis/detail/robot_keys.hpp"

// Writes robot files. What may stand in one, and in which order: detail/robot_keys.hpp.
namespace trundle::chassis {
namespace {

using namespace robot_file;

/// Shortest text that reads back to the same bits, and looks like a floating-point number.
std::string number_text(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string angle_text(double angle_rad) {
  std::string text = degrees_text(angle_rad);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string toml_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20U || byte == 0x7FU) {
      result += fmt::format("\\u{:04X}", byte);
    } else {
      if (c == '"' || c == '\\') result += '\\';
      result += c;
    }
  }
  return result + '"';
}

void write(std::string& out, std::string_view key, std::string_view value) {
  out += fmt::format("{} = {}\n", key, value);
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <class T>
void write_number(std::string& out, const NumberKey<T>& key, T& section) {
  const double value = key.in(section);
  write(out, key.name, is_degrees(key.name) ? angle_text(value) : number_text(value));
}

/// `section` by value because the keys give access for reading and writing alike.
template <class T, std::size_t n>
void write_numbers(std::string& out, const std::array<NumberKey<T>, n>& keys, T section) {
  T defaults;
  for (const NumberKey<T>& key : keys)
    if (key.presence != Presence::rare || !same_bits(key.in(section), key.in(defaults)))
      write_number(out, key, section);
}

template <class T, std::size_t n>
bool has_defaults(const std::array<NumberKey<T>, n>& keys, T section) {
  T defaults;
  return std::ranges::all_of(keys,
                             [&](const auto& key) { return same_bits(key.in(section), key.in(defaults)); });
}

void write_wheel(std::string& out, const std::string& name, const Wheel& wheel, bool passive) {
  out += "\n[[wheel]]\n";
  write(out, "name", toml_string(name));
  write_numbers(out, kWheelPlace, wheel);
  write(out, "kind",
        toml_string(std::ranges::find(kWheelKinds, wheel.kind, &std::pair<WheelKind, std::string_view>::first)
                        ->second));
  if (wheel.kind == WheelKind::mecanum) write_numbers(out, kWheelRoller, wheel);
  if (passive)
    write(out, "passive", "true");
  else
    write_numbers(out, kWheelSize, wheel);
  if (wheel.steering) {
    write(out, "steered", "true");
    write_numbers(out, kSteering, *wheel.steering);
  }
  if (wheel.tick_bits != 0) write(out, "tick_bits", fmt::format("{}", wheel.tick_bits));
}

/// Does this robot's odometry look at that noise?
bool uses(const Chassis& chassis, std::string_view noise_key) {
  const auto any = [&](WheelKind kind) {
    return std::ranges::find(chassis.all_wheels(), kind, &Wheel::kind) != chassis.all_wheels().end();
  };
  const bool velocity = chassis.wheel_count == 0;
  if (noise_key.starts_with("lateral")) return velocity || any(WheelKind::fixed);
  if (noise_key.starts_with("skid")) return any(WheelKind::skid);
  return velocity || noise_key.starts_with("wheel");
}

void write_noise(std::string& out, const Chassis& chassis) {
  out += "\n[noise]\n";
  ChassisNoise noise = chassis.noise;
  ChassisNoise defaults;
  for (const auto& key : kNoise)
    if (uses(chassis, key.name) || !same_bits(key.in(noise), key.in(defaults))) write_number(out, key, noise);
}

void write_texts(std::string& out, std::string_view key, const std::vector<std::string>& texts) {
  out += fmt::format("{} = [\n", key);
  for (const std::string& text : texts) out += fmt::format("  {},\n", toml_string(text));
  out += "]\n";
}

void write_covariance(std::string& out, const CalibrationRecord& record) {
  const std::vector<Eigen::Index> uncertain = record.uncertain();
  if (uncertain.empty()) return;
  std::vector<std::string> names;
  for (const Eigen::Index i : uncertain) names.push_back(record.parameters[static_cast<std::size_t>(i)].name);
  write_texts(out, "covariance_of", names);
  out += "covariance = [\n";
  for (const Eigen::Index row : uncertain) {
    out += "  [";
    for (const Eigen::Index column : uncertain)
      out += (column == uncertain.front() ? "" : ", ") + number_text(record.covariance(row, column));
    out += "],\n";
  }
  out += "]\n";
}

void write_parameter(std::string& out, const CalibratedParameter& parameter) {
  out += "\n[[calibration.parameter]]\n";
  write(out, "name", toml_string(parameter.name));
  write(out, "unit", toml_string(parameter.unit));
  write_numbers(out, kParameter, parameter);
  write(out, "sigma_within", number_text(parameter.sigma_within));
  if (parameter.sigma_between) write(out, "sigma_between", number_text(*parameter.sigma_between));
  write(out, "observable", parameter.observable ? "true" : "false");
}

void write_error(std::string& out, const ErrorBeforeAfter& error) {
  out += "\n[[calibration.error]]\n";
  write(out, "what", toml_string(error.what));
  write(out, "unit", toml_string(error.unit));
  write_numbers(out, kError, error);
}

void write_calibration(std::string& out, const CalibrationRecord& record) {
  out += "\n[calibration]\n";
  if (!record.provenance.empty()) write_texts(out, "provenance", record.provenance);
  write_covariance(out, record);
  for (const CalibratedParameter& parameter : record.parameters) write_parameter(out, parameter);
  for (const ErrorBeforeAfter& error : record.errors) write_error(out, error);
}

template <class T, std::size_t n>
void write_section(std::string& out, std::string_view name, const std::array<NumberKey<T>, n>& keys,
                   const T& section) {
  out += fmt::format("\n[{}]\n", name);
  write_numbers(out, keys, section);
}

}  // namespace

std::string to_toml(const Robot& robot) {
  const Chassis& chassis = robot.chassis;
  std::string out;
  if (!robot.name.empty()) write(out, "name", toml_string(robot.name));
  write_numbers(out, kChassis, chassis);
  for (std::size_t i = 0; i < chassis.all_wheels().size(); ++i)
    write_wheel(out, wheel_name(robot, i), chassis.all_wheels()[i], i >= chassis.wheels().size());
  if (!has_defaults(kAllWheels, chassis)) write_section(out, "wheels", kAllWheels, chassis);
  if (!has_defaults(kVelocity, chassis.velocity)) write_section(out, "velocity", kVelocity, chassis.velocity);
  if (chassis.gyro) write_section(out, "gyro", kGyro, *chassis.gyro);
  if (robot.landmark_sensor) write_section(out, "landmark_sensor", kLandmarkSensor, *robot.landmark_sensor);
  write_noise(out, chassis);
  if (!has_defaults(kReferenceSensor, robot)) write_section(out, "reference_sensor", kReferenceSensor, robot);
  if (!has_defaults(kMarker, robot)) write_section(out, "marker", kMarker, robot);
  if (robot.calibration) write_calibration(out, *robot.calibration);
  return out;
}

}  // namespace trundle::chassis
