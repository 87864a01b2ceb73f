// On a map that is itself wrong by centimetres the stated covariance of the pose is the errors' own. The
// world is made here, of arcs, and asks nothing of the code under test but its arithmetic of angles.
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/slam/localization/localizer.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::slam {
namespace {

constexpr int kRate_hz = 20;
constexpr int kLookEvery = 4;  // steps: 5 Hz
constexpr double kTrack_m = 0.4;
constexpr double kDiameter_m = 0.1;
constexpr double kSide_m = 20.0;
constexpr int kLandmarks = 20;

struct MapScene {
  const char* name;
  bool has_gyro = true;
  bool is_correlated = false;  ///< the map's errors: neighbours are wrong alike, and its frame
  bool is_named = true;
  bool is_start_known = true;
  int blind_from_s = 0, blind_to_s = 0;
  double wheel_per_sqrt_m = 0.01;
};
void PrintTo(const MapScene& scene, std::ostream* out) {
  *out << scene.name;
}

/// Covariance of a surveyed map, x and y of each landmark: each is off by up to 0.1 m; or by 0.05 m that
/// neighbours have in common over 6 m, 0.02 m of its own, and a turn of all by 0.005 rad.
Eigen::MatrixXd map_covariance(const std::vector<Vector2>& places, bool is_correlated, Random& random) {
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(2 * kLandmarks, 2 * kLandmarks);
  for (int i = 0; i < kLandmarks; ++i) {
    const double sigma_m = is_correlated ? 0.02 : random.uniform(0.0, 0.1);
    C.block<2, 2>(2 * i, 2 * i) = sigma_m * sigma_m * Matrix2::Identity();
  }
  if (!is_correlated) return C;
  const auto turned = [&](int i) { return Vector2(-places[i].y(), places[i].x() - 0.5 * kSide_m); };
  for (int i = 0; i < kLandmarks; ++i)
    for (int j = 0; j < kLandmarks; ++j)
      C.block<2, 2>(2 * i, 2 * j) +=
          0.05 * 0.05 * std::exp(-(places[i] - places[j]).norm() / 6.0) * Matrix2::Identity() +
          0.005 * 0.005 * turned(i) * turned(j).transpose();
  return C;
}

class World {
 public:
  World(const MapScene& scene, std::uint64_t seed) : scene_(scene), random_(seed, 60) {
    robot_.chassis = differential_drive({kDiameter_m, 0.0, 0}, kTrack_m);
    if (scene.has_gyro) robot_.chassis.gyro = Gyro{};
    robot_.chassis.noise.wheel_per_sqrt_m = scene.wheel_per_sqrt_m;
    robot_.chassis.noise.lateral_per_sqrt_m = 0.001;
    robot_.wheel_names = {"left", "right"};
    robot_.landmark_sensor = LandmarkSensor{{0.2, 0.0, 0.0}, 0.05, radians(1.0), 8.0, 0.0};
    std::vector<KnownLandmark> mapped;
    for (int i = 0; i < kLandmarks; ++i) {
      const double y = random_.uniform(0.0, kSide_m), x = random_.uniform(0.0, kSide_m);
      landmarks_.emplace_back(x, y);
      names_.push_back(std::to_string(i));
    }
    const Eigen::MatrixXd C = map_covariance(landmarks_, scene.is_correlated, random_);
    const Eigen::MatrixXd root = C.llt().matrixL();
    Eigen::VectorXd normal(C.rows());
    for (double& n : normal) n = random_.normal();
    const Eigen::VectorXd error = root * normal;
    for (int i = 0; i < kLandmarks; ++i) mapped.push_back({landmarks_[i] + error.segment<2>(2 * i)});
    map_.emplace(std::move(mapped), 16.0, C);
    truth_ = {{0.5 * kSide_m, 0.5 * kSide_m, random_.uniform(-kPi, kPi)}};
    start_ = {.pose = truth_.front(), .covariance = Vector3(0.01, 0.01, 0.0025).asDiagonal()};
    start_.pose.x += random_.normal(0.1);
    start_.pose.y += random_.normal(0.1);
    start_.pose.heading += random_.normal(0.05);
    bias_rad_s_ = random_.normal(0.02);
  }

  /// What the robot records in so long.
  SlamInput drive(int seconds) {
    Recording recording;
    AlignedReadings readings;
    for (int k = 1; k <= kRate_hz * seconds; ++k) {
      readings.increments.push_back(step(k));
      const double time_s = static_cast<double>(k) / kRate_hz;
      const bool is_blind = time_s > scene_.blind_from_s && time_s < scene_.blind_to_s;
      if (k % kLookEvery == 0 && !is_blind) look_around(time_s, recording);
    }
    readings.bridged.assign(readings.increments.size(), false);
    return slam_input(recording, readings, robot_, {.names = names_});
  }
  LocalizerOptions options(LocalizerFilter filter) const {
    LocalizerOptions options{.filter = filter};
    if (scene_.is_start_known) options.start = start_;
    return options;
  }
  /// Squared in the covariance that it is stated with: χ² of 3 degrees of freedom.
  double nees_of(double time_s, const Pose2& pose, const Matrix3& covariance) const {
    const Pose2& truth = truth_[static_cast<std::size_t>(std::llround(time_s * kRate_hz))];
    const Vector3 error(pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.heading - truth.heading));
    return error.dot(covariance.ldlt().solve(error));
  }
  const KnownMap& map() const { return *map_; }
  const LandmarkSensor& sensor() const { return *robot_.landmark_sensor; }

 private:
  /// At 0.5 m/s, back to the middle where the edge comes near.
  Increment step(int k) {
    constexpr double kDt = 1.0 / kRate_hz;
    if (k % (2 * kRate_hz) == 1) rate_rad_s_ = random_.uniform(-0.5, 0.5);
    const Pose2 at = truth_.back();
    const Vector2 home(0.5 * kSide_m - at.x, 0.5 * kSide_m - at.y);
    double rate = rate_rad_s_;
    if (home.norm() > 0.3 * kSide_m)
      rate = std::clamp(wrap_angle(std::atan2(home.y(), home.x()) - at.heading), -0.6, 0.6);
    const double forward_m = 0.5 * kDt;
    const double skid_m = random_.normal(0.001 * std::sqrt(forward_m));
    const double turn = rate * kDt;
    const double middle = at.heading + 0.5 * turn;  // of the arc: its chord's direction
    truth_.push_back({at.x + forward_m * std::cos(middle) - skid_m * std::sin(middle),
                      at.y + forward_m * std::sin(middle) + skid_m * std::cos(middle), at.heading + turn});
    Increment increment;
    increment.time_s = kDt * k;
    increment.duration_s = kDt;
    for (std::size_t wheel = 0; wheel < 2; ++wheel) {
      const double travel_m = forward_m + (wheel == 0 ? -0.5 : 0.5) * kTrack_m * turn;
      const double rolled_m =
          travel_m + random_.normal(scene_.wheel_per_sqrt_m * std::sqrt(std::abs(travel_m)));
      increment.turned[wheel] = rolled_m / (kPi * kDiameter_m);
    }
    if (!scene_.has_gyro) return increment;
    increment.has_gyro = true;
    increment.gyro_rad =
        turn + bias_rad_s_ * kDt + random_.normal(robot_.chassis.gyro->noise_rad_s_sqrt_hz * std::sqrt(kDt));
    return increment;
  }

  /// At three landmarks in reach.
  void look_around(double time_s, Recording& recording) {
    constexpr int kAtOnce = 3;
    const Pose2& at = truth_.back();
    const Vector2 from(at.x + sensor().body_from_sensor.x * std::cos(at.heading),
                       at.y + sensor().body_from_sensor.x * std::sin(at.heading));
    int seen = 0;
    const std::size_t first = random_.below(kLandmarks);
    for (std::size_t n = 0; n < kLandmarks && seen < kAtOnce; ++n) {
      const std::size_t i = (first + n) % kLandmarks;
      const Vector2 apart = landmarks_[i] - from;
      if (apart.norm() > sensor().max_range_m) continue;
      ++seen;
      recording.sightings.push_back({time_s, scene_.is_named ? names_[i] : std::string(),
                                     apart.norm() + random_.normal(sensor().range_sigma_m),
                                     wrap_angle(std::atan2(apart.y(), apart.x()) - at.heading +
                                                random_.normal(sensor().bearing_sigma_rad))});
    }
  }

  MapScene scene_;
  Random random_;
  Robot robot_;
  std::vector<Vector2> landmarks_;  ///< where they are
  std::vector<std::string> names_;
  std::optional<KnownMap> map_;  ///< where they were measured to be
  std::vector<Pose2> truth_;     ///< at multiples of 1/kRate_hz
  PoseEstimate start_;
  double bias_rad_s_ = 0.0;
  double rate_rad_s_ = 0.0;
};

class UncertainMap : public testing::TestWithParam<MapScene> {};

TEST_P(UncertainMap, LeavesThePoseAsUncertainAsItIs) {
  const int runs = test::trials(20, 3);
  constexpr std::array<double, 3> kAt_s = {20.0, 40.0, 60.0};
  for (const LocalizerFilter filter : {LocalizerFilter::particles, LocalizerFilter::ekf}) {
    std::array<double, 3> nees{};
    for (int run = 1; run <= runs; ++run) {
      World world(GetParam(), static_cast<std::uint64_t>(run));
      const Localization found =
          localize(world.drive(60), world.map(), world.sensor(), world.options(filter));
      const auto& [poses, covariances] = found.trajectory;
      for (std::size_t i = 0; i < kAt_s.size(); ++i) {
        const auto at = std::ranges::lower_bound(poses, kAt_s[i] - 1e-6, {}, &StampedPose::time_s);
        ASSERT_NE(at, poses.end()) << run;
        nees[i] +=
            world.nees_of(at->time_s, at->pose, covariances[static_cast<std::size_t>(at - poses.begin())]);
      }
    }
    fmt::print("  {}: NEES {:.2f} {:.2f} {:.2f}\n", name_of(filter), nees[0] / runs, nees[1] / runs,
               nees[2] / runs);
    // 99.9 % of sums of consistent ones lie between these.
    for (const double sum : nees) {
      EXPECT_GT(sum, chi_squared_limit(0.9995, 3.0 * runs)) << name_of(filter);
      EXPECT_LT(sum, chi_squared_limit(0.0005, 3.0 * runs)) << name_of(filter);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    , UncertainMap,
    testing::Values(MapScene{.name = "independent"}, MapScene{.name = "without_gyro", .has_gyro = false},
                    MapScene{.name = "correlated", .is_correlated = true},
                    MapScene{
                        .name = "correlated_from_nowhere", .is_correlated = true, .is_start_known = false},
                    MapScene{.name = "without_names", .is_named = false, .is_start_known = false},
                    MapScene{.name = "blind", .has_gyro = false, .blind_from_s = 22, .blind_to_s = 38},
                    MapScene{.name = "blind_without_names",
                             .has_gyro = false,
                             .is_named = false,
                             .blind_from_s = 22,
                             .blind_to_s = 38,
                             .wheel_per_sqrt_m = 0.03}),
    [](const auto& test) { return std::string(test.param.name); });

// So vague after a blind stretch that a reading without a name may show any of several landmarks.
TEST(Localizer, TakesParticlesOnlyWhileOneGaussianWillNotDo) {
  const MapScene scene{.name = "",
                       .has_gyro = false,
                       .is_named = false,
                       .blind_from_s = 10,
                       .blind_to_s = 50,
                       .wheel_per_sqrt_m = 0.05};
  World world(scene, 1);
  const SlamInput input = world.drive(60);
  Localizer localizer(world.map(), world.sensor(), world.options(LocalizerFilter::particles));
  Localizer resumed(world.map(), world.sensor(), world.options(LocalizerFilter::particles));
  int with_particles = 0;
  for (const SlamStep& step : input.steps) {
    const std::size_t particles = localizer.step(step.motion, step.observations).particles;
    with_particles += particles > 0 ? 1 : 0;
    if (step.time_s < scene.blind_to_s) {
      EXPECT_EQ(particles, 0U) << step.time_s;
    }
    resume_state(resumed, state_of(localizer));
    EXPECT_TRUE(state_of(resumed) == state_of(localizer)) << step.time_s;
  }
  EXPECT_GT(with_particles, 0);
  EXPECT_EQ(localizer.step({}, {}).particles, 0U);
  EXPECT_TRUE(localizer.estimate());
}

}  // namespace
}  // namespace trundle::slam
