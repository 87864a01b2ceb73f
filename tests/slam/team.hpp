#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "trundle/slam/slam.hpp"
#include "trundle/slam/smoothing/together.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::test {
using namespace slam;

/// Of a pose and its covariance in world axes, as trajectories have it.
inline double pose_nees(const StampedPose& estimate, const Matrix3& covariance, const Pose2& truth) {
  const Vector3 e(truth.x - estimate.pose.x, truth.y - estimate.pose.y,
                  wrap_angle(truth.heading - estimate.pose.heading));
  return e.dot(covariance.ldlt().solve(e));
}

struct TeamOptions {
  int robots = 2;
  int steps = 60;
  int landmarks = 10;
  bool see_robots = true;
  int blind = -1;  ///< this robot sees no landmark
  Vector3 systematic_sigma = {0.01, 0.02, 0.01};
  double depth_share = 0.0;       ///< of all sensors
  Vector2 marker = {0.15, -0.1};  ///< on every body
  double metre_sigma = 0.0;       ///< of each robot
  std::uint64_t seed = 1;
};

/// Robots on circles about neighbouring centres, among landmarks: their readings, and the truth behind them.
/// The first starts at the world's origin.
struct Team {
  LandmarkSensor sensor{{0.2, 0.05, 0.1}, 0.05, radians(1.0), 7.0, 0.0};
  Vector2 marker;
  Vector3 systematic_sigma;
  double metre_sigma = 0.0;
  std::vector<Vector2> landmarks;
  std::vector<SlamInput> inputs;
  std::vector<std::vector<Pose2>> truth;  ///< by robot, after each step
  std::vector<RobotSighting> seen;
};

/// What the sensor reads of a place: as a camera does, whose ranges are depths by `depth_share`.
inline Observation reading_of(const LandmarkSensor& sensor, const Pose2& body, const Vector2& place,
                              LandmarkId id, Random& random) {
  const Vector2 ahead = (body * sensor.body_from_sensor).inverse() * place;
  const double bearing = std::atan2(ahead.y(), ahead.x());
  const double read = ahead.norm() * (1.0 - sensor.depth_share * (1.0 - std::cos(bearing)));
  return observation_of(sensor, id, read + random.normal(sensor.range_sigma_m),
                        wrap_angle(bearing + random.normal(sensor.bearing_sigma_rad)));
}

/// Near enough; by a camera, which reads depths, also not beside its picture.
inline bool is_seen(const LandmarkSensor& sensor, const Pose2& body, const Vector2& place) {
  constexpr double kHalfPicture_rad = 1.2;
  const Vector2 ahead = (body * sensor.body_from_sensor).inverse() * place;
  return ahead.norm() < sensor.max_range_m &&
         (sensor.depth_share == 0.0 || std::abs(std::atan2(ahead.y(), ahead.x())) < kHalfPicture_rad);
}

/// Each robot's ranges and ways are too long by a share, but not by one that all have in common.
inline void make_metres_differ(Team& team, Random& random) {
  const std::size_t robots = team.inputs.size();
  std::vector<double> metres;
  double in_common = 0.0;
  for (std::size_t r = 0; r < robots; ++r) {
    metres.push_back(random.normal(team.metre_sigma));
    in_common += metres.back() / static_cast<double>(robots);
  }
  for (std::size_t r = 0; r < robots; ++r) {
    const double longer = 1.0 + metres[r] - in_common;
    for (SlamStep& step : team.inputs[r].steps) {
      step.motion.mean.x *= longer;
      step.motion.mean.y *= longer;
      for (Observation& seen : step.observations) seen.range_m *= longer;
    }
    for (RobotSighting& sighting : team.seen)
      if (sighting.seer == r) sighting.observation.range_m *= longer;
  }
}

