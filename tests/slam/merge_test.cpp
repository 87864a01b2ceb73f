#include "trundle/slam/merging/merge.hpp"

#include <algorithm>
#include <array>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/geometry/angle.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::slam {
namespace {

using testing::HasSubstr;

std::vector<Vector2> places_in(double size_m, int count, Random& random) {
  std::vector<Vector2> places;
  for (int i = 0; i < count; ++i)
    places.emplace_back(random.uniform(0.0, size_m), random.uniform(0.0, size_m));
  return places;
}

/// Some of the places in a frame, each wrong by itself, and all of them by a turn about the frame's origin.
JointMap map_in(const Pose2& frame, const std::vector<Vector2>& places, const std::vector<std::size_t>& which,
                Random& random) {
  constexpr double kOwn_m = 0.03, kTurn_rad = 0.02;
  JointMap map;
  const auto n = 2 * static_cast<Eigen::Index>(which.size());
  map.covariance = kOwn_m * kOwn_m * Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd by_turn(n);
  for (std::size_t i = 0; i < which.size(); ++i) {
    const Vector2 place = frame.inverse() * places[which[i]];
    by_turn.segment<2>(2 * static_cast<Eigen::Index>(i)) << -place.y(), place.x();
    map.positions.push_back(place);
    map.names.push_back(std::to_string(which[i]));
  }
  map.covariance += kTurn_rad * kTurn_rad * by_turn * by_turn.transpose();
  const double turn = random.normal(kTurn_rad);
  for (std::size_t i = 0; i < which.size(); ++i)
    map.positions[i] += turn * by_turn.segment<2>(2 * static_cast<Eigen::Index>(i)) +
                        Vector2(random.normal(kOwn_m), random.normal(kOwn_m));
  return map;
}

std::vector<std::size_t> from_to(std::size_t first, std::size_t last) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = first; i < last; ++i) numbers.push_back(i);
  return numbers;
}

struct Maps {
  std::vector<Vector2> places;
  std::vector<Pose2> frames;
  std::vector<JointMap> maps;
  std::array<double, 3> metre{};  ///< by what share each is longer than the first
};

/// As a sensor sees them whose ranges are so many times as long.
std::vector<Vector2> times(double factor, std::vector<Vector2> places) {
  for (Vector2& place : places) place *= factor;
  return places;
}
Pose2 times(double factor, const Pose2& frame) {
  return {factor * frame.x, factor * frame.y, frame.heading};
}

/// Three maps of fifteen places, of which neighbours share eight; the first is in the world's frame. Places
/// and frames are in its metre.
Maps three_maps(std::uint64_t seed, const std::array<double, 3>& metre_sigmas = {}) {
  Random random(seed, 17);
  Maps all{places_in(20.0, 15, random), {{}, {3.0, -2.0, 2.5}, {-4.0, 1.0, -1.0}}, {}};
  std::array<double, 3> length;
  std::ranges::transform(metre_sigmas, length.begin(),
                         [&](double sigma) { return 1.0 + random.normal(sigma); });
  for (std::size_t k = 0; k < 3; ++k) {
    all.maps.push_back(map_in(times(length[k], all.frames[k]), times(length[k], all.places),
                              from_to(2 * k, 2 * k + 10), random));
    all.maps.back().from = "map " + std::to_string(k);
    all.maps.back().metre_sigma = metre_sigmas[k];
    all.metre[k] = length[k] / length[0] - 1.0;
  }
  all.places = times(length[0], all.places);
  for (Pose2& frame : all.frames) frame = times(length[0], frame);
  return all;
}

/// Of the others' frames.
double frame_nees(const MergedMap& merged, const std::vector<Pose2>& frames) {
  double sum = 0.0;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const Pose2& frame = merged.first_from_map[k];
    const Vector3 e(frame.x - frames[k].x, frame.y - frames[k].y,
                    wrap_angle(frame.heading - frames[k].heading));
    sum += e.dot(merged.frame_covariance[k].ldlt().solve(e));
  }
  return sum;
}

