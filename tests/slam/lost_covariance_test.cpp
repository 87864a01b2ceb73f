#include "trundle/slam/fastslam/lost_covariance.hpp"

#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/slam/fastslam/particle_slam.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

const std::vector<Vector2> kPlaces = {{3.0, 1.0}, {5.0, -2.0}, {-1.0, 4.0}, {2.0, 2.0}, {8.0, 8.0}};

/// Each particle has the map shifted and turned about the world's origin.
std::vector<LandmarkColumns> moved_maps(const std::vector<Vector3>& moves, Precision precision) {
  std::vector<LandmarkColumns> maps;
  for (const Vector2& place : kPlaces) {
    maps.emplace_back(moves.size(), precision, place);
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const Vector3& move = moves[i];
      maps.back().set(i, {place.x() + move.x() - move.z() * place.y(),
                          place.y() + move.y() + move.z() * place.x(), 0.01, 0.0, 0.01});
    }
  }
  return maps;
}

std::vector<std::vector<Vector2>> places_of(const std::vector<LandmarkColumns>& maps, std::size_t particles) {
  std::vector<Ancestry::Index> all(particles);
  std::iota(all.begin(), all.end(), Ancestry::Index{0});
  std::vector<std::vector<Vector2>> places;
  for (const LandmarkColumns& map : maps) places.push_back(some_places(map, all, particles));
  return places;
}

Matrix3 covariance_of(const std::vector<Vector3>& values) {
  const auto count = static_cast<double>(values.size());
  const Vector3 mean = std::accumulate(values.begin(), values.end(), Vector3(Vector3::Zero())) / count;
  Matrix3 covariance = Matrix3::Zero();
  for (const Vector3& value : values) covariance += (value - mean) * (value - mean).transpose() / count;
  return covariance;
}

class EveryMapPrecision : public testing::TestWithParam<Precision> {};

TEST_P(EveryMapPrecision, ScatterIsThatOfTheMoves) {
  Random random(5);
  std::vector<Vector3> moves;
  for (int i = 0; i < 40; ++i)
    moves.emplace_back(random.normal(1e-4), random.normal(2e-4), random.normal(3e-5));
  const auto maps = moved_maps(moves, GetParam());
  const auto scatter = map_scatter(places_of(maps, moves.size()));
  ASSERT_TRUE(scatter);
  // To first order in the moves.
  EXPECT_TRUE(scatter->about(Vector2::Zero()).covariance.isApprox(covariance_of(moves), 1e-4));
}
INSTANTIATE_TEST_SUITE_P(, EveryMapPrecision, testing::Values(Precision::float32, Precision::float64),
                         [](const auto& of) { return of.param == Precision::float32 ? "single" : "twice"; });

TEST(MapScatter, OneLandmarkIsNoMap) {
  const auto places = places_of(moved_maps({Vector3::Zero(), Vector3::Ones()}, Precision::float64), 2);
  EXPECT_FALSE(map_scatter(std::span(places).first(1)));
  EXPECT_TRUE(map_scatter(std::span(places).first(2)));
}

TEST(SomePlaces, AreThoseOfTheAncestorsAndNoneWhereOneHasNone) {
  auto maps = moved_maps({Vector3::Zero(), Vector3::Ones()}, Precision::float64);
  const std::vector<Ancestry::Index> second = {1, 1};
  const std::vector<Vector2> places = some_places(maps[0], second, 2);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0], Vector2(maps[0].at(1).x, maps[0].at(1).y));
  EXPECT_EQ(places[1], places[0]);
  maps[0].set(1, {0.0, 0.0, kAbsent, 0.0, 0.0});
  EXPECT_TRUE(some_places(maps[0], second, 2).empty());
}

