#include "trundle/simulation/detail/true_robot.hpp"

#include "trundle/chassis/parameter.hpp"
#include "trundle/io/error.hpp"

namespace trundle::simulation::scenario_file {
namespace {

constexpr Parameter kTrack{ParameterKind::track, -1};

bool has_track(const Robot& robot) {
  return parameter_named("track", robot).has_value();
}

/// track_m where the robot has one; it is no plain number of the robot but moves wheels.
std::optional<double> read_track(const Section& section, const Robot& robot) {
  const toml::node* node = section.table.get("track_m");
  if (node == nullptr) return std::nullopt;
  if (!has_track(robot))
    fail(section.source, node->source(), in(section, "track_m of a robot that has no left and right wheels"),
         "places of wheels: [" + section.title.substr(1, section.title.size() - 2) + ".wheel.NAME]");
  return number(section.source, "track_m", *node, kPosition);
}

std::optional<Section> subsection(const Section& section, std::string_view key) {
  const std::string outer = section.title.substr(1, section.title.size() - 2);
  return table(section, key, fmt::format("[{}.{}]", outer, key));
}

template <class T, std::size_t n>
bool read_subsection(const Section& section, std::string_view key, const std::array<NumberKey<T>, n>& keys,
                     T& target) {
  const auto inner = subsection(section, key);
  if (!inner) return false;
  check_keys(*inner, names_with({}, keys));
  read_numbers(*inner, keys, target);
  return true;
}

/// What the file may say of that wheel: a passive one has no size, and few have a steering.
std::vector<std::string> keys_of(const Robot& robot, std::size_t wheel) {
  std::vector<std::string> keys = names_with({}, kWheelPlace);
  if (wheel < robot.wheel_names.size()) keys = names_with({}, kTrueWheel);
  return robot.chassis.all_wheels()[wheel].steering ? names_with(std::move(keys), kSteering) : keys;
}

void read_wheels(const Section& section, Robot& robot) {
  const auto wheels = subsection(section, "wheel");
  if (!wheels) return;
  std::vector<std::string> names = robot.wheel_names;
  names.insert(names.end(), robot.passive_names.begin(), robot.passive_names.end());
  check_keys(*wheels, names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto own = subsection(*wheels, names[i]);
    if (!own) continue;
    check_keys(*own, keys_of(robot, i));
    Wheel& wheel = robot.chassis.all_wheels()[i];
    read_numbers(*own, kTrueWheel, wheel);
    if (wheel.steering) read_numbers(*own, kSteering, *wheel.steering);
  }
}

constexpr std::string_view kNoLag = "no lag: simulated robots do at once what they are told";

void read_velocity(const Section& section, Robot& robot) {
  if (!read_subsection(section, "velocity", kVelocity, robot.chassis.velocity)) return;
  if (!robot.wheel_names.empty())
    fail(section.source, section.table.get("velocity")->source(),
         in(section, "velocity of a robot with wheels"), "it only where the robot file has no [[wheel]]");
  if (robot.chassis.velocity.lag_s != 0.0)
    fail(section.source, section.table.get("velocity")->source(), in(section, "velocity has a lag_s"),
         kNoLag);
}

/// The sections that [truth] and [session_spread] share: numbers of the robot file under the same names.
void read_robot_numbers(const Section& section, Robot& robot) {
  static const std::vector<std::string> known = names_with(
      {"track_m", "wheel", "wheels", "velocity", "gyro", "noise", "landmark_sensor", "reference_sensor"},
      kChassis);
  check_keys(section, known);
  read_numbers(section, kChassis, robot.chassis);
  read_wheels(section, robot);
  read_subsection(section, "wheels", kAllWheels, robot.chassis);
  read_velocity(section, robot);
  Gyro gyro = robot.chassis.gyro.value_or(Gyro{});
  if (read_subsection(section, "gyro", kGyro, gyro)) robot.chassis.gyro = gyro;
  LandmarkSensor sensor = robot.landmark_sensor.value_or(LandmarkSensor{});
  if (read_subsection(section, "landmark_sensor", kLandmarkSensor, sensor)) robot.landmark_sensor = sensor;
  read_subsection(section, "noise", kNoise, robot.chassis.noise);
  read_subsection(section, "reference_sensor", kReferenceSensor, robot);
}

template <class T, std::size_t n>
void zero(const std::array<NumberKey<T>, n>& keys, T& target) {
  for (const NumberKey<T>& key : keys) key.in(target) = 0.0;
}

/// Every number of the robot that the file can name, zero.
Robot zero_robot(const Robot& like) {
  Robot robot;
  robot.wheel_names = like.wheel_names;
  robot.passive_names = like.passive_names;
  robot.chassis.wheel_count = like.chassis.wheel_count;
  robot.chassis.passive_count = like.chassis.passive_count;
  for (std::size_t i = 0; i < like.chassis.all_wheels().size(); ++i)
    if (like.chassis.all_wheels()[i].steering)
      zero(kSteering, robot.chassis.all_wheels()[i].steering.emplace());
  zero(kNoise, robot.chassis.noise);
  zero(kVelocity, robot.chassis.velocity);
  zero(kGyro, robot.chassis.gyro.emplace());
  zero(kLandmarkSensor, robot.landmark_sensor.emplace());
  return robot;
}

/// Numbers without a spread draw nothing: a new key changes no scenario.
template <class T, std::size_t n>
void scatter(const std::array<NumberKey<T>, n>& keys, const T& sigma, T& target, Random& random) {
  T sigmas = sigma;
  for (const NumberKey<T>& key : keys)
    if (key.in(sigmas) > 0.0) key.in(target) += random.normal(key.in(sigmas));
}

}  // namespace

Robot read_truth(const Section& file, const Robot& nominal) {
  if (nominal.chassis.velocity.lag_s != 0.0)
    throw InputError(place_of(nominal), "[velocity] has a lag_s", std::string(kNoLag));
  Robot truth = nominal;
  truth.calibration.reset();
  const auto section = table(file, "truth", "[truth]");
  if (!section) return truth;
  if (const auto track = read_track(*section, nominal)) set_value(kTrack, *track, truth);
  read_robot_numbers(*section, truth);
  return truth;
}

SessionSpread::SessionSpread(const Section& file, const Robot& nominal) : sigma_(zero_robot(nominal)) {
  const auto section = table(file, "session_spread", "[session_spread]");
  if (!section) return;
  track_sigma_m_ = read_track(*section, nominal).value_or(0.0);
  read_robot_numbers(*section, sigma_);
}

Robot SessionSpread::drawn(const Robot& truth, Random& random) const {
  Robot robot = truth;
  if (has_track(truth)) set_value(kTrack, value_of(kTrack, truth) + random.normal(track_sigma_m_), robot);
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    const Wheel& sigma = sigma_.chassis.all_wheels()[i];
    Wheel& wheel = robot.chassis.all_wheels()[i];
    scatter(kTrueWheel, sigma, wheel, random);
    if (wheel.steering) scatter(kSteering, *sigma.steering, *wheel.steering, random);
  }
  scatter(kChassis, sigma_.chassis, robot.chassis, random);
  scatter(kAllWheels, sigma_.chassis, robot.chassis, random);
  scatter(kVelocity, sigma_.chassis.velocity, robot.chassis.velocity, random);
  if (robot.chassis.gyro) scatter(kGyro, *sigma_.chassis.gyro, *robot.chassis.gyro, random);
  if (robot.landmark_sensor)
    scatter(kLandmarkSensor, *sigma_.landmark_sensor, *robot.landmark_sensor, random);
  scatter(kReferenceSensor, sigma_, robot, random);
  return robot;
}

}  // namespace trundle::simulation::scenario_file
