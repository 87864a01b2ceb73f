// A gyro whose bias is not that of the robot file: no filter and no smoother is worse for it. The world is
// made here, of exact arcs: white noise of rolling and skidding, a gyro of white noise and a constant bias.
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/slam/localization/localizer.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"

namespace trundle::slam {
namespace {

constexpr int kRate_hz = 20;
constexpr int kSightings_hz = 5;
constexpr double kTrack_m = 0.4;
constexpr double kDiameter_m = 0.1;
constexpr int kDriven_s = 60;

struct Situation {
  double bias_rad_s = 0.0;
  int rest_s = 10;
};

Robot robot_with_gyro() {
  Robot robot;
  robot.name = "gyro";
  robot.chassis = differential_drive({kDiameter_m, 0.0, 0}, kTrack_m);
  robot.chassis.gyro = Gyro{};
  robot.chassis.noise.wheel_per_sqrt_m = 0.005;
  robot.chassis.noise.lateral_per_sqrt_m = 0.001;
  robot.wheel_names = {"left", "right"};
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.0}, 0.05, radians(1.0), 6.0, 0.0};
  return robot;
}

struct World {
  Robot robot = robot_with_gyro();
  std::vector<Vector2> landmarks;
  std::vector<std::string> names;
  Recording recording;
  AlignedReadings readings;
  std::vector<Pose2> truth = {Pose2{}};  ///< at multiples of 1/kRate_hz

  const Pose2& truth_at(double time_s) const {
    return truth[static_cast<std::size_t>(std::llround(time_s * kRate_hz))];
  }
  SlamInput input() const { return slam_input(recording, readings, robot, {.names = names}); }
};

void look_around(World& world, double time_s, Random& random) {
  const LandmarkSensor& sensor = *world.robot.landmark_sensor;
  for (std::size_t i = 0; i < world.landmarks.size(); ++i) {
    const Vector2 apart = (world.truth.back() * sensor.body_from_sensor).inverse() * world.landmarks[i];
    if (apart.norm() > sensor.max_range_m) continue;
    world.recording.sightings.push_back(
        {time_s, world.names[i], apart.norm() + random.normal(sensor.range_sigma_m),
         wrap_angle(std::atan2(apart.y(), apart.x()) + random.normal(sensor.bearing_sigma_rad))});
  }
}

/// One interval: the body moves, and what wheels and gyro read of it.
Increment drive(World& world, const Twist2& wanted, double bias_rad_s, Random& random) {
  const double dt = 1.0 / kRate_hz;
  const auto& noise = world.robot.chassis.noise;
  const Gyro& gyro = *world.robot.chassis.gyro;
  const double skid_m = noise.lateral_per_sqrt_m * std::sqrt(std::abs(wanted.dx));
  const Twist2 twist{wanted.dx, random.normal(skid_m), wanted.dtheta};
  world.truth.push_back(world.truth.back() * exp(twist));
  Increment increment;
  increment.duration_s = dt;
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {
    const double travel_m = twist.dx + (wheel == 0 ? -0.5 : 0.5) * kTrack_m * twist.dtheta;
    const double rolled_m = travel_m + random.normal(noise.wheel_per_sqrt_m * std::sqrt(std::abs(travel_m)));
    increment.turned[wheel] = rolled_m / (kPi * kDiameter_m);
  }
  increment.has_gyro = true;
  increment.gyro_rad =
      twist.dtheta + bias_rad_s * dt + random.normal(gyro.noise_rad_s_sqrt_hz * std::sqrt(dt));
  return increment;
}

/// Loops among twenty landmarks at 0.5 m/s; each drive has noise of its own.
World world_of(const Situation& situation, std::uint64_t seed, std::uint64_t drive_number = 1) {
  World world;
  Random places(seed, 40);
  for (int i = 0; i < 20; ++i) {
    const double y = places.uniform(-2.0, 8.0), x = places.uniform(-5.0, 5.0);
    world.landmarks.emplace_back(x, y);
    world.names.push_back(std::to_string(i));
  }
  Random random(seed, 40 + drive_number);
  for (int k = 1; k <= kRate_hz * (situation.rest_s + kDriven_s); ++k) {
    const double dt = 1.0 / kRate_hz;
    const double driven_s = dt * k - situation.rest_s;
    const Twist2 twist{0.5 * dt, 0.0, dt * (0.25 + 0.2 * std::sin(0.3 * driven_s))};
    Increment increment = drive(world, driven_s > 0.0 ? twist : Twist2{}, situation.bias_rad_s, random);
    increment.time_s = dt * k;
    world.readings.increments.push_back(increment);
    if (k % (kRate_hz / kSightings_hz) == 0) look_around(world, dt * k, random);
  }
  world.readings.bridged.assign(world.readings.increments.size(), false);
  return world;
}

