#include "trundle/slam/smoothing/together.hpp"

#include <functional>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/together/robust_alignment.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"
#include "slam/team.hpp"

namespace trundle::slam {
namespace {

using testing::HasSubstr;

double nees_of_map(const JointSlam& joint, const std::vector<Vector2>& truth) {
  Eigen::VectorXd e(2 * static_cast<Eigen::Index>(joint.map.size()));
  for (std::size_t i = 0; i < joint.map.size(); ++i)
    e.segment<2>(2 * static_cast<Eigen::Index>(i)) =
        joint.map[i].position - truth[static_cast<std::size_t>(joint.map[i].id)];
  return e.dot(joint.map_covariance.ldlt().solve(e));
}

double worst_distance(const Trajectory& path, const std::vector<Pose2>& truth) {
  double worst = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    worst = std::max(worst, (path.poses[k].pose.translation() - truth[k].translation()).norm());
  return worst;
}

TEST(RobotResidual, DerivativesAreThoseOfSmallMoves) {
  SmoothingProblem problem;
  problem.sensors = {LandmarkSensor{{0.2, -0.1, 0.7}, 0.1, 0.02, 10.0, 0.0}};
  problem.sensors[0].depth_share = 0.9;
  Random random(5, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const auto any = [&] {
      return Pose2{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-9.0, 9.0)};
    };
    const RobotLink link{0, 1, {kUnknownLandmark, 3.0, random.uniform(-1.0, 1.0)}, 0, {0.3, -0.2}, 0.2};
    const SmoothingState here{{any(), any()}, {}, {}};
    const RobotResidual r = robot_residual(problem, link, here);
    constexpr double kSmall = 1e-6;
    for (std::size_t pose = 0; pose < 2; ++pose)
      for (int i = 0; i < 3; ++i) {
        const auto error = [&](double by) {
          SmoothingState there = here;
          there.poses[pose] = moved_by(by * Vector3::Unit(i), here.poses[pose]);
          return robot_residual(problem, link, there).error;
        };
        const Vector2 numeric = (error(kSmall) - error(-kSmall)) / (2.0 * kSmall);
        const Vector2 analytic = (pose == 0 ? r.by_pose : r.by_seen).col(i);
        EXPECT_LT((numeric - analytic).norm(), 1e-5 * (1.0 + analytic.norm()));
      }
  }
}

/// Everything in one dense vector, derivatives by differences: [robot, step] poses, landmarks, systematic
/// errors, and by how much the metres of two robots differ.
class DenseTogether {
 public:
  explicit DenseTogether(const test::Team& team) : team_(team) {}

  Eigen::VectorXd start() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(size());
    for (std::size_t r = 0; r < team_.truth.size(); ++r)
      for (std::size_t k = 0; k < steps(); ++k) {
        const Pose2& pose = team_.truth[r][k];
        x.segment<3>(at(r, k)) << pose.x, pose.y, pose.heading;
      }
    for (std::size_t i = 0; i < team_.landmarks.size(); ++i) x.segment<2>(landmark(i)) = team_.landmarks[i];
    return x;
  }