double merged_map_nees(const MergedMap& merged, const std::vector<Vector2>& places) {
  Eigen::VectorXd e(merged.map.covariance.rows());
  for (std::size_t i = 0; i < merged.map.positions.size(); ++i)
    e.segment<2>(2 * static_cast<Eigen::Index>(i)) =
        merged.map.positions[i] - places[static_cast<std::size_t>(std::stoi(merged.map.names[i]))];
  return e.dot(merged.map.covariance.ldlt().solve(e));
}

/// Names are those of places.
bool knows_each_landmark(const MergedMap& merged, const std::vector<JointMap>& maps) {
  for (std::size_t k = 0; k < maps.size(); ++k)
    for (std::size_t i = 0; i < maps[k].names.size(); ++i)
      if (merged.map.names[merged.landmark_of[k][i]] != maps[k].names[i]) return false;
  return true;
}

void expect_chi_squared(double sum, int freedom) {
  EXPECT_GT(sum, chi_squared_limit(0.9995, freedom));
  EXPECT_LT(sum, chi_squared_limit(0.0005, freedom));
}

/// Of sensors whose metres are known so well.
void expect_honest(const std::array<double, 3>& metre_sigmas, bool unknown_ids) {
  const int trials = test::trials(30, 5);
  double frames = 0.0, landmarks = 0.0, cost = 0.0;
  std::array<double, 3> metres{};
  int freedom = 0, merged_trials = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Maps all = three_maps(static_cast<std::uint64_t>(trial), metre_sigmas);
    const MergedMap merged = merge_maps(all.maps, {.unknown_ids = unknown_ids});
    // A landmark beyond the gate is taken for another: one in a thousand.
    if (!knows_each_landmark(merged, all.maps)) continue;
    ++merged_trials;
    frames += frame_nees(merged, all.frames);
    landmarks += merged_map_nees(merged, all.places);
    cost += merged.cost;
    freedom += merged.degrees_of_freedom;
    for (std::size_t k = 1; k < 3; ++k)
      if (merged.metre_sigma[k] > 0.0)
        metres[k] += squared((merged.metre[k] - all.metre[k]) / merged.metre_sigma[k]);
  }
  EXPECT_GE(merged_trials, trials * 9 / 10);
  expect_chi_squared(frames, 6 * merged_trials);
  expect_chi_squared(landmarks, 28 * merged_trials);
  expect_chi_squared(cost, freedom);
  for (std::size_t k = 1; k < 3; ++k)
    if (metre_sigmas[0] + metre_sigmas[k] > 0.0) expect_chi_squared(metres[k], merged_trials);
}

TEST(Merge, ErrorsAreAsLargeAsItsCovariancesSay) {
  for (const bool unknown_ids : {false, true}) expect_honest({}, unknown_ids);
}

/// Where sensors' ranges are too long by shares of their own, which no map's covariance has in it.
TEST(Merge, CountsInTheMetreOfTheFirstMap) {
  for (const bool unknown_ids : {false, true})
    for (const auto& metre_sigmas : {std::array{0.03, 0.02, 0.0}, {0.0, 0.05, 0.05}, {0.05, 0.0, 0.0}})
      expect_honest(metre_sigmas, unknown_ids);
}

