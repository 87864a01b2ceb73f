#include "trundle/slam/fastslam/loop_closing.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::slam {
namespace {

Matrix2 covariance(double xx, double xy, double yy) {
  return (Matrix2() << xx, xy, xy, yy).finished();
}

/// What a rigid fit minimises, written down without any of its derivatives.
double cost_of(const std::vector<Revisit>& revisits, const Vector2& centre, const Matrix3& prior,
               const Vector3& twist) {
  double cost = twist.dot(prior.inverse() * twist);
  const Pose2 motion = exp(Twist2::from(twist));
  for (const Revisit& s : revisits) {
    const Vector2 apart = s.mapped - centre - motion * Vector2(s.seen - centre);
    cost += apart.dot((s.mapped_covariance + s.seen_covariance).inverse() * apart);
  }
  return cost;
}

/// Minimum of the cost, by Newton's method with differences in place of derivatives; its curvature is twice
/// the information. Readings are as unsure in all directions, so turning them changes nothing.
TEST(LoopClosing, RigidFitIsTheMinimum) {
  const Vector2 centre(400.0, -300.0);
  const Matrix3 prior = Vector3(9.0, 4.0, 0.04).asDiagonal();
  const Vector3 truth(-2.0, 3.0, 0.3);
  Random random(3, 1);
  std::vector<Revisit> revisits;
  for (int i = 0; i < 7; ++i) {
    const Vector2 arm(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0));
    const Vector2 noise(random.normal(0.1), random.normal(0.1));
    revisits.push_back({i, centre + arm, 0.01 * Matrix2::Identity(),
                        centre + exp(Twist2::from(truth)) * arm + noise, covariance(0.02, 0.01, 0.03)});
  }
  const LoopCorrection::Move move = rigid_fit(revisits, centre, prior);
  const double h = 1e-4;
  const auto cost = [&](const Vector3& further) {
    return cost_of(revisits, centre, prior, move.twist + further);
  };
  Matrix3 curvature;
  for (int i = 0; i < 3; ++i) {
    const Vector3 di = h * Vector3::Unit(i);
    const double slope = (cost(di) - cost(-di)) / (2.0 * h);
    EXPECT_NEAR(slope * std::sqrt(move.covariance(i, i)), 0.0, 1e-4) << i;  // of one sigma
    for (int j = 0; j < 3; ++j) {
      const Vector3 dj = h * Vector3::Unit(j);
      curvature(i, j) = (cost(di + dj) - cost(di - dj) - cost(dj - di) + cost(-di - dj)) / (4.0 * h * h);
    }
  }
  EXPECT_LT((0.5 * curvature * move.covariance - Matrix3::Identity()).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_LT((move.twist - truth).dot(move.covariance.inverse() * (move.twist - truth)),
            chi_squared_limit(1e-3, 3.0));
}

/// Errors that add up along a way, each a shift and a turn where the robot was.
struct Walk {
  static constexpr int kSubmaps = 40;
  Vector2 centre{5.0, 2.0};
  std::vector<Vector2> places;
  std::vector<Matrix3> increments;      ///< their covariances about the centre
  std::vector<FrameCovariance> drifts;  ///< up to each submap

