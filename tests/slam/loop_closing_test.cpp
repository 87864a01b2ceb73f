#include "trundle/slam/particles/loop_closing.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/slam/particles/particle_slam.hpp"
#include "trundle/statistics/distribution.hpp"

#include "../../bench/w1.hpp"
#include "scale.hpp"
#include "slam/every_proposal.hpp"

namespace trundle {
namespace {

Matrix2 covariance(double xx, double xy, double yy) {
  return (Matrix2() << xx, xy, xy, yy).finished();
}

/// What a rigid fit minimises, written down without any of its derivatives.
double cost_of(const std::vector<SeenAgain>& again, const Vector2& centre, const Matrix3& prior,
               const Vector3& twist) {
  double cost = twist.dot(prior.inverse() * twist);
  const Pose2 motion = exp(Twist2::from(twist));
  for (const SeenAgain& s : again) {
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
  std::vector<SeenAgain> again;
  for (int i = 0; i < 7; ++i) {
    const Vector2 arm(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0));
    const Vector2 noise(random.normal(0.1), random.normal(0.1));
    again.push_back({i, centre + arm, 0.01 * Matrix2::Identity(),
                     centre + exp(Twist2::from(truth)) * arm + noise, covariance(0.02, 0.01, 0.03)});
  }
  const MapBend::Move move = rigid_fit(again, centre, prior);
  const double h = 1e-4;
  const auto cost = [&](const Vector3& further) {
    return cost_of(again, centre, prior, move.twist + further);
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
  static constexpr int kPieces = 40;
  Vector2 centre{5.0, 2.0};
  std::vector<Vector2> places;
  std::vector<Matrix3> increments;  ///< their covariances about the centre
  std::vector<MapDoubt> drifts;     ///< up to each piece

  Walk() {
    MapDoubt drift;
    for (int k = 0; k < kPieces; ++k) {
      const double angle = 2.0 * kPi * k / kPieces;
      places.emplace_back(20.0 * std::sin(angle), 20.0 - 20.0 * std::cos(angle));
      const MapDoubt increment{places.back(), Vector3(0.01, 0.003, 0.0004).asDiagonal()};
      increments.push_back(increment.about(centre).covariance);
      drift = drift.about(places.back());
      drift.covariance += increment.covariance;
      drifts.push_back(drift);
    }
  }
};

/// What is expected of a piece in between, given the whole drift, leaves an error that the whole does not
/// explain, and whose covariance is what is said to be open.
TEST(LoopClosing, PiecesFollowAsIsToBeExpected) {
  const Walk walk;
  const int old = 4;
  const int piece = 22;
  const PieceOfMap then{walk.drifts[old], walk.drifts[old]};
  const PieceOfMap now{walk.drifts.back(), walk.drifts.back()};
  const auto bend = MapBend::between(then, now, {walk.centre});
  ASSERT_TRUE(bend);
  const Matrix3 share = bend->share(walk.drifts[piece]);
  const int trials = test::trials(20000, 2000);
  Matrix3 of_whole = Matrix3::Zero();
  Matrix3 left = Matrix3::Zero();
  Matrix3 mixed = Matrix3::Zero();
  Random random(8, 2);
  for (int trial = 0; trial < trials; ++trial) {
    Vector3 at_piece = Vector3::Zero();
    Vector3 whole = Vector3::Zero();
    for (int k = old + 1; k < Walk::kPieces; ++k) {
      const Eigen::LLT<Matrix3> root(walk.increments[static_cast<std::size_t>(k)]);
      whole += root.matrixL() * Vector3(random.normal(1.0), random.normal(1.0), random.normal(1.0));
      if (k == piece) at_piece = whole;
    }
    const Vector3 error = at_piece - share * whole;
    of_whole += whole * whole.transpose() / trials;
    left += error * error.transpose() / trials;
    mixed += error * whole.transpose() / trials;
  }
  const Matrix3 open =
      bend->doubt_after(walk.drifts[piece]).covariance - walk.drifts[old].about(walk.centre).covariance;
  const double wide = 5.0 / std::sqrt(trials);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(left(i, i) / open(i, i), 1.0, std::sqrt(2.0) * wide) << i;
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(mixed(i, j) / std::sqrt(left(i, i) * of_whole(j, j)), 0.0, wide) << i << j;
  }
}

TEST(LoopClosing, ThePresentFollowsWhollyAndTheOldNotAtAll) {
  const Walk walk;
  const PieceOfMap then{walk.drifts[10], walk.drifts[10]};
  const PieceOfMap now{walk.drifts.back(), walk.drifts.back()};
  const Matrix3 error = 1e-4 * Matrix3::Identity();
  const auto bend = MapBend::between(then, now, {walk.centre, Vector3(1.0, 2.0, 0.1), error});
  ASSERT_TRUE(bend);
  EXPECT_LT((bend->share(walk.drifts.back()) - Matrix3::Identity()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(bend->share(walk.drifts[10]).isZero(0.0));
  EXPECT_TRUE(bend->share(walk.drifts[3]).isZero(1e-12));
  const Matrix3 left =
      bend->doubt_after(walk.drifts.back()).covariance - then.doubt.about(walk.centre).covariance;
  EXPECT_LT((left - error).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_FALSE(MapBend::between(now, then, {walk.centre}));
}

/// Landmarks of old that are seen again, five times each, from a robot that has drifted.
struct Again {
  static constexpr double kSigma = 0.1;
  PieceOfMap old{{Vector2::Zero(), 1e-6 * Matrix3::Identity()},
                 {Vector2::Zero(), 1e-6 * Matrix3::Identity()}};
  PieceOfMap now{{Vector2::Zero(), Vector3(1.0, 1.0, 0.01).asDiagonal()},
                 {Vector2::Zero(), Vector3(1.0, 1.0, 0.01).asDiagonal()}};
  Random random;
  std::vector<Vector2> landmarks;

  explicit Again(std::uint64_t seed) : random(seed, 4) {
    for (int i = 0; i < 6; ++i) landmarks.emplace_back(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0));
  }
  SeenAgain seen(LandmarkId landmark, const Vector2& place, const Vector2& from) {
    const Vector2 noise(random.normal(kSigma), random.normal(kSigma));
    return {landmark,
            place + noise,
            kSigma * kSigma * Matrix2::Identity(),
            landmarks[static_cast<std::size_t>(landmark)],
            1e-4 * Matrix2::Identity(),
            old,
            from};
  }
  /// All of them at each of five stations, so far apart; some of the sightings are of something else.
  /// Nothing: no closing.
  std::optional<MapBend> look(const Pose2& drift, double share_wrong, double step_m = 2.0) {
    LoopClosing closing;
    for (int station = 0; station < 40; ++station) closing.next_station();
    for (int station = 0; station < 5; ++station) {
      closing.next_station();
      for (LandmarkId i = 0; i < 6; ++i) {
        const Vector2 place = random.uniform() < share_wrong
                                  ? Vector2(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0))
                                  : Vector2(drift.inverse() * landmarks[static_cast<std::size_t>(i)]);
        closing.rejected(seen(i, place, {step_m * station, 0.0}), now);
      }
      if (auto bend = closing.close(now)) return bend;
    }
    return std::nullopt;
  }
};

TEST(LoopClosing, FindsTheDriftAmongWrongNames) {
  const int trials = test::trials(300, 40);
  int closed = 0;
  int beyond = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Again again(static_cast<std::uint64_t>(trial));
    const Pose2 drift{again.random.normal(1.4), again.random.normal(1.4), again.random.normal(0.14)};
    const auto bend = again.look(drift, 0.05);
    if (!bend) continue;
    ++closed;
    const Vector3 error = bend->twist(drift) - bend->move().twist;
    if (error.dot(bend->move().covariance.ldlt().solve(error)) > chi_squared_limit(0.05, 3.0)) ++beyond;
  }
  EXPECT_GT(closed, 0.9 * trials);
  // One in twenty, within 5 sigma; as many again where a wrong one was near enough to be believed.
  EXPECT_LT(beyond, 0.1 * closed + 5.0 * std::sqrt(0.05 * closed));
}

/// Where the robot stands still every landmark has been seen once, however often it is read.
TEST(LoopClosing, IsNotMadeOfReadingsFromOnePlace) {
  const Pose2 drift{1.0, -1.0, 0.1};
  for (std::uint64_t trial = 0; trial < 10; ++trial) {
    EXPECT_FALSE(Again(trial).look(drift, 0.0, 0.01)) << trial;
    EXPECT_TRUE(Again(trial).look(drift, 0.0)) << trial;
  }
}

/// Where nothing but wrong names is seen there is no drift to find.
TEST(LoopClosing, IsNotMadeOfWrongNames) {
  for (int trial = 0; trial < test::trials(500, 50); ++trial)
    EXPECT_FALSE(Again(static_cast<std::uint64_t>(trial)).look({}, 1.0)) << trial;
}

/// Two landmarks were carried away together, and the others, which fit when the robot comes back, stay in
/// view.
TEST(LoopClosing, IsNotMadeOfMovedLandmarks) {
  for (int trial = 0; trial < test::trials(200, 40); ++trial) {
    Again again(static_cast<std::uint64_t>(trial));
    const Vector2 by(again.random.uniform(0.6, 1.5), again.random.uniform(0.6, 1.5));
    LoopClosing closing;
    for (int station = 0; station < 40; ++station) closing.next_station();
    for (int station = 0; station < 100; ++station) {
      closing.next_station();
      const Vector2 from(2.0 * (station % 10), 0.0);
      closing.rejected(again.seen(0, again.landmarks[0] + by, from), again.now);
      closing.rejected(again.seen(1, again.landmarks[1] + by, from), again.now);
      for (LandmarkId i = 2; i < 6; ++i)
        if (station == 0)
          closing.matched(again.seen(i, again.landmarks[static_cast<std::size_t>(i)], from), again.now);
        else
          closing.still_matched(i);
      EXPECT_FALSE(closing.close(again.now));
    }
  }
}

/// Around a block of 157 m, twice, with 20 particles.
struct Block {
  static constexpr std::size_t kLap = 1000;
  bench::W1 work;
  ParticleSlamOptions options;