// Everything in one vector, derivatives by differences.
TEST(Merge, IsWhatDenseLeastSquaresGives) {
  const Maps all = three_maps(3);
  const MergedMap merged = merge_maps(all.maps);
  const std::size_t count = merged.map.positions.size();
  const auto residuals = [&](const Eigen::VectorXd& x) {
    std::vector<double> rows;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto f = 3 * static_cast<Eigen::Index>(k) - 3;
      const Pose2 frame = k == 0 ? Pose2{} : Pose2{x[f], x[f + 1], x[f + 2]};
      Eigen::VectorXd e(all.maps[k].covariance.rows());
      for (std::size_t i = 0; i < all.maps[k].positions.size(); ++i) {
        const auto m = 6 + 2 * static_cast<Eigen::Index>(merged.landmark_of[k][i]);
        e.segment<2>(2 * static_cast<Eigen::Index>(i)) =
            frame.inverse() * Vector2(x.segment<2>(m)) - all.maps[k].positions[i];
      }
      const Eigen::VectorXd white = all.maps[k].covariance.llt().matrixL().solve(e);
      rows.insert(rows.end(), white.begin(), white.end());
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size())));
  };
  Eigen::VectorXd x(6 + 2 * static_cast<Eigen::Index>(count));
  x.head<6>() << 3.0, -2.0, 2.5, -4.0, 1.0, -1.0;
  for (std::size_t i = 0; i < count; ++i)
    x.segment<2>(6 + 2 * static_cast<Eigen::Index>(i)) =
        all.places[static_cast<std::size_t>(std::stoi(merged.map.names[i]))];
  Eigen::MatrixXd J(residuals(x).size(), x.size());
  for (int round = 0; round < 20; ++round) {
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::VectorXd by = 1e-6 * Eigen::VectorXd::Unit(x.size(), i);
      J.col(i) = (residuals(x + by) - residuals(x - by)) / 2e-6;
    }
    x -= (J.transpose() * J).ldlt().solve(J.transpose() * residuals(x));
  }
  const Eigen::MatrixXd covariance =
      (J.transpose() * J).ldlt().solve(Eigen::MatrixXd::Identity(x.size(), x.size()));
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_LT((merged.map.positions[i] - x.segment<2>(6 + 2 * static_cast<Eigen::Index>(i))).norm(), 1e-6);
  const auto n = merged.map.covariance.rows();
  EXPECT_LT((merged.map.covariance - covariance.bottomRightCorner(n, n)).norm(),
            1e-4 * merged.map.covariance.norm());
  EXPECT_NEAR(merged.first_from_map[2].x, x[3], 1e-6);
  EXPECT_NEAR(merged.first_from_map[2].heading, x[5], 1e-6);
}

TEST(Merge, KeepsApartWhatBearsTheNameOfAnother) {
  Maps all = three_maps(5);
  std::swap(all.maps[1].names[2], all.maps[1].names[3]);
  const MergedMap merged = merge_maps(std::span(all.maps).first(2));
  EXPECT_LT((merged.first_from_map[1].translation() - all.frames[1].translation()).norm(), 0.5);
  EXPECT_EQ(merged.map.positions.size(), 14U);  // twelve places, of which two are there twice
}

std::string reason_of(std::span<const JointMap> maps, const MergeOptions& options) {
  try {
    (void)merge_maps(maps, options);
  } catch (const CannotAnswer& error) {
    return error.what();
  }
  return "";
}

TEST(Merge, SaysThatThereIsNoOverlap) {
  Random random(8, 1);
  const std::vector<Vector2> places = places_in(20.0, 24, random);
  std::vector<JointMap> maps = {map_in({}, places, from_to(0, 12), random),
                                map_in({1.0, 2.0, 3.0}, places, from_to(12, 24), random)};
  EXPECT_THAT(reason_of(maps, {}), HasSubstr("no overlap"));
  EXPECT_THAT(reason_of(maps, {.unknown_ids = true}), HasSubstr("no overlap"));
}

// One of two sensors reads a tenth too long, which no covariance knows of.
TEST(Merge, SaysThatMapsContradictEachOther) {
  Maps all = three_maps(6);
  for (Vector2& position : all.maps[1].positions) position *= 1.1;
  EXPECT_THAT(reason_of(std::span(all.maps).first(2), {}),
              AnyOf(HasSubstr("contradicts"), HasSubstr("no overlap")));
}

// A square of squares looks the same from four sides.
TEST(Merge, SaysThatItIsAmbiguous) {
  Random random(9, 1);
  std::vector<Vector2> places;
  for (int i = 0; i < 16; ++i) places.emplace_back(3.0 * (i % 4), 3.0 * (i / 4));
  std::vector<JointMap> maps = {map_in({}, places, from_to(0, 16), random),
                                map_in({1.0, 2.0, 3.0}, places, from_to(0, 16), random)};
  EXPECT_THAT(reason_of(maps, {.unknown_ids = true}), HasSubstr("ambiguous"));
  EXPECT_EQ(reason_of(maps, {}), "");
}

}  // namespace
}  // namespace trundle::slam