  Walk() {
    FrameCovariance drift;
    for (int k = 0; k < kSubmaps; ++k) {
      const double angle = 2.0 * kPi * k / kSubmaps;
      places.emplace_back(20.0 * std::sin(angle), 20.0 - 20.0 * std::cos(angle));
      const FrameCovariance increment{places.back(), Vector3(0.01, 0.003, 0.0004).asDiagonal()};
      increments.push_back(increment.about(centre).covariance);
      drift = drift.about(places.back());
      drift.covariance += increment.covariance;
      drifts.push_back(drift);
    }
  }
};

/// What is expected of a submap in between, given the whole drift, leaves an error that the whole does not
/// explain, and whose covariance is what is said to be open.
TEST(LoopClosing, SubmapsFollowAsIsToBeExpected) {
  const Walk walk;
  const int old = 4;
  const int between = 22;
  const Submap then{walk.drifts[old], walk.drifts[old]};
  const Submap now{walk.drifts.back(), walk.drifts.back()};
  const auto correction = LoopCorrection::between(then, now, {walk.centre});
  ASSERT_TRUE(correction);
  const Matrix3 share = correction->share(walk.drifts[between]);
  const int trials = test::trials(20000, 2000);
  Matrix3 of_whole = Matrix3::Zero();
  Matrix3 left = Matrix3::Zero();
  Matrix3 mixed = Matrix3::Zero();
  Random random(8, 2);
  for (int trial = 0; trial < trials; ++trial) {
    Vector3 at_submap = Vector3::Zero();
    Vector3 whole = Vector3::Zero();
    for (int k = old + 1; k < Walk::kSubmaps; ++k) {
      const Eigen::LLT<Matrix3> root(walk.increments[static_cast<std::size_t>(k)]);
      whole += root.matrixL() * Vector3(random.normal(1.0), random.normal(1.0), random.normal(1.0));
      if (k == between) at_submap = whole;
    }
    const Vector3 error = at_submap - share * whole;
    of_whole += whole * whole.transpose() / trials;
    left += error * error.transpose() / trials;
    mixed += error * whole.transpose() / trials;
  }
  const Matrix3 open = correction->frame_after(walk.drifts[between]).covariance -
                       walk.drifts[old].about(walk.centre).covariance;
  const double wide = 5.0 / std::sqrt(trials);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(left(i, i) / open(i, i), 1.0, std::sqrt(2.0) * wide) << i;
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(mixed(i, j) / std::sqrt(left(i, i) * of_whole(j, j)), 0.0, wide) << i << j;
  }
}