/// A turn about a centre moves what is elsewhere.
TEST(FrameCovariance, AboutAnotherPlaceTheTurnShifts) {
  FrameCovariance frame;
  frame.centre = {1.0, 2.0};
  frame.covariance(2, 2) = 0.04;
  const FrameCovariance there = frame.about({4.0, 2.0});  // 3 m along x: the turn moves it along y
  EXPECT_NEAR(there.covariance(0, 0), 0.0, 1e-15);
  EXPECT_NEAR(there.covariance(1, 1), 9.0 * 0.04, 1e-15);
  EXPECT_NEAR(there.covariance(1, 2), 3.0 * 0.04, 1e-15);
  EXPECT_TRUE(there.about(frame.centre).covariance.isApprox(frame.covariance, 1e-14));
}

/// Particles that come to differ a little more with each step, of which sightings do not show who is right.
struct Drift {
  static constexpr std::size_t kParticles = 50;
  static constexpr int kResamplings = 100;
  const Vector3 sigma{0.1, 0.2, 0.03};  ///< of a step
  Vector3 whole = Vector3::Zero();      ///< variance of what is left and what is kept
  Vector3 kept = Vector3::Zero();       ///< of it, what is kept
  Vector3 wandered = Vector3::Zero();   ///< of the particles' mean

  /// What a particle's weight owes to its ancestor: `inherited` of it.
  Drift(double inherited, int trials) {
    for (int trial = 0; trial < trials; ++trial) {
      Random random(11, static_cast<std::uint64_t>(trial));
      std::vector<Vector3> moves(kParticles, Vector3::Zero());
      std::vector<double> fitness(kParticles, 0.0);
      Ancestry ancestry(kParticles);
      Coalescence coalescence(kParticles);
      LostCovariance lost;
      for (int k = 0; k < kResamplings; ++k) {
        for (Vector3& move : moves)
          move += sigma.cwiseProduct(Vector3(random.normal(1.0), random.normal(1.0), random.normal(1.0)));
        for (double& f : fitness) f = inherited * f + random.normal(0.5);
        const std::vector<Ancestry::Index> parents = parents_of(fitness, random);
        coalescence.hold(ancestry);
        ancestry.resample(parents);
        moves = of_parents(moves, parents);
        fitness = of_parents(fitness, parents);
        lost.after_resampling({Vector2::Zero(), covariance_of(moves)}, coalescence.share_lost(ancestry));
      }
      const Vector3 taken = 0.5 * lost.beyond_scatter(Vector2::Zero()).diagonal();
      whole += (covariance_of(moves).diagonal() + taken) / trials;
      kept += taken / trials;
      const Vector3 mean = std::accumulate(moves.begin(), moves.end(), Vector3(Vector3::Zero())) / kParticles;
      wandered += mean.cwiseAbs2() / trials;
    }
  }

  /// Systematic resampling by exp(fitness).
  static std::vector<Ancestry::Index> parents_of(const std::vector<double>& fitness, Random& random) {
    double sum = 0.0;
    for (const double f : fitness) sum += std::exp(f);
    std::vector<Ancestry::Index> parents;
    double point = random.uniform();
    double reached = 0.0;
    for (std::size_t i = 0; i < kParticles; ++i)
      for (reached += std::exp(fitness[i]) / sum * kParticles; point < reached && parents.size() < kParticles;
           point += 1.0)
        parents.push_back(static_cast<Ancestry::Index>(i));
    parents.resize(kParticles, kParticles - 1);
    return parents;
  }
  template <class T>
  static std::vector<T> of_parents(const std::vector<T>& values,
                                   const std::vector<Ancestry::Index>& parents) {
    std::vector<T> result;
    for (const Ancestry::Index parent : parents) result.push_back(values[parent]);
    return result;
  }
};