  Eigen::VectorXd residuals(const Eigen::VectorXd& x) const {
    std::vector<double> all;
    std::vector<bool> is_seen(team_.landmarks.size(), false);
    for (std::size_t r = 0; r < team_.inputs.size(); ++r) {
      const Vector3 p = x.segment<3>(parameters(r));
      for (Eigen::Index i = 0; i < 3; ++i) all.push_back(p[i] / team_.systematic_sigma[i]);
      for (std::size_t k = 0; k < steps(); ++k) {
        const SlamStep& step = team_.inputs[r].steps[k];
        for (const Observation& seen : step.observations) {
          const auto number = static_cast<std::size_t>(seen.landmark);
          is_seen[number] = true;
          see(pose(x, r, k), x.segment<2>(landmark(number)), metre(x, r), seen, all);
        }
        if (r > 0 && k == 0) continue;  // nobody knows where it starts
        const Pose2 from = k == 0 ? Pose2{} : pose(x, r, k - 1);
        const Pose2& mean = step.motion.mean;
        const Vector2 ahead = metre(x, r) * (rotation(-mean.heading) * mean.translation());
        const Vector3 e = log(mean.inverse() * (from.inverse() * pose(x, r, k))).vector() -
                          step.motion.by_systematic * p + Vector3(ahead.x(), ahead.y(), 0.0);
        for (Eigen::Index i = 0; i < 3; ++i)
          all.push_back(e[i] / std::sqrt(step.motion.covariance(i, i) + 1e-12));
      }
    }
    for (const RobotSighting& sighting : team_.seen)
      see(pose(x, sighting.seer, sighting.seer_step),
          pose(x, sighting.seen, sighting.seen_step) * team_.marker, metre(x, sighting.seer),
          sighting.observation, all);
    all.push_back(x[size() - 1]);
    for (std::size_t i = 0; i < is_seen.size(); ++i)  // what nobody saw is anywhere, and ties nothing
      for (Eigen::Index axis = 0; axis < 2 && !is_seen[i]; ++axis)
        all.push_back(x[landmark(i) + axis] - team_.landmarks[i][axis]);
    return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
  }

  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const {
    constexpr double kSmall = 1e-6;
    Eigen::MatrixXd J(residuals(x).size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::VectorXd by = kSmall * Eigen::VectorXd::Unit(x.size(), i);
      J.col(i) = (residuals(x + by) - residuals(x - by)) / (2.0 * kSmall);
    }
    return J;
  }

  Eigen::Index at(std::size_t robot, std::size_t step) const {
    return 3 * static_cast<Eigen::Index>(robot * steps() + step);
  }
  Eigen::Index landmark(std::size_t i) const {
    return at(team_.inputs.size(), 0) + 2 * static_cast<Eigen::Index>(i);
  }
  Eigen::Index parameters(std::size_t robot) const {
    return landmark(team_.landmarks.size()) + 3 * static_cast<Eigen::Index>(robot);
  }
  /// By what that of a robot is off.
  double metre(const Eigen::VectorXd& x, std::size_t robot) const {
    return (robot == 0 ? 1.0 : -1.0) * team_.metre_sigma / std::sqrt(2.0) * x[size() - 1];
  }

 private:
  std::size_t steps() const { return team_.truth.front().size(); }
  Eigen::Index size() const { return parameters(team_.inputs.size()) + 1; }
  Pose2 pose(const Eigen::VectorXd& x, std::size_t robot, std::size_t step) const {
    const Eigen::Index i = at(robot, step);
    return {x[i], x[i + 1], x[i + 2]};
  }
  void see(const Pose2& body, const Vector2& place, double metre, const Observation& seen,
           std::vector<double>& all) const {
    const LandmarkSensor& sensor = team_.sensor;
    const Vector2 ahead = (body * sensor.body_from_sensor).inverse() * place;
    const double bearing = std::atan2(ahead.y(), ahead.x());
    const double depth =
        (1.0 + metre) * ahead.norm() * (1.0 - sensor.depth_share * (1.0 - std::cos(bearing)));
    const double read = seen.range_m * (1.0 - sensor.depth_share * (1.0 - std::cos(seen.bearing_rad)));
    all.push_back((read - depth) / sensor.range_sigma_m);
    all.push_back(wrap_angle(seen.bearing_rad - bearing) / sensor.bearing_sigma_rad);
  }

  const test::Team& team_;
};

