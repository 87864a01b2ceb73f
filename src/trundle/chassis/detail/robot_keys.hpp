#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/chassis/robot.hpp"

// The numbers of a robot file: one table for each of its sections, in the order in which they are written.
// Reader and writer both go by them. Keys that end in _deg are degrees in the file and radians here.
// docs/robot.md explains them.
namespace trundle::chassis::robot_file {

/// Which finite numbers a key takes, and how a message says so.
struct Range {
  bool (*holds)(double);
  std::string_view words;
};

inline constexpr Range kAny{[](double) { return true; }, "a finite number"};
inline constexpr Range kNotNegative{[](double v) { return v >= 0.0; }, "a number of at least 0"};
/// A share of the way, or the turn that goes with it: ten times what was driven is no measurement.
inline constexpr Range kShareOfWay{[](double v) { return v >= 0.0 && v <= 10.0; },
                                   "a number of at least 0 and at most 10"};
inline constexpr Range kRate{[](double v) { return v >= 0.0 && v <= 100.0; },
                             "a number of at least 0 and at most 100"};
inline constexpr Range kSensorSigma{[](double v) { return v > 0.0 && v <= 1000.0; },
                                    "a number above 0 and at most 1000"};
inline constexpr Range kRangeScale{[](double v) { return v >= 0.01 && v <= 100.0; },
                                   "a number from 0.01 to 100"};
inline constexpr Range kVelocityScale{
    [](double v) { return std::abs(v) >= kLeastVelocityScale && std::abs(v) <= kGreatestVelocityScale; },
    "a number from 0.000001 to 100, or the negative of one"};
inline constexpr Range kLag{[](double v) { return v >= 0.0 && v <= 10.0; }, "seconds from 0 to 10"};
inline constexpr Range kTurn{[](double v) { return std::abs(v) <= 100.0; }, "a number from -100 to 100"};
inline constexpr Range kDepthShare{[](double v) { return v >= -1.0 && v <= 2.0; }, "a number from -1 to 2"};
/// Nearer to 8/9, what the wheels turned would not say how far the robot did: docs/theory/scrub.md, eq. 2.
inline constexpr Range kScrub{[](double v) { return std::abs(v) <= 0.8; }, "a number from -0.8 to 0.8"};
inline constexpr Range kTyreGrowth{[](double v) { return std::abs(v) <= 1.0; }, "s^2/m^2 from -1 to 1"};
inline constexpr Range kPositive{[](double v) { return v > 0.0; }, "a number above 0"};
inline constexpr Range kNotZero{[](double v) { return v != 0.0; }, "a number other than 0"};
inline constexpr Range kAngle{[](double v) { return std::abs(v) <= 2.0 * kPi; },
                              "degrees between -360 and 360"};
inline constexpr Range kAngleSigma{[](double v) { return v >= 0.0 && v <= 0.5 * kPi; },
                                   "degrees of at least 0 and at most 90"};
inline constexpr Range kRoller{[](double v) { return std::abs(v) <= radians(89.0); },
                               "degrees between -89 and 89"};
inline constexpr Range kPosition{[](double v) { return std::abs(v) <= 100.0; },
                                 "metres between -100 and 100"};
inline constexpr Range kDiameter{[](double v) { return v > 0.0 && v <= 20.0; },
                                 "metres above 0 and at most 20"};

/// When a key must be there, and when it is written.
enum class Presence {
  required,  ///< must be there
  usual,     ///< may be missing; always written
  rare,      ///< may be missing; written where it differs from the default
};

template <class Section>
struct NumberKey {
  std::string_view name;
  double& (*in)(Section&);
  Range range = kAny;
  Presence presence = Presence::usual;
};

inline constexpr std::array kWheelPlace{
    NumberKey<Wheel>{"x_m", [](Wheel& w) -> double& { return w.x_m; }, kPosition},
    NumberKey<Wheel>{"y_m", [](Wheel& w) -> double& { return w.y_m; }, kPosition},
    NumberKey<Wheel>{"direction_deg", [](Wheel& w) -> double& { return w.direction_rad; }, kAngle},
};
inline constexpr std::array kWheelRoller{
    NumberKey<Wheel>{"roller_deg", [](Wheel& w) -> double& { return w.roller_rad; }, kRoller,
                     Presence::required},
};
inline constexpr std::array kWheelSize{
    NumberKey<Wheel>{"diameter_m", [](Wheel& w) -> double& { return w.diameter_m; }, kDiameter,
                     Presence::required},
    NumberKey<Wheel>{"ticks_per_revolution", [](Wheel& w) -> double& { return w.ticks_per_revolution; }, kAny,
                     Presence::rare},
    NumberKey<Wheel>{"recorded_diameter_m", [](Wheel& w) -> double& { return w.recorded_diameter_m; },
                     kDiameter, Presence::rare},
    NumberKey<Wheel>{"noise_per_sqrt_m", [](Wheel& w) -> double& { return w.noise_per_sqrt_m; }, kShareOfWay,
                     Presence::rare},
};

/// Of a wheel with `steered = true`.
inline constexpr std::array kSteering{
    NumberKey<SteeringSensor>{"steering_zero_deg", [](SteeringSensor& s) -> double& { return s.zero_rad; },
                              kAngle},
    NumberKey<SteeringSensor>{"steering_scale", [](SteeringSensor& s) -> double& { return s.scale; },
                              kNotZero},
    NumberKey<SteeringSensor>{"steering_sigma_deg", [](SteeringSensor& s) -> double& { return s.sigma_rad; },
                              kAngleSigma},
    NumberKey<SteeringSensor>{"steering_ticks_per_revolution",
                              [](SteeringSensor& s) -> double& { return s.ticks_per_revolution; }, kAny,
                              Presence::rare},
    NumberKey<SteeringSensor>{"steering_time_offset_s",
                              [](SteeringSensor& s) -> double& { return s.time_offset_s; }, kAny,
                              Presence::rare},
};

inline constexpr std::array kChassis{
    NumberKey<Chassis>{"icr_x_m", [](Chassis& c) -> double& { return c.icr_x_m; }, kPosition, Presence::rare},
    NumberKey<Chassis>{"scrub", [](Chassis& c) -> double& { return c.scrub; }, kScrub, Presence::rare},
    NumberKey<Chassis>{"tyre_growth_s2_m2", [](Chassis& c) -> double& { return c.tyre_growth_s2_m2; },
                       kTyreGrowth, Presence::rare},
};
inline constexpr std::array kAllWheels{
    NumberKey<Chassis>{"time_offset_s", [](Chassis& c) -> double& { return c.wheels_time_offset_s; }, kAny,
                       Presence::rare},
};

/// Of a robot without wheels.
inline constexpr std::array kVelocity{
    NumberKey<VelocityCorrection>{
        "forward_scale", [](VelocityCorrection& v) -> double& { return v.forward_scale; }, kVelocityScale},
    NumberKey<VelocityCorrection>{"yaw_scale", [](VelocityCorrection& v) -> double& { return v.yaw_scale; },
                                  kVelocityScale},
    NumberKey<VelocityCorrection>{"yaw_per_forward_rad_m",
                                  [](VelocityCorrection& v) -> double& { return v.yaw_per_forward_rad_m; },
                                  kTurn},
    NumberKey<VelocityCorrection>{"yaw_bias_rad_s",
                                  [](VelocityCorrection& v) -> double& { return v.yaw_bias_rad_s; }, kTurn},
    NumberKey<VelocityCorrection>{"lag_s", [](VelocityCorrection& v) -> double& { return v.lag_s; }, kLag},
};

inline constexpr std::array kGyro{
    NumberKey<Gyro>{"bias_rad_s", [](Gyro& g) -> double& { return g.bias_rad_s; }},
    NumberKey<Gyro>{"scale", [](Gyro& g) -> double& { return g.scale; }, kNotZero},
    NumberKey<Gyro>{"noise_rad_s_sqrt_hz", [](Gyro& g) -> double& { return g.noise_rad_s_sqrt_hz; }, kRate},
    NumberKey<Gyro>{"bias_walk_rad_s_sqrt_s", [](Gyro& g) -> double& { return g.bias_walk_rad_s_sqrt_s; },
                    kRate},
    NumberKey<Gyro>{"bias_sigma_rad_s", [](Gyro& g) -> double& { return g.bias_sigma_rad_s; }, kRate,
                    Presence::rare},
    NumberKey<Gyro>{"max_rate_rad_s", [](Gyro& g) -> double& { return g.max_rate_rad_s; }, kPositive},
    NumberKey<Gyro>{"time_offset_s", [](Gyro& g) -> double& { return g.time_offset_s; }},
};

inline constexpr std::array kLandmarkSensor{
    NumberKey<LandmarkSensor>{"x_m", [](LandmarkSensor& s) -> double& { return s.body_from_sensor.x; },
                              kPosition},
    NumberKey<LandmarkSensor>{"y_m", [](LandmarkSensor& s) -> double& { return s.body_from_sensor.y; },
                              kPosition},
    NumberKey<LandmarkSensor>{
        "heading_deg", [](LandmarkSensor& s) -> double& { return s.body_from_sensor.heading; }, kAngle},
    NumberKey<LandmarkSensor>{"range_sigma_m", [](LandmarkSensor& s) -> double& { return s.range_sigma_m; },
                              kSensorSigma},
    NumberKey<LandmarkSensor>{"bearing_sigma_deg",
                              [](LandmarkSensor& s) -> double& { return s.bearing_sigma_rad; }, kSensorSigma},
    NumberKey<LandmarkSensor>{"max_range_m", [](LandmarkSensor& s) -> double& { return s.max_range_m; },
                              kPositive},
    NumberKey<LandmarkSensor>{"time_offset_s", [](LandmarkSensor& s) -> double& { return s.time_offset_s; },
                              kAny, Presence::rare},
    NumberKey<LandmarkSensor>{"range_offset_m", [](LandmarkSensor& s) -> double& { return s.range_offset_m; },
                              kPosition, Presence::rare},
    NumberKey<LandmarkSensor>{"range_scale", [](LandmarkSensor& s) -> double& { return s.range_scale; },
                              kRangeScale, Presence::rare},
    NumberKey<LandmarkSensor>{"bearing_offset_deg",
                              [](LandmarkSensor& s) -> double& { return s.bearing_offset_rad; }, kAngle,
                              Presence::rare},
    NumberKey<LandmarkSensor>{"depth_share", [](LandmarkSensor& s) -> double& { return s.depth_share; },
                              kDepthShare, Presence::rare},
};

inline constexpr std::array kNoise{
    NumberKey<ChassisNoise>{"wheel_per_sqrt_m", [](ChassisNoise& n) -> double& { return n.wheel_per_sqrt_m; },
                            kShareOfWay},
    NumberKey<ChassisNoise>{"lateral_per_sqrt_m",
                            [](ChassisNoise& n) -> double& { return n.lateral_per_sqrt_m; }, kShareOfWay},
    NumberKey<ChassisNoise>{"skid_per_sqrt_m", [](ChassisNoise& n) -> double& { return n.skid_per_sqrt_m; },
                            kShareOfWay},
    NumberKey<ChassisNoise>{"turn_per_sqrt_m", [](ChassisNoise& n) -> double& { return n.turn_per_sqrt_m; },
                            kShareOfWay},
    NumberKey<ChassisNoise>{"turn_per_sqrt_rad",
                            [](ChassisNoise& n) -> double& { return n.turn_per_sqrt_rad; }, kShareOfWay},
};

inline constexpr std::array kMarker{
    NumberKey<Robot>{"x_m", [](Robot& r) -> double& { return r.marker_on_body.x(); }, kPosition},
    NumberKey<Robot>{"y_m", [](Robot& r) -> double& { return r.marker_on_body.y(); }, kPosition},
};

inline constexpr std::array kReferenceSensor{
    NumberKey<Robot>{"x_m", [](Robot& r) -> double& { return r.body_from_reference.x; }, kPosition},
    NumberKey<Robot>{"y_m", [](Robot& r) -> double& { return r.body_from_reference.y; }, kPosition},
    NumberKey<Robot>{"heading_deg", [](Robot& r) -> double& { return r.body_from_reference.heading; },
                     kAngle},
    NumberKey<Robot>{"time_offset_s", [](Robot& r) -> double& { return r.reference_time_offset_s; }, kAny,
                     Presence::rare},
};

inline constexpr std::array kParameter{
    NumberKey<CalibratedParameter>{"value", [](CalibratedParameter& p) -> double& { return p.value; }, kAny,
                                   Presence::required},
    NumberKey<CalibratedParameter>{"nominal", [](CalibratedParameter& p) -> double& { return p.nominal; },
                                   kAny, Presence::required},
};

inline constexpr std::array kError{
    NumberKey<ErrorBeforeAfter>{"before", [](ErrorBeforeAfter& e) -> double& { return e.before; }, kAny,
                                Presence::required},
    NumberKey<ErrorBeforeAfter>{"after", [](ErrorBeforeAfter& e) -> double& { return e.after; }, kAny,
                                Presence::required},
};

inline constexpr std::array<std::pair<WheelKind, std::string_view>, 4> kWheelKinds{{
    {WheelKind::fixed, "fixed"},
    {WheelKind::skid, "skid"},
    {WheelKind::omni, "omni"},
    {WheelKind::mecanum, "mecanum"},
}};
inline constexpr int kMostTickBits = 64;

template <class T, std::size_t n>
void add_names(const std::array<NumberKey<T>, n>& keys, std::vector<std::string>& names) {
  for (const NumberKey<T>& key : keys) names.emplace_back(key.name);
}

inline bool is_degrees(std::string_view key) {
  return key.ends_with("_deg");
}

}  // namespace trundle::chassis::robot_file