using Estimator = std::function<Trajectory(const World&)>;

Estimator filter_of(SlamMethod method, PointEstimate estimate = PointEstimate::mean) {
  return [=](const World& world) {
    return slam(world.input(), *world.robot.landmark_sensor,
                {.method = method, .particles = 100, .estimate = estimate})
        .online;
  };
}

Trajectory smoothed(const World& world) {
  const SlamInput input = world.input();
  const LandmarkSensor& sensor = *world.robot.landmark_sensor;
  return smooth(input, sensor, slam(input, sensor, {.method = SlamMethod::ekf})).trajectory;
}

Estimator localizer_of(LocalizerFilter filter) {
  return [=](const World& world) {
    std::vector<KnownLandmark> landmarks;
    for (const Vector2& place : world.landmarks) landmarks.push_back({place});
    const KnownMap map(landmarks, 12.0);
    return localize(world.input(), map, *world.robot.landmark_sensor,
                    {.filter = filter, .start = PoseEstimate{}, .particles = {.most = 200}})
        .trajectory;
  };
}

/// Root mean square of the position's error over the whole drive, and NEES after a third, two thirds, and at
/// the end of it; all seeds together.
struct Errors {
  double squares = 0.0;
  double poses = 0.0;
  std::array<double, 3> nees{};
  double runs = 0.0;

  double worst_m = 0.0;  ///< rms of a run

  void add(const World& world, const Trajectory& trajectory) {
    const double before = squares;
    for (const StampedPose& pose : trajectory.poses) {
      squares += (pose.pose.translation() - world.truth_at(pose.time_s).translation()).squaredNorm();
      poses += 1.0;
    }
    worst_m = std::max(worst_m, std::sqrt((squares - before) / static_cast<double>(trajectory.poses.size())));
    for (std::size_t i = 0; i < nees.size(); ++i) {
      const std::size_t at = (i + 1) * trajectory.poses.size() / nees.size() - 1;
      const Pose2& mean = trajectory.poses[at].pose;
      const Pose2& truth = world.truth_at(trajectory.poses[at].time_s);
      const Vector3 error(mean.x - truth.x, mean.y - truth.y, wrap_angle(mean.heading - truth.heading));
      nees[i] += error.dot(trajectory.covariances[at].ldlt().solve(error));
    }
    runs += 1.0;
  }
  double rms_m() const { return std::sqrt(squares / poses); }
  double mean_nees() const { return (nees[0] + nees[1] + nees[2]) / (3.0 * runs); }
};

Errors errors_of(const Estimator& estimator, const Situation& situation, int runs) {
  Errors errors;
  for (int run = 0; run < runs; ++run) {
    const World world = world_of(situation, static_cast<std::uint64_t>(run) + 1);
    errors.add(world, estimator(world));
  }
  return errors;
}

/// After a rest, and without one.
struct Limits {
  double with_rest, without;

  double of(int rest_s) const { return rest_s > 0 ? with_rest : without; }
};
constexpr double kAny = std::numeric_limits<double>::infinity();

/// Without a rest the bias of a particle filter is what single particles make of the first way, and once all
/// descend from one they are as sure of it as that one: docs/results/particles-gyro.md.
constexpr double kTimesOfParticles = 6.0;

struct Subject {
  std::string name;
  Estimator estimator;
  /// Mean NEES; 0: χ² of the runs. Else what was measured, and allowed for few runs:
  /// docs/results/particles-gyro.md.
  Limits most_nees = {};
  Limits most_times = {1.5, 1.5};  ///< the error without a bias
};

/// For the names of the tests.
void PrintTo(const Subject& subject, std::ostream* out) {
  *out << subject.name;
}

class GyroBias : public testing::TestWithParam<Subject> {};