/// Cameras that read depths, of landmarks and of each other: estimate and covariance of everything.
void expect_dense_least_squares(double metre_sigma) {
  const test::Team team = test::team_of(
      {.robots = 2, .steps = 8, .landmarks = 20, .depth_share = 1.0, .metre_sigma = metre_sigma, .seed = 4});
  ASSERT_FALSE(team.seen.empty());
  for (const SlamInput& input : team.inputs)  // so that every step is an unknown, as here
    for (const SlamStep& step : input.steps) ASSERT_FALSE(step.observations.empty());
  const DenseTogether dense(team);
  Eigen::VectorXd x = dense.start();
  Eigen::MatrixXd J;
  for (int i = 0; i < 30; ++i) {
    J = dense.jacobian(x);
    x -= (J.transpose() * J).ldlt().solve(J.transpose() * dense.residuals(x));
  }
  const Eigen::MatrixXd covariance = (J.transpose() * J).inverse();
  std::vector<RobotRecording> robots = test::recordings_of(team);
  for (RobotRecording& robot : robots) robot.systematic = Vector3::Zero();  // motions are linear about these
  const JointSlam joint = smooth_together(robots, team.seen, {.gate = 1e9, .enough = 1e-14});
  for (std::size_t r = 0; r < 2; ++r)
    for (std::size_t k = 0; k < 8; ++k) {
      const Eigen::Index i = dense.at(r, k);
      const Pose2& pose = joint.robots[r].trajectory.poses[k].pose;
      EXPECT_NEAR(pose.x, x[i], 1e-5);
      EXPECT_NEAR(pose.y, x[i + 1], 1e-5);
      EXPECT_NEAR(wrap_angle(pose.heading - x[i + 2]), 0.0, 1e-5);
      const Matrix3 expected = covariance.block<3, 3>(i, i);
      EXPECT_LT((joint.robots[r].trajectory.covariances[k] - expected).norm(), 1e-3 * expected.norm());
    }
  for (std::size_t a = 0; a < joint.map.size(); ++a) {
    const Eigen::Index i = dense.landmark(static_cast<std::size_t>(joint.map[a].id));
    EXPECT_LT((joint.map[a].position - x.segment<2>(i)).norm(), 1e-5);
    for (std::size_t b = 0; b < joint.map.size(); ++b) {
      const Eigen::Index j = dense.landmark(static_cast<std::size_t>(joint.map[b].id));
      const Matrix2 block = joint.map_covariance.block<2, 2>(2 * static_cast<Eigen::Index>(a),
                                                             2 * static_cast<Eigen::Index>(b));
      const Matrix2 expected = covariance.block<2, 2>(i, j);
      const Matrix2 own = covariance.block<2, 2>(i, i);
      EXPECT_LT((block - expected).norm(), 1e-3 * own.norm());
    }
  }
  for (std::size_t r = 0; r < 2; ++r) {
    const Vector3 sigma = covariance.diagonal().segment<3>(dense.parameters(r)).cwiseSqrt();
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(joint.robots[r].last.systematic[i], x[dense.parameters(r) + i], 1e-5);
      EXPECT_NEAR(std::sqrt(joint.robots[r].last.systematic_covariance(i, i)), sigma[i], 1e-3 * sigma[i]);
    }
  }
  for (std::size_t r = 0; r < 2; ++r) EXPECT_NEAR(joint.robots[r].metre, dense.metre(x, r), 1e-6);
  const double metre_variance = covariance.diagonal().tail(1)[0] * metre_sigma * metre_sigma / 2.0;
  EXPECT_NEAR(joint.robots[0].metre_sigma, std::sqrt(metre_variance), 1e-3 * metre_sigma);
}

TEST(Together, IsWhatDenseLeastSquaresOverAllStatesGives) {
  expect_dense_least_squares(0.0);
  expect_dense_least_squares(0.02);
}

/// Sums of squared errors in their covariances over many worlds.
struct ErrorsTogether {
  double pose = 0.0;  ///< of the last robot, half-way and at the end
  double of_map = 0.0;
  int poses = 0, landmarks = 0;
  double worst_m = 0.0;
};

ErrorsTogether consistency_of(test::TeamOptions options, int trials) {
  ErrorsTogether sum;
  for (int trial = 0; trial < trials; ++trial) {
    options.seed = static_cast<std::uint64_t>(trial) + 100;
    const test::Team team = test::team_of(options);
    const JointSlam joint = smooth_together(test::recordings_of(team), team.seen);
    const Trajectory& last = joint.robots.back().trajectory;
    sum.pose += test::pose_nees(last.poses.back(), last.covariances.back(), team.truth.back().back());
    ++sum.poses;
    sum.of_map += nees_of_map(joint, team.landmarks);
    sum.landmarks += static_cast<int>(joint.map.size());
    sum.worst_m = std::max(sum.worst_m, worst_distance(last, team.truth.back()));
  }
  return sum;
}