/// What is left and what is kept are together what there was; and the mean has wandered by what is kept.
TEST(LostCovariance, KeepsWhatChanceTakes) {
  const int trials = test::trials(2000, 400);
  const Drift drift(0.0, trials);
  const double wide = 5.0 * std::sqrt(2.0 / trials);  // 5 sigma of a variance from so many draws
  for (int i = 0; i < 3; ++i) {
    const double variance = Drift::kResamplings * drift.sigma[i] * drift.sigma[i];
    EXPECT_NEAR(drift.whole[i] / variance, 1.0, wide) << i;
    EXPECT_GT(drift.kept[i], 0.3 * variance) << i;
    EXPECT_NEAR(drift.wandered[i] / (drift.kept[i] + variance / Drift::kParticles), 1.0, wide) << i;
  }
}

/// Weights that last as families do take several times as much, which the weights of one step do not show.
/// The families of some resamplings back do, to about a tenth.
TEST(LostCovariance, KeepsWhatFamiliesTakeThatDoWell) {
  const int trials = test::trials(2000, 400);
  const Drift drift(0.5, trials);
  const double wide = 0.15 + 5.0 * std::sqrt(2.0 / trials);
  for (int i = 0; i < 3; ++i) {
    const double variance = Drift::kResamplings * drift.sigma[i] * drift.sigma[i];
    EXPECT_NEAR(drift.whole[i] / variance, 1.0, wide) << i;
    EXPECT_NEAR(drift.wandered[i] / drift.kept[i], 1.0, wide) << i;
  }
}

Matrix3 twice_lost(const LostCovariance& covariance) {
  return covariance.beyond_scatter(Vector2::Zero());
}

/// Of a place at the world's origin, which all of these tests are about.
FrameCovariance frame_of(const Matrix3& covariance) {
  return {Vector2::Zero(), covariance};
}

const Matrix3 kOld = (Matrix3() << 0.2, 0.05, 0.01, 0.05, 0.1, -0.01, 0.01, -0.01, 0.02).finished();
const Matrix3 kSince = (Matrix3() << 2.0, 0.7, -0.1, 0.7, 1.0, 0.2, -0.1, 0.2, 0.3).finished();