TEST(LoopClosing, ThePresentFollowsWhollyAndTheOldNotAtAll) {
  const Walk walk;
  const Submap then{walk.drifts[10], walk.drifts[10]};
  const Submap now{walk.drifts.back(), walk.drifts.back()};
  const Matrix3 error = 1e-4 * Matrix3::Identity();
  const auto correction = LoopCorrection::between(then, now, {walk.centre, Vector3(1.0, 2.0, 0.1), error});
  ASSERT_TRUE(correction);
  EXPECT_LT((correction->share(walk.drifts.back()) - Matrix3::Identity()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(correction->share(walk.drifts[10]).isZero(0.0));
  EXPECT_TRUE(correction->share(walk.drifts[3]).isZero(1e-12));
  const Matrix3 left =
      correction->frame_after(walk.drifts.back()).covariance - then.frame.about(walk.centre).covariance;
  EXPECT_LT((left - error).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_FALSE(LoopCorrection::between(now, then, {walk.centre}));
}

/// Old landmarks that are seen again, five times each, from a robot that has drifted.
struct ReturningRobot {
  static constexpr double kSigma = 0.1;
  Submap old{{Vector2::Zero(), 1e-6 * Matrix3::Identity()}, {Vector2::Zero(), 1e-6 * Matrix3::Identity()}};
  Submap now{{Vector2::Zero(), Vector3(1.0, 1.0, 0.01).asDiagonal()},
             {Vector2::Zero(), Vector3(1.0, 1.0, 0.01).asDiagonal()}};
  Random random;
  std::vector<Vector2> landmarks;

  explicit ReturningRobot(std::uint64_t seed) : random(seed, 4) {
    for (int i = 0; i < 6; ++i) landmarks.emplace_back(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0));
  }
  Revisit seen(LandmarkId landmark, const Vector2& place, const Vector2& from) {
    const Vector2 noise(random.normal(kSigma), random.normal(kSigma));
    return {landmark,
            place + noise,
            kSigma * kSigma * Matrix2::Identity(),
            landmarks[static_cast<std::size_t>(landmark)],
            1e-4 * Matrix2::Identity(),
            old,
            from};
  }
  /// All of them at each of five keyframes, so far apart; some of the sightings are of something else.
  /// Nothing: no closing.
  std::optional<LoopCorrection> drive(const Pose2& drift, double share_wrong, double step_m = 2.0) {
    LoopClosing closing;
    for (int keyframe = 0; keyframe < 40; ++keyframe) closing.next_keyframe();
    for (int keyframe = 0; keyframe < 5; ++keyframe) {
      closing.next_keyframe();
      for (LandmarkId i = 0; i < 6; ++i) {
        const Vector2 place = random.uniform() < share_wrong
                                  ? Vector2(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0))
                                  : Vector2(drift.inverse() * landmarks[static_cast<std::size_t>(i)]);
        closing.add_rejected(seen(i, place, {step_m * keyframe, 0.0}), now);
      }
      if (auto correction = closing.close(now)) return correction;
    }
    return std::nullopt;
  }
};

TEST(LoopClosing, FindsTheDriftAmongWrongNames) {
  const int trials = test::trials(300, 40);
  int closed = 0;
  int beyond = 0;
  for (int trial = 0; trial < trials; ++trial) {
    ReturningRobot robot(static_cast<std::uint64_t>(trial));
    const Pose2 drift{robot.random.normal(1.4), robot.random.normal(1.4), robot.random.normal(0.14)};
    const auto correction = robot.drive(drift, 0.05);
    if (!correction) continue;
    ++closed;
    const Vector3 error = correction->twist(drift) - correction->move().twist;
    if (error.dot(correction->move().covariance.ldlt().solve(error)) > chi_squared_limit(0.05, 3.0)) ++beyond;
  }
  EXPECT_GT(closed, 0.9 * trials);
  // One in twenty, within 5 sigma; as many again where a wrong one was near enough to be believed.
  EXPECT_LT(beyond, 0.1 * closed + 5.0 * std::sqrt(0.05 * closed));
}

/// Where the robot stands still every landmark has been seen once, however often it is read.
TEST(LoopClosing, IsNotMadeOfReadingsFromOnePlace) {
  const Pose2 drift{1.0, -1.0, 0.1};
  for (std::uint64_t trial = 0; trial < 10; ++trial) {
    EXPECT_FALSE(ReturningRobot(trial).drive(drift, 0.0, 0.01)) << trial;
    EXPECT_TRUE(ReturningRobot(trial).drive(drift, 0.0)) << trial;
  }
}

/// Where nothing but wrong names is seen there is no drift to find.
TEST(LoopClosing, IsNotMadeOfWrongNames) {
  for (int trial = 0; trial < test::trials(500, 50); ++trial)
    EXPECT_FALSE(ReturningRobot(static_cast<std::uint64_t>(trial)).drive({}, 1.0)) << trial;
}

/// Two landmarks were carried away together, and the others, which fit when the robot comes back, stay in
/// view.
TEST(LoopClosing, IsNotMadeOfMovedLandmarks) {
  for (int trial = 0; trial < test::trials(200, 40); ++trial) {
    ReturningRobot robot(static_cast<std::uint64_t>(trial));
    const Vector2 by(robot.random.uniform(0.6, 1.5), robot.random.uniform(0.6, 1.5));
    LoopClosing closing;
    for (int keyframe = 0; keyframe < 40; ++keyframe) closing.next_keyframe();
    for (int keyframe = 0; keyframe < 100; ++keyframe) {
      closing.next_keyframe();
      const Vector2 from(2.0 * (keyframe % 10), 0.0);
      closing.add_rejected(robot.seen(0, robot.landmarks[0] + by, from), robot.now);
      closing.add_rejected(robot.seen(1, robot.landmarks[1] + by, from), robot.now);
      for (LandmarkId i = 2; i < 6; ++i)
        if (keyframe == 0)
          closing.add_matched(robot.seen(i, robot.landmarks[static_cast<std::size_t>(i)], from), robot.now);
        else
          closing.still_matched(i);
      EXPECT_FALSE(closing.close(robot.now));
    }
  }
}

/// Two landmarks that fit are a loop closed, unless more than one in three that came back do not.
TEST(LoopClosing, IsClosedWhereMostFit) {
  ReturningRobot robot(1);
  const Vector2 from(2.0, 1.0);
  LoopClosing closing;
  for (int keyframe = 0; keyframe < 40; ++keyframe) closing.next_keyframe();
  const auto fits = [&](LandmarkId i) {
    closing.add_matched(robot.seen(i, robot.landmarks[static_cast<std::size_t>(i)], from), robot.now);
  };
  const auto does_not = [&](LandmarkId i) {
    closing.add_rejected(
        robot.seen(i, robot.landmarks[static_cast<std::size_t>(i)] + Vector2(1.0, 1.0), from), robot.now);
  };
  fits(0);
  EXPECT_FALSE(closing.is_closed());
  fits(1);
  EXPECT_TRUE(closing.is_closed());
  does_not(2);
  EXPECT_TRUE(closing.is_closed());
  does_not(3);
  EXPECT_FALSE(closing.is_closed());
}

}  // namespace
}  // namespace trundle::slam