/// 99.9 % of sums of consistent ones lie between.
void expect_consistent(double sum, int freedom) {
  EXPECT_GT(sum, chi_squared_limit(0.9995, freedom));
  EXPECT_LT(sum, chi_squared_limit(0.0005, freedom));
}

TEST(Together, ErrorsAreAsLargeAsItsCovariancesSay) {
  for (const bool see_robots : {false, true}) {
    const ErrorsTogether sum = consistency_of({.robots = 3, .see_robots = see_robots}, test::trials(60, 8));
    expect_consistent(sum.pose, 3 * sum.poses);
    expect_consistent(sum.of_map, 2 * sum.landmarks);
  }
}

TEST(Together, ErrorsOfCamerasAreAsLargeAsItsCovariancesSay) {
  const ErrorsTogether sum = consistency_of({.robots = 2, .depth_share = 1.0}, test::trials(60, 8));
  expect_consistent(sum.pose, 3 * sum.poses);
  expect_consistent(sum.of_map, 2 * sum.landmarks);
}

TEST(Together, ErrorsOfRobotsWhoseMetresDifferAreAsLargeAsItsCovariancesSay) {
  const ErrorsTogether sum = consistency_of({.robots = 3, .metre_sigma = 0.03}, test::trials(60, 8));
  expect_consistent(sum.pose, 3 * sum.poses);
  expect_consistent(sum.of_map, 2 * sum.landmarks);
}

TEST(Together, PlacesARobotThatSawNoLandmark) {
  const ErrorsTogether sum = consistency_of({.robots = 3, .blind = 2}, test::trials(60, 8));
  expect_consistent(sum.pose, 3 * sum.poses);
  EXPECT_LT(sum.worst_m, 0.5);
}

// Its own start is then the frame: the map turns with it.
TEST(Together, TakesTheFirstRobotsStartForTheFrameThoughItSawNoLandmark) {
  const test::Team team = test::team_of({.robots = 2, .blind = 0, .seed = 7});
  std::vector<RobotRecording> robots = test::recordings_of(team);
  const Pose2 start{3.0, -2.0, 1.0};
  robots.front().prior.start = start;
  const JointSlam joint = smooth_together(robots, team.seen);
  std::vector<Pose2> moved;
  for (const Pose2& pose : team.truth[1]) moved.push_back(start * pose);
  EXPECT_LT(worst_distance(joint.robots[1].trajectory, moved), 1.0);
  EXPECT_NEAR(joint.robots[0].trajectory.poses.front().pose.x, start.x, 0.5);
}

TEST(Together, IsSurerThanEachAlone) {
  const test::Team team = test::team_of({.robots = 3, .seed = 11});
  const std::vector<RobotRecording> robots = test::recordings_of(team);
  const JointSlam joint = smooth_together(robots, team.seen);
  const JointSlam alone = smooth_together(std::span(robots).first(1), {});
  EXPECT_LT(joint.map_covariance.trace(), alone.map_covariance.trace());
  EXPECT_LT(joint.robots[0].last.covariance.trace(), alone.robots[0].last.covariance.trace());
}

TEST(Together, SurvivesNamesThatAreWrong) {
  test::Team team = test::team_of({.robots = 2, .seed = 5});
  for (SlamStep& step : team.inputs[1].steps)
    for (Observation& seen : step.observations)
      if (seen.landmark == 0 || seen.landmark == 1) seen.landmark = 1 - seen.landmark;
  std::vector<RobotSighting> seen = team.seen;
  for (std::size_t i = 0; i < seen.size(); i += 7) seen[i].observation.bearing_rad += 1.0;
  const JointSlam joint = smooth_together(test::recordings_of(team), seen);
  EXPECT_LT(worst_distance(joint.robots[0].trajectory, team.truth[0]), 0.5);
  EXPECT_LT(worst_distance(joint.robots[1].trajectory, team.truth[1]), 0.5);
  EXPECT_GT(joint.robots[0].robot_outliers + joint.robots[1].robot_outliers, seen.size() / 10);
}

