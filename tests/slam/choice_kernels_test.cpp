#include "trundle/slam/fastslam/choice_kernels.hpp"

#include <algorithm>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/slam/fastslam/particle_kernels.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

const LandmarkSensor kSensor{{}, 0.1, 0.02, 20.0, 0.0};
const AssociationOptions kOptions{.gate = 9.0, .max_range_m = 20.0, .new_share = 0.01, .near = 2.0};

/// Particles whose sensors stand around a place far from zero, and what is needed to choose.
struct Crowd {
  explicit Crowd(std::size_t particles)
      : poses(particles), sensors(particles), chances(particles), log_weights(padded(particles)) {
    sensors.origin = {5e3, -3e3};
  }
  void put(std::size_t i, const Vector3& pose_from_origin) {
    poses[i] = {sensors.origin.x() + pose_from_origin.x(), sensors.origin.y() + pose_from_origin.y(),
                pose_from_origin.z()};
    sensors.x[i] = pose_from_origin.x();
    sensors.y[i] = pose_from_origin.y();
    sensors.cos[i] = std::cos(pose_from_origin.z());
    sensors.sin[i] = std::sin(pose_from_origin.z());
  }
  void choose(const Observation& seen, const Matrix3& sensor_covariance, Hypotheses& of) {
    choose_landmarks(reading_terms(seen, kSensor),
                     {sensors, sensor_covariance, kOptions, chances[0], log_weights.data()},
                     {0, padded(poses.size())}, of);
  }

  std::vector<Pose2> poses;
  SensorColumns sensors;
  TripleColumns chances;
  Column<double> log_weights;
};

struct TextbookChoice {
  double nis, cost;
};

/// −2 log of the Gaussian of range and bearing, linearised by differences.
TextbookChoice textbook_cost(const Pose2& sensor, const Matrix3& sensor_covariance, const Observation& seen,
                             const LandmarkEstimate& m) {
  const auto reading_of = [&](const Twist2& by, const Vector2& landmark) {
    const ExpectedReading exact = expected_reading(sensor * exp(by), {}, landmark);
    return Vector2(exact.range_m, exact.bearing_rad);
  };
  constexpr double kStep = 1e-4;
  const Vector2 place(m.x, m.y);
  Matrix23 by_pose;
  Matrix2 by_place;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Twist2 by = Twist2::from(kStep * Vector3::Unit(k));
    const Twist2 back = Twist2::from(-kStep * Vector3::Unit(k));
    by_pose.col(k) = (reading_of(by, place) - reading_of(back, place)) / (2.0 * kStep);
  }
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Vector2 step = kStep * Vector2::Unit(k);
    by_place.col(k) = (reading_of({}, place + step) - reading_of({}, place - step)) / (2.0 * kStep);
  }
  Matrix2 S = reading_covariance(kSensor);
  S += by_place * (Matrix2() << m.xx, m.xy, m.xy, m.yy).finished() * by_place.transpose();
  S += by_pose * sensor_covariance * by_pose.transpose();
  const Vector2 v = innovation_of(seen, expected_reading(sensor, {}, place));
  const double nis = v.dot(S.inverse() * v);
  return {nis, nis + std::log((2.0 * kPi * S).determinant())};
}

TEST(ChoiceKernels, CostsAreTheTextbooks) {
  constexpr std::size_t kParticles = 203;
  Random random(2);
  Crowd crowd(kParticles);
  for (std::size_t i = 0; i < kParticles; ++i)
    crowd.put(i, {random.normal(0.3), random.normal(0.3), 1.0 + random.normal(0.03)});
  const Matrix3 covariance = Vector3(0.01, 0.02, 4e-4).asDiagonal();
  std::vector<LandmarkColumns> columns(3, LandmarkColumns(kParticles, {5e3, -3e3}));
  Hypotheses of;
  of.reset(kParticles);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t i = 0; i < kParticles; ++i)
      columns[c].set(i, {5e3 + random.normal(0.5), 8.0 - 3e3 + random.normal(0.5),
                         random.uniform(0.0, 1.0) < 0.1 ? kAbsent : random.uniform(0.01, 0.2),
                         random.normal(0.002), random.uniform(0.01, 0.2)});
    of.add({static_cast<LandmarkId>(c), &columns[c]});
  }
  const Observation seen{kUnknownLandmark, 8.1, 0.55};
  crowd.choose(seen, covariance, of);
  int inside = 0;
  for (std::size_t c = 0; c < columns.size(); ++c)
    for (std::size_t i = 0; i < kParticles; ++i) {
      const LandmarkEstimate m = columns[c].at(i);
      const double cost = of.costs_of(c)[i];
      const TextbookChoice expected = textbook_cost(crowd.poses[i], covariance, seen, m);
      if (!is_there(m) || expected.nis > 2.0 * kOptions.gate) {
        EXPECT_EQ(cost, kFar);
      } else if (expected.nis > kOptions.gate) {
        EXPECT_EQ(cost, kNear);
      } else {
        EXPECT_NEAR(cost, expected.cost, 1e-4);
        ++inside;
      }
    }
  EXPECT_GT(inside, 200);
}

/// All particles are alike but for their luck.
TEST(ChoiceKernels, EachIsChosenAsOftenAsItIsLikely) {
  constexpr std::size_t kParticles = 4096;
  Crowd crowd(kParticles);
  for (std::size_t i = 0; i < kParticles; ++i) {
    crowd.put(i, Vector3::Zero());
    crowd.chances[0][i] = (static_cast<double>(i) + 0.5) / kParticles;
  }
  const Observation seen{kUnknownLandmark, 10.0, 0.0};
  const std::vector<LandmarkEstimate> landmarks = {{5010.2, -2999.8, 0.02, 0.0, 0.03},
                                                   {5009.8, -3000.4, 0.5, 0.2, 0.4},
                                                   {5010.0, -2997.5, 0.3, 0.0, 0.3},
                                                   {5010.0, -3000.0, kAbsent, 0.0, kAbsent}};
  std::vector<LandmarkColumns> columns(landmarks.size(), LandmarkColumns(kParticles));
  Hypotheses of;
  of.reset(kParticles);
  std::vector<double> density;
  for (std::size_t c = 0; c < landmarks.size(); ++c) {
    columns[c].fill(landmarks[c]);
    of.add({static_cast<LandmarkId>(c), &columns[c]});
    const TextbookChoice expected = textbook_cost(crowd.poses[0], Matrix3::Zero(), seen, landmarks[c]);
    const bool is_possible = is_there(landmarks[c]) && expected.nis <= kOptions.gate;
    density.push_back(is_possible ? std::exp(-0.5 * expected.cost) : 0.0);
  }
  ASSERT_EQ(std::ranges::count(density, 0.0), 2);
  crowd.choose(seen, Matrix3::Zero(), of);
  const double of_new = kOptions.new_share / (2.0 * kPi * kOptions.max_range_m);
  double all = of_new;
  for (const double p : density) all += p;
  for (std::size_t c = 0; c < landmarks.size(); ++c)
    EXPECT_NEAR(static_cast<double>(std::ranges::count(of.choices, static_cast<std::int32_t>(c))),
                kParticles * density[c] / all, 1.5);
  for (std::size_t i = 0; i < kParticles; ++i) {
    const double chosen = of.choices[i] < 0 ? of_new : density[static_cast<std::size_t>(of.choices[i])];
    EXPECT_NEAR(crowd.log_weights[i], std::log(all / chosen), 1e-4);
  }
}

}  // namespace
}  // namespace trundle::slam