  explicit Block(std::uint64_t seed, Proposal proposal = Proposal::linearised, std::size_t particles = 20)
      : work(bench::w1({.seed = seed})),
        options{.proposal = proposal, .particles = particles, .seed = seed} {}
};

struct Drive {
  std::vector<std::size_t> closed;  ///< steps
  double error_m = 0.0;             ///< rms over the second lap
  double nees = 0.0;                ///< mean, likewise: 3 where honest
  double path_m = 0.0;              ///< rms of the best particle's path
  double first_lap_m = 0.0;         ///< rms online

  explicit Drive(const Block& block) : Drive(block, ParticleSlam(block.work.sensor, block.options)) {}
  Drive(const Block& block, ParticleSlam filter) {
    const bench::W1& work = block.work;
    for (std::size_t k = 0; k < work.steps.size(); ++k) {
      if (filter.step(work.steps[k].motion, work.steps[k].observations).closed_loop) closed.push_back(k);
      const PoseEstimate estimate = filter.estimate();
      const double square = (estimate.pose.translation() - work.truth[k].translation()).squaredNorm();
      if (k < Block::kLap) {
        first_lap_m += square / Block::kLap;
        continue;
      }
      const Vector3 e = log(estimate.pose.inverse() * work.truth[k]).vector();
      error_m += square / Block::kLap;
      nees += e.dot(body_covariance(estimate.pose, estimate.covariance).ldlt().solve(e)) / Block::kLap;
    }
    const std::vector<Pose2> path = filter.best_path();
    for (std::size_t k = 0; k < path.size(); ++k)
      path_m += (path[k].translation() - work.truth[k].translation()).squaredNorm() /
                static_cast<double>(path.size());
    for (double* square : {&error_m, &path_m, &first_lap_m}) *square = std::sqrt(*square);
  }
};

/// Errors of a run go together, so a run is one draw of three numbers. Some loops close without a bend; left
/// to themselves, more than one run in ten would end metres off.
TEST(ClosedLoop, IsAsWrongAsItSays) {
  const int runs = test::trials(40, 4);
  double nees = 0.0;
  int closed = 0;
  for (int seed = 1; seed <= runs; ++seed) {
    const Drive run{Block(static_cast<std::uint64_t>(seed))};
    closed += run.closed.empty() ? 0 : 1;
    EXPECT_LT(run.error_m, 1.0) << seed;
    EXPECT_LT(run.path_m, 1.0) << seed;
    nees += run.nees;
  }
  RecordProperty("nees", std::to_string(nees / runs));
  RecordProperty("closed", closed);
  EXPECT_LT(nees, chi_squared_limit(1e-3, 3.0 * runs));
  const bool is_enough = runs >= 20;
  EXPECT_TRUE(!is_enough || 10 * closed > runs) << closed;
}

class EveryProposalCloses : public testing::TestWithParam<Proposal> {};

TEST_P(EveryProposalCloses, TheLoop) {
  for (const std::uint64_t seed : {4, 7, 9}) {
    const Drive run(Block(seed, GetParam()));
    EXPECT_LT(run.error_m, 1.5) << seed;
  }
}
INSTANTIATE_TEST_SUITE_P(, EveryProposalCloses, test::every_proposal(), test::name_of_proposal);

/// One sighting in twenty bears another landmark's name; and what stands near the start was moved by 2 m in
/// the meantime.
TEST(ClosedLoop, SurvivesWrongNamesAndMovedLandmarks) {
  for (const std::uint64_t seed : {4, 9, 16}) {
    Block block(seed);
    Random random(seed, 9);
    LandmarkId moved = 0;
    for (std::size_t i = 0; i < block.work.landmarks.size(); ++i)
      if (block.work.landmarks[i].norm() < block.work.landmarks[static_cast<std::size_t>(moved)].norm())
        moved = static_cast<LandmarkId>(i);
    for (std::size_t k = 0; k < block.work.steps.size(); ++k)
      for (Observation& seen : block.work.steps[k].observations) {
        if (seen.landmark == moved && k > 500) {
          const Vector2 place = block.work.landmarks[static_cast<std::size_t>(moved)] + Vector2(2.0, 0.0);
          const ExpectedReading there = expected_reading(block.work.truth[k], {}, place);
          seen.range_m = there.range_m;
          seen.bearing_rad = there.bearing_rad;
        }
        if (random.uniform() < 0.05) seen.landmark = static_cast<LandmarkId>(random.uniform(0.0, 100.0));
      }
    const Drive run(block);
    EXPECT_LT(run.error_m, 1.5) << seed;
  }
}

/// In a room nothing is forgotten that a closing would have to find again, wrong names or not.
TEST(ClosedLoop, IsNoneInARoom) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    bench::W1 work = bench::w1({.landmarks = 20, .seed = seed});
    Random random(seed, 9);
    ParticleSlam filter(work.sensor, {.particles = 30, .seed = seed});
    for (SlamStep& step : work.steps) {
      for (Observation& seen : step.observations)
        if (random.uniform() < 0.05) seen.landmark = static_cast<LandmarkId>(random.uniform(0.0, 20.0));
      EXPECT_FALSE(filter.step(step.motion, step.observations).closed_loop);
    }
  }
}