void keep_landmarks(SlamInput& input, const std::function<bool(LandmarkId)>& kept) {
  for (SlamStep& step : input.steps)
    std::erase_if(step.observations, [&](const Observation& seen) { return !kept(seen.landmark); });
}

std::string reason(const test::Team& team) {
  try {
    (void)smooth_together(test::recordings_of(team), team.seen);
  } catch (const CannotAnswer& error) {
    return error.what();
  }
  return "";
}

TEST(Together, SaysThatThereIsNoOverlap) {
  test::Team team = test::team_of({.robots = 2, .see_robots = false, .seed = 3});
  keep_landmarks(team.inputs[0], [](LandmarkId id) { return id < 5; });
  keep_landmarks(team.inputs[1], [](LandmarkId id) { return id >= 5; });
  EXPECT_THAT(reason(team), HasSubstr("robot 1: no overlap"));
}

TEST(Together, SaysThatOneLandmarkDoesNotTellHowFramesAreTurned) {
  test::Team team = test::team_of({.robots = 2, .see_robots = false, .seed = 3});
  keep_landmarks(team.inputs[0], [](LandmarkId id) { return id <= 5; });
  keep_landmarks(team.inputs[1], [](LandmarkId id) { return id >= 5; });
  EXPECT_THAT(reason(team), HasSubstr("robot 1: what it shares with robot 0"));
}

// What the last one shares with the first, one landmark, does not tell how it is turned: the robot between
// them, which sees the first and is seen by the last, is placed before it, with landmarks of its own or none.
TEST(Together, PlacesARobotByOthersWhereOneLandmarkIsNotEnough) {
  for (const int blind : {-1, 1}) {
    test::Team team = test::team_of({.robots = 3, .landmarks = 24, .blind = blind, .seed = 3});
    const auto sees = [&](std::size_t robot, LandmarkId id) {
      return std::ranges::any_of(team.inputs[robot].steps, [&](const SlamStep& step) {
        return std::ranges::count(step.observations, id, &Observation::landmark) > 0;
      });
    };
    LandmarkId shared = 0;
    while (shared < 24 && !(sees(0, shared) && sees(2, shared))) ++shared;
    ASSERT_LT(shared, 24);
    keep_landmarks(team.inputs[0], [&](LandmarkId id) { return id == shared || id % 3 == 0; });
    keep_landmarks(team.inputs[1], [&](LandmarkId id) { return id != shared && id % 3 == 1; });
    keep_landmarks(team.inputs[2], [&](LandmarkId id) { return id == shared || id % 3 == 2; });
    std::erase_if(team.seen, [](const RobotSighting& sighting) {
      return !(sighting.seer == 1 && sighting.seen == 0) && !(sighting.seer == 2 && sighting.seen == 1);
    });
    EXPECT_EQ(reason(team), "");
    const JointSlam joint = smooth_together(test::recordings_of(team), team.seen);
    for (std::size_t robot = 0; robot < 3; ++robot)
      EXPECT_LT(worst_distance(joint.robots[robot].trajectory, team.truth[robot]), 0.5) << robot;
    team.seen.clear();
    EXPECT_THAT(reason(team), HasSubstr("robot 2: what it shares with robot 0"));
  }
}

