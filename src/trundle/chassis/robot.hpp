#pragma once

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/chassis.hpp"

namespace trundle::chassis {

/// A range-bearing sensor, where it stands on the body, and what it errs by all along: of a landmark at a
/// distance r in direction β it reads range_scale · r · along_ray(b) + range_offset_m and
/// b = β + bearing_offset_rad.
struct LandmarkSensor {
  Pose2 body_from_sensor;
  double range_sigma_m = 0.1;
  double bearing_sigma_rad = 0.03;
  double max_range_m = 10.0;
  double time_offset_s = 0.0;  ///< added to its stamps
  double range_offset_m = 0.0;
  double range_scale = 1.0;
  double bearing_offset_rad = 0.0;
  double depth_share = 0.0;  ///< 0: ranges are distances, a laser's; 1: depths along bearing 0, a camera's

  /// By what share of a distance it reads the range of what it reads the bearing b of: 1 straight ahead.
  [[nodiscard]] double along_ray(double bearing_read_rad) const {
    return 1.0 - depth_share * (1.0 - std::cos(bearing_read_rad));
  }
};

/// What a calibration said of one parameter.
struct CalibratedParameter {
  std::string name;  ///< see parameter.hpp
  std::string unit;
  double value = 0.0;
  double nominal = 0.0;
  double sigma_within = 0.0;  ///< from the noise of the runs alone
  /// Session to session; nothing: unknown, fewer than two sessions.
  std::optional<double> sigma_between = {};
  bool observable = false;  ///< false: stays as given
};

/// An error before and after, e.g. start-aligned position rms over the hold-out runs.
struct ErrorBeforeAfter {
  std::string what;
  double before = 0.0;
  double after = 0.0;
  std::string unit;
};

/// The [calibration] table of a robot file.
struct CalibrationRecord {
  std::vector<CalibratedParameter> parameters;
  /// Of all parameters in their order, between-session spread included where it is known; zero rows of those
  /// of which it says nothing.
  Eigen::MatrixXd covariance;
  std::vector<ErrorBeforeAfter> errors;
  std::vector<std::string> provenance;  ///< "key: value" lines: version, inputs with SHA-256, options

  /// Indices of the parameters that the covariance covers: what was estimated, and what stays as given but
  /// may be wrong.
  [[nodiscard]] std::vector<Eigen::Index> uncertain() const;
};

/// A robot file: the chassis, the names of its wheels, what else is mounted on it.
struct Robot {
  std::string name;
  Chassis chassis;
  std::vector<std::string> wheel_names;  ///< one for each wheel with an encoder
  std::optional<LandmarkSensor> landmark_sensor;
  Pose2 body_from_reference;                 ///< where the reference was measured
  Vector2 marker_on_body = Vector2::Zero();  ///< what other robots see of this one [m]
  double reference_time_offset_s = 0.0;
  std::optional<CalibrationRecord> calibration;
  // For messages, of a robot that was read:
  std::string file = {};                        ///< its path
  std::vector<std::string> wheel_places = {};   ///< "file:line" of each [[wheel]], as Chassis::all_wheels()
  std::vector<std::string> passive_names = {};  ///< one for each passive wheel
};
/// Of any wheel, as Chassis::all_wheels().
[[nodiscard]] const std::string& wheel_name(const Robot& robot, std::size_t wheel);
/// Where to say that something is wrong with the robot, or with that wheel.
[[nodiscard]] std::string place_of(const Robot& robot);
[[nodiscard]] std::string place_of_wheel(const Robot& robot, std::size_t wheel);

/// Reads robot.toml. Throws InputError with file, line, fact and expectation; unknown keys are errors that
/// name the nearest known one.
Robot read_robot(const std::filesystem::path& path);
Robot parse_robot(std::string_view toml, std::string_view file_name);

/// The robot file as text: parse_robot(to_toml(r)) == r to the last bit.
[[nodiscard]] std::string to_toml(const Robot& robot);

}  // namespace trundle::chassis