/// The same bytes from a checkpoint in the middle of what leads to a closing, with other threads, and, but
/// for the path, without paths.
TEST(ClosedLoop, IsTheSameFromACheckpointAndWithThreads) {
  const Block few(4);
  const std::size_t at = Drive(few).closed.at(0);
  ParticleSlam whole(few.work.sensor, few.options);
  ParticleSlam resumed(few.work.sensor, few.options);
  ParticleSlamOptions other = few.options;
  other.threads = 3;
  other.keep_paths = false;
  ParticleSlam threaded(few.work.sensor, other);
  for (std::size_t k = 0; k < at + 200; ++k) {
    const SlamStep& step = few.work.steps[k];
    whole.step(step.motion, step.observations);
    threaded.step(step.motion, step.observations);
    if (k > at - 1) resumed.step(step.motion, step.observations);
    if (k == at - 1) resume_state(resumed, state_of(whole));
  }
  EXPECT_EQ(state_of(whole), state_of(resumed));
  const auto poses = whole.poses();
  const auto others = threaded.poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].x, others[i].x);
    EXPECT_EQ(poses[i].heading, others[i].heading);
  }
  EXPECT_EQ(whole.estimate().covariance, threaded.estimate().covariance);
  for (std::size_t i = 0; i < whole.landmarks(); ++i)
    EXPECT_EQ(whole.landmark(i).position, threaded.landmark(i).position);
}