/// The second of two robots sees one landmark only as it starts and another only as it ends: how far apart
/// they are, which the first knows, is right for two errors of its odometry.
test::Team team_with_two_glimpses(std::uint64_t seed) {
  test::Team team = test::team_of({.robots = 2,
                                   .landmarks = 20,
                                   .see_robots = false,
                                   .systematic_sigma = {0.01, 0.3, 0.01},
                                   .seed = seed});
  std::vector<SlamStep>& steps = team.inputs[1].steps;
  const auto glimpse = [&](std::size_t from, std::size_t to, LandmarkId other) {
    LandmarkId only = kUnknownLandmark;
    for (std::size_t k = from; k < to; ++k)
      for (const Observation& seen : steps[k].observations)
        if (only == kUnknownLandmark && seen.landmark != other) only = seen.landmark;
    for (std::size_t k = from; k < to; ++k)
      std::erase_if(steps[k].observations, [&](const Observation& seen) { return seen.landmark != only; });
    return only;
  };
  const LandmarkId first = glimpse(0, 5, kUnknownLandmark);
  glimpse(steps.size() - 5, steps.size(), first);
  for (std::size_t k = 5; k + 5 < steps.size(); ++k) steps[k].observations.clear();
  return team;
}

// One in five draws has two such places: none of 30, once in a thousand.
TEST(Together, IsNotSureOfOneOfTwoPlacesThatExplainWhatIsShared) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  int ambiguous = 0;
  for (std::uint64_t seed = 10; seed < 40; ++seed) {
    const test::Team team = team_with_two_glimpses(seed);
    const std::string why = reason(team);
    if (why.empty()) {
      const JointSlam joint = smooth_together(test::recordings_of(team), team.seen);
      const Trajectory& path = joint.robots[1].trajectory;
      const double error = (path.poses.back().pose.translation() - team.truth[1].back().translation()).norm();
      const double sigma = std::sqrt(path.covariances.back().topLeftCorner<2, 2>().trace());
      EXPECT_LT(error, 5.0 * sigma) << seed;
      continue;
    }
    ambiguous += why.find("robot 1: ambiguous") != std::string::npos ? 1 : 0;
  }
  EXPECT_GT(ambiguous, 0);
}

// Where paths tell well how frames are turned there is one minimum, and none other is sought.
TEST(Together, StartsOnceWhereFramesAreSure) {
  const test::Team team = test::team_of({.robots = 3, .see_robots = false, .seed = 11});
  EXPECT_EQ(smooth_together(test::recordings_of(team), team.seen).counts.starts, 1u);
}

// Robots that stand are bound so stiffly to where they are that the system may be singular to the last digit.
TEST(Together, SaysThatARobotSeenAtOnePlaceDoesNotTellHowFramesAreTurned) {
  test::Team team = test::team_of({.robots = 2, .landmarks = 24, .seed = 3});
  keep_landmarks(team.inputs[0], [](LandmarkId id) { return id < 12; });
  keep_landmarks(team.inputs[1], [](LandmarkId id) { return id >= 12; });
  Random random(3, 7);
  for (std::size_t robot = 0; robot < 2; ++robot)
    for (std::size_t k = 1; k < 30; ++k) {
      team.inputs[robot].steps[k].motion = motion_of({}, Matrix3::Zero());
      team.inputs[robot].steps[k].observations.clear();
    }
  team.seen.clear();
  for (std::size_t k = 1; k < 30; k += 5)
    team.seen.push_back({1, k, 0, k, {kUnknownLandmark, 5.0 + random.normal(0.05), random.normal(0.02)}});
  EXPECT_THAT(reason(team), HasSubstr("robot 1: what it shares with"));
}

TEST(RobustRigidMotion, IsThatOfTheLargerHalf) {
  const Pose2 motion{2.0, -1.0, 2.5};
  Random random(2, 3);
  std::vector<PointPair> pairs;
  for (int i = 0; i < 11; ++i) {
    const Vector2 from(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
    const Vector2 wrong =
        i < 5 ? Vector2(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0)) : Vector2::Zero();
    pairs.push_back({from, motion * from + wrong});
  }
  const auto found = robust_rigid_motion(pairs);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x, motion.x, 1e-9);
  EXPECT_NEAR(found->y, motion.y, 1e-9);
  EXPECT_NEAR(wrap_angle(found->heading - motion.heading), 0.0, 1e-9);
  EXPECT_FALSE(robust_rigid_motion(std::span(pairs).first(1)));
}

}  // namespace
}  // namespace trundle::slam