inline Team team_of(const TeamOptions& options = {}) {
  Team team{.marker = options.marker,
            .systematic_sigma = options.systematic_sigma,
            .metre_sigma = options.metre_sigma,
            .landmarks = {},
            .inputs = {},
            .truth = {},
            .seen = {}};
  team.sensor.depth_share = options.depth_share;
  Random random(options.seed, 91);
  for (int i = 0; i < options.landmarks; ++i)
    team.landmarks.emplace_back(random.uniform(-5.0, 7.0), random.uniform(-2.0, 8.0));
  Matrix3 Q = Matrix3::Zero();
  Q.diagonal() << std::pow(0.02, 2), std::pow(0.004, 2), std::pow(0.01, 2);
  for (int r = 0; r < options.robots; ++r) {
    Pose2 pose{1.5 * r, -0.5 * r, 2.0 * r};
    const double radius = (r % 2 == 0 ? 1.0 : -1.0) * (3.0 + 0.3 * r);
    const Twist2 twist{0.3, 0.0, 0.3 / radius};
    const Vector3 s(random.normal(options.systematic_sigma[0]), random.normal(options.systematic_sigma[1]),
                    random.normal(options.systematic_sigma[2]));
    SlamInput input;
    std::vector<Pose2> truth;
    for (int k = 0; k < options.steps; ++k) {
      const Twist2 really{twist.dx * (1.0 + s[0]), 0.0, twist.dtheta * (1.0 + s[1]) + twist.dx * s[2]};
      pose = pose * exp(really) * exp({random.normal(0.02), random.normal(0.004), random.normal(0.01)});
      truth.push_back(pose);
      SlamStep step{0.1 * (k + 1), motion_of(twist, Q), {}};
      for (std::size_t i = 0; i < team.landmarks.size() && r != options.blind; ++i)
        if (is_seen(team.sensor, pose, team.landmarks[i]))
          step.observations.push_back(
              reading_of(team.sensor, pose, team.landmarks[i], static_cast<LandmarkId>(i), random));
      input.steps.push_back(std::move(step));
    }
    for (int i = 0; i < options.landmarks; ++i) input.landmarks.push_back(std::to_string(i));
    team.inputs.push_back(std::move(input));
    team.truth.push_back(std::move(truth));
  }
  for (std::size_t a = 0; options.see_robots && a < team.truth.size(); ++a)
    for (std::size_t b = 0; b < team.truth.size(); ++b)
      for (std::size_t k = 0; k < team.truth[a].size(); ++k)
        if (a != b && (k + a) % 2 == 0 &&
            is_seen(team.sensor, team.truth[a][k], team.truth[b][k] * team.marker))
          team.seen.push_back({a, k, b, k,
                               reading_of(team.sensor, team.truth[a][k], team.truth[b][k] * team.marker,
                                          kUnknownLandmark, random)});
  if (options.metre_sigma > 0.0) make_metres_differ(team, random);
  return team;
}

/// Each robot as it is found alone, in a frame of its own.
inline std::vector<RobotRecording> recordings_of(const Team& team) {
  std::vector<RobotRecording> robots;
  for (std::size_t i = 0; i < team.inputs.size(); ++i) {
    const SlamInput& input = team.inputs[i];
    RobotRecording robot{.input = input,
                         .sensor = team.sensor,
                         .prior = {.systematic_sigma = team.systematic_sigma},
                         .name = "robot " + std::to_string(i),
                         .metre_sigma = team.metre_sigma,
                         .marker_on_body = team.marker};
    if (input.observations() == 0) {
      Pose2 pose;
      for (const SlamStep& step : input.steps) {
        pose = pose * step.motion.mean;
        robot.path.poses.push_back({step.time_s, pose});
        robot.shown.emplace_back();
      }
    } else {
      const SlamPrior prior{.systematic_sigma = team.systematic_sigma};
      SmoothedSlam alone =
          smooth(input, team.sensor,
                 trundle::slam::slam(input, team.sensor, {.method = SlamMethod::smoother, .prior = prior}),
                 {.prior = prior});
      robot.shown = std::move(alone.shown);
      robot.path = std::move(alone.trajectory);
      robot.systematic = alone.last.systematic;
    }
    robots.push_back(std::move(robot));
  }
  return robots;
}

}  // namespace trundle::test