/// What all particles share of the path is bent with the map: no step is changed by more than its odometry's
/// noise explains.
TEST(ClosedLoop, BendsThePathWithoutATear) {
  const Block block(4);
  ParticleSlam filter(block.work.sensor, block.options);
  std::vector<Pose2> before;
  for (const SlamStep& step : block.work.steps) {
    before = filter.best_path();
    if (filter.step(step.motion, step.observations).closed_loop) break;
  }
  const std::vector<Pose2> path = filter.best_path();
  const std::size_t last = path.size() - 1;
  std::size_t shared = last;
  while (filter.ancestors(last - shared) > 1) --shared;
  EXPECT_GT(shared, last / 2);
  EXPECT_GT((path[last].translation() - before.back().translation()).norm(), 0.3);
  double before_m = 0.0;
  double after_m = 0.0;
  for (std::size_t k = 1; k < shared; ++k) {
    const Pose2 step = path[k - 1].inverse() * path[k];
    const Pose2 was = before[k - 1].inverse() * before[k];
    EXPECT_LT((step.translation() - was.translation()).norm(), 3.0 * block.work.sigma_m) << k;
    EXPECT_LT(std::abs(step.heading - was.heading), 3.0 * block.work.sigma_rad) << k;
    before_m += (before[k].translation() - block.work.truth[k].translation()).squaredNorm();
    after_m += (path[k].translation() - block.work.truth[k].translation()).squaredNorm();
  }
  EXPECT_LT(after_m, 0.5 * before_m);
}

}  // namespace
}  // namespace trundle