TEST_P(GyroBias, MakesNoEstimateWorseOrSurerThanItIs) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int runs = test::trials(20, 2);
  for (const int rest_s : {10, 0}) {
    double without_m = 0.0;
    for (const double bias_rad_s : {0.0, 0.003, 0.02}) {
      const Errors errors = errors_of(GetParam().estimator, {bias_rad_s, rest_s}, runs);
      std::printf("%-22s rest %2d s, bias %.3f rad/s: rms %.4f m (worst %.4f), NEES %.2f %.2f %.2f\n",
                  GetParam().name.c_str(), rest_s, bias_rad_s, errors.rms_m(), errors.worst_m,
                  errors.nees[0] / errors.runs, errors.nees[1] / errors.runs, errors.nees[2] / errors.runs);
      if (bias_rad_s == 0.0) without_m = errors.rms_m();
      EXPECT_LT(errors.rms_m(), GetParam().most_times.of(rest_s) * without_m) << rest_s << ' ' << bias_rad_s;
      if (const double most = GetParam().most_nees.of(rest_s); most > 0.0) {
        EXPECT_LT(errors.mean_nees(), most) << rest_s << ' ' << bias_rad_s;
        continue;
      }
      // 99.9 % of sums of consistent ones lie between these.
      for (const double sum : errors.nees) {
        EXPECT_GT(sum, chi_squared_limit(0.9995, 3.0 * runs)) << rest_s << ' ' << bias_rad_s;
        EXPECT_LT(sum, chi_squared_limit(0.0005, 3.0 * runs)) << rest_s << ' ' << bias_rad_s;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    , GyroBias,
    testing::Values(
        Subject{"ekf", filter_of(SlamMethod::ekf), {0.0, 6.0}},
        Subject{"fastslam1", filter_of(SlamMethod::fastslam1), {6.0, kAny}, {1.5, kTimesOfParticles}},
        Subject{"fastslam2", filter_of(SlamMethod::fastslam2), {6.0, kAny}, {1.5, kTimesOfParticles}},
        Subject{"mapso", filter_of(SlamMethod::mapso), {40.0, kAny}, {2.0, kTimesOfParticles}},
        Subject{"mapso_best",
                filter_of(SlamMethod::mapso, PointEstimate::best),
                {40.0, kAny},
                {2.0, kTimesOfParticles}},
        Subject{
            "mapso_proposal", filter_of(SlamMethod::mapso_proposal), {6.0, kAny}, {1.5, kTimesOfParticles}},
        Subject{"smoother", smoothed}, Subject{"smoother_online", filter_of(SlamMethod::smoother)},
        Subject{"localize_ekf", localizer_of(LocalizerFilter::ekf)},
        Subject{"localize_particles", localizer_of(LocalizerFilter::particles)}),
    [](const auto& test) { return test.param.name; });

/// The map of one drive, with what is known of it together or not, for another drive.
KnownMap map_of(const World& world, bool together) {
  const SlamResult first = slam(world.input(), *world.robot.landmark_sensor, {.method = SlamMethod::ekf});
  std::vector<KnownLandmark> landmarks(world.landmarks.size());
  std::vector<Eigen::Index> rows(2 * landmarks.size());
  for (std::size_t i = 0; i < first.map.size(); ++i) {
    const auto id = static_cast<std::size_t>(first.map[i].id);
    landmarks[id] = {first.map[i].position, first.map[i].covariance};
    rows[2 * id] = 2 * static_cast<Eigen::Index>(i);
    rows[2 * id + 1] = rows[2 * id] + 1;
  }
  if (!together) return {landmarks, 12.0};
  return {landmarks, 12.0, first.map_covariance(rows, rows)};
}

// Most of what is wrong with a map is common to neighbours.
TEST(LocalizerOnAMapOfItsOwn, IsConsistentWhereTheMapIsKnownTogether) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int runs = test::trials(20, 5);
  Errors apart, together;
  for (int run = 0; run < runs; ++run) {
    const auto seed = static_cast<std::uint64_t>(run) + 1;
    const World first = world_of({0.003, 10}, seed, 1);
    const World second = world_of({-0.002, 10}, seed, 2);
    for (const bool is_joint : {false, true}) {
      const KnownMap map = map_of(first, is_joint);
      const LocalizerOptions options{.start = PoseEstimate{}};
      const Localization found = localize(second.input(), map, *second.robot.landmark_sensor, options);
      (is_joint ? together : apart).add(second, found.trajectory);
    }
  }
  std::printf("map of its own, apart:    rms %.4f m, NEES %.2f\n", apart.rms_m(), apart.mean_nees());
  std::printf("map of its own, together: rms %.4f m, NEES %.2f\n", together.rms_m(), together.mean_nees());
  for (const double sum : together.nees) {
    EXPECT_GT(sum, chi_squared_limit(0.9995, 3.0 * runs));
    EXPECT_LT(sum, chi_squared_limit(0.0005, 3.0 * runs));
  }
}

}  // namespace
}  // namespace trundle::slam