/// What has come about since the landmark was last seen is measured by where it is seen, in the textbook's
/// form; the mean stays, so the square of what it ought to move by is added.
TEST(LostCovariance, IsUpdatedByAKalmanFilterOfWhatCameSince) {
  const Vector2 apart(0.2, -0.3);
  const Matrix2 errors = (Matrix2() << 0.3, 0.1, 0.1, 0.05).finished();
  LostCovariance covariance;
  covariance.reset(frame_of(kOld + kSince), frame_of(kOld + kSince));
  covariance.update(frame_of(kOld), {Vector2::Zero(), apart, errors});
  const Matrix3 R = 2.0 * kSince;
  const Eigen::Matrix<double, 3, 2> K = R.leftCols<2>() * (R.topLeftCorner<2, 2>() + errors).inverse();
  const Vector3 off = K * apart;
  const Matrix3 expected = 2.0 * kOld + R - K * R.topRows<2>() + off * off.transpose();
  EXPECT_LT((twice_lost(covariance) - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_TRUE(covariance.total().covariance.isApprox(0.5 * expected, 1e-12));
}

TEST(LostCovariance, IsNotUpdatedByALessCertainSubmap) {
  LostCovariance covariance;
  covariance.reset(frame_of(kOld), frame_of(kOld));
  covariance.update(frame_of(kOld + kSince), {Vector2::Zero(), {0.1, 0.1}, 0.01 * Matrix2::Identity()});
  EXPECT_LT((twice_lost(covariance) - 2.0 * kOld).cwiseAbs().maxCoeff(), 1e-12);
}

/// No less along any direction, and no more than that takes.
TEST(LostCovariance, IsNoLessThanThatOfTheSubmapThatIsFollowed) {
  const Matrix3 lost = 0.5 * kOld;
  LostCovariance covariance;
  covariance.reset(frame_of(lost), frame_of(kOld));
  covariance.inflate_to(frame_of(0.9 * kOld), Vector2::Zero());
  EXPECT_TRUE(covariance.total().covariance.isApprox(kOld, 1e-12));
  covariance.inflate_to(frame_of(kOld + kSince), Vector2::Zero());
  EXPECT_TRUE(covariance.total().covariance.isApprox(kOld + kSince, 1e-12));
  EXPECT_TRUE(twice_lost(covariance).isApprox(2.0 * (lost + kSince), 1e-12));
}

/// One landmark of four fits after a blind way that nobody can tell, the others do not: it may be chance.
TEST(LostCovariance, IsNotLearnedFromOneThatFitsAmongManyThatDoNot) {
  const Matrix3 noise = Vector3(1.0, 1.0, 0.04).asDiagonal();
  const auto variance_after = [&](double off_m) {
    const LandmarkSensor sensor{{}, 0.1, radians(1.0), 20.0, 0.0};
    ParticleSlam filter(sensor, {.seed = 3});
    std::vector<Observation> seen;
    for (std::size_t i = 0; i < 4; ++i)
      seen.push_back(
          {static_cast<LandmarkId>(i), kPlaces[i].norm(), std::atan2(kPlaces[i].y(), kPlaces[i].x())});
    filter.step({}, seen);
    for (std::size_t i = 1; i < 4; ++i) seen[i].range_m += off_m;
    filter.step({Pose2{}, noise, Matrix3::Zero()}, seen);
    return filter.estimate().covariance.topLeftCorner<2, 2>().trace();
  };
  const double unknown = noise(0, 0) + noise(1, 1);
  EXPECT_GT(variance_after(12.0), unknown);
  EXPECT_LT(variance_after(0.0), 0.1 * unknown);
}

/// e = Log(T̂⁻¹ T) over the first loop of a room, 3 where the covariance is consistent, and the map at its
/// end.
class ConsistentParticles : public testing::TestWithParam<Proposal> {};

TEST_P(ConsistentParticles, OfPosesAndMap) {
  constexpr int kSeeds = 40;  // of each the map is one draw: with fewer the share says nothing
  double nees = 0.0;
  double inside = 0.0;
  int poses = 0;
  int landmarks = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const test::SlamWorld world = test::slam_world({.steps = 315,
                                                    .step_m = 0.1,
                                                    .sigma_along_m = 0.005,
                                                    .sigma_across_m = 0.001,
                                                    .sigma_turn_rad = 0.004,
                                                    .seed = static_cast<std::uint64_t>(seed)});
    ParticleSlam filter(world.sensor, {.proposal = GetParam(), .seed = static_cast<std::uint64_t>(seed)});
    for (std::size_t k = 0; k < world.steps.size(); ++k) {
      filter.step(world.steps[k].motion, world.steps[k].observations);
      const PoseEstimate estimate = filter.estimate();
      const Vector3 e = log(estimate.pose.inverse() * world.truth[k]).vector();
      nees += e.dot(body_covariance(estimate.pose, estimate.covariance).ldlt().solve(e));
      ++poses;
    }
    for (std::size_t i = 0; i < filter.landmarks(); ++i) {
      const MappedLandmark mapped = filter.landmark(i);
      const Vector2 e = mapped.position - world.landmarks[static_cast<std::size_t>(mapped.id)];
      inside += e.dot(mapped.covariance.ldlt().solve(e)) < 5.991 ? 1.0 : 0.0;
      ++landmarks;
    }
  }
  RecordProperty("nees", std::to_string(nees / poses));
  RecordProperty("inside", std::to_string(inside / landmarks));
  EXPECT_LT(nees / poses, 6.0);
  EXPECT_GT(nees / poses, 1.5);
  EXPECT_GT(inside / landmarks, 0.85);
}
INSTANTIATE_TEST_SUITE_P(, ConsistentParticles,
                         testing::Values(Proposal::linearised, Proposal::swarm_gaussian), [](const auto& of) {
                           return of.param == Proposal::linearised ? "fastslam2" : "mapso_proposal";
                         });

}  // namespace
}  // namespace trundle::slam
