#include "trundle/slam/fastslam/particle_landmark.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

#include "slam/pose_target.hpp"

namespace trundle::slam {
namespace {

/// The textbook's Kalman filter of one landmark in (range, bearing), Joseph form.
struct TextbookLandmark {
  Vector2 mean;
  Matrix2 P;
  double log_likelihood = 0.0;

  void update(const Pose2& pose, const LandmarkSensor& sensor, const Observation& observation) {
    const ExpectedReading expected = expected_reading(pose, sensor.body_from_sensor, mean);
    const Matrix2 H = expected.by_landmark;
    const Matrix2 R = reading_covariance(sensor);
    const Matrix2 S = H * P * H.transpose() + R;
    const Vector2 innovation = innovation_of(observation, expected);
    log_likelihood = -0.5 * (innovation.dot(S.inverse() * innovation) + std::log(S.determinant()));
    const Matrix2 K = P * H.transpose() * S.inverse();
    mean += K * innovation;
    const Matrix2 I_KH = Matrix2::Identity() - K * H;
    P = (I_KH * P * I_KH.transpose() + K * R * K.transpose()).eval();
  }
};

TEST(ParticleLandmark, IsTheTextbooksKalmanFilter) {
  const LandmarkSensor sensor{{0.3, -0.1, 0.2}, 0.1, 0.03, 20.0, 0.0};
  Random random(3);
  for (int run = 0; run < 200; ++run) {
    const Pose2 first{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-9.0, 9.0)};
    const Observation seen{0, random.uniform(0.5, 10.0), random.uniform(-kPi, kPi)};
    const SightedLandmark sighted = sighted_landmark(first, sensor.body_from_sensor, seen);
    LandmarkEstimate m =
        first_estimate(sensor_at(first, sensor.body_from_sensor), reading_terms(seen, sensor));
    TextbookLandmark textbook{
        sighted.in_world, sighted.by_reading * reading_covariance(sensor) * sighted.by_reading.transpose()};
    for (int update = 0; update < 20; ++update) {
      const Pose2 pose{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-9.0, 9.0)};
      const ExpectedReading expected = expected_reading(pose, sensor.body_from_sensor, textbook.mean);
      const Observation again{0, expected.range_m + random.normal(0.1),
                              expected.bearing_rad + random.normal(0.03)};
      const Sight sight = sight_of(sensor_at(pose, sensor.body_from_sensor), reading_terms(again, sensor), m);
      const double log_likelihood = log_likelihood_of(sight);
      improve(m, sight);
      textbook.update(pose, sensor, again);
      ASSERT_NEAR(log_likelihood, textbook.log_likelihood, 1e-8);
      ASSERT_LT((Vector2(m.x, m.y) - textbook.mean).norm(), 1e-9);
      const Matrix2 P = (Matrix2() << m.xx, m.xy, m.xy, m.yy).finished();
      ASSERT_LT((P - textbook.P).norm(), 1e-9 * textbook.P.norm());
    }
  }
}

TEST(ParticleLandmark, StaysPositiveDefiniteUnderAMillionUpdates) {
  const LandmarkSensor sensor{{}, 0.1, 0.03, 20.0, 0.0};
  const SensorAt at = sensor_at({}, {});
  LandmarkEstimate m = first_estimate(at, reading_terms({0, 3.0, 3.1}, sensor));
  for (int i = 0; i < 1'000'000; ++i) improve(m, sight_of(at, reading_terms({0, 3.0, 3.1}, sensor), m));
  EXPECT_GT(m.xx, 0.0);
  EXPECT_GT(m.xx * m.yy - m.xy * m.xy, 0.0);
  // n equal readings leave a n-th of one reading's covariance.
  EXPECT_NEAR((m.xx * m.yy - m.xy * m.xy) / std::pow(0.1 * 3.0 * 0.03, 2), 1e-12, 1e-16);
}

TEST(PoseTarget, GaussianIsTheTargetsCurvature) {
  // Central differences of the log density at the Gauss–Newton fixed point; the readings are exact, so that
  // the curvature of their residuals, which Gauss–Newton leaves out, is zero.
  const LandmarkSensor sensor{{0.3, -0.1, 0.2}, 0.1, 0.03, 20.0, 0.0};
  const Pose2 predicted{1.0, 2.0, 0.7};
  Matrix3 Q = Vector3(4e-4, 1e-4, 9e-4).asDiagonal();
  Q(0, 2) = Q(2, 0) = 2e-4;
  std::vector<LandmarkColumns> columns;
  std::vector<KnownReading> readings;
  columns.reserve(3);
  for (const Vector2& place : {Vector2(4.0, 3.0), Vector2(-1.0, 5.0), Vector2(2.0, -3.0)}) {
    columns.emplace_back(1);
    columns.back().set(0, {place.x(), place.y(), 0.02, 0.005, 0.03});
    const ExpectedReading exact = expected_reading(predicted, sensor.body_from_sensor, place);
    readings.push_back({reading_terms({0, exact.range_m, exact.bearing_rad}, sensor), &columns.back()});
  }
  PoseColumns poses(1);
  poses.set(0, predicted);
  const test::PoseTarget target(poses, Q, sensor.body_from_sensor, readings);
  const test::WhitenedGaussian at = target.gaussian_at(0, Vector3::Zero());
  EXPECT_LT(at.mean.norm(), 1e-9);
  const Matrix3 information = at.information_root * at.information_root.transpose();
  const double h = 1e-3;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Vector3 a = h * Vector3::Unit(i);
      const Vector3 b = h * Vector3::Unit(j);
      const auto f = [&](const Vector3& n) { return target.at(0, n).log_density; };
      const double second = (f(a + b) - f(a - b) - f(b - a) + f(-a - b)) / (4.0 * h * h);
      EXPECT_NEAR(-second, information(i, j), 0.02 * information.norm());
    }
}

TEST(PoseTarget, InnovationIsTheInnovationInAllItsCovariance) {
  const LandmarkSensor sensor{{0.3, -0.1, 0.2}, 0.1, 0.03, 20.0, 0.0};
  PoseColumns predicted(1);
  predicted.set(0, {1.0, 2.0, 0.7});
  const Matrix3 Q = Vector3(4e-4, 1e-4, 9e-4).asDiagonal();
  LandmarkColumns columns(1);
  columns.set(0, {4.0, 3.0, 0.02, 0.005, 0.03});
  const Observation observation{0, 3.0, 0.1};
  const std::vector<KnownReading> readings = {{reading_terms(observation, sensor), &columns}};
  const test::PoseTarget target(predicted, Q, sensor.body_from_sensor, readings);
  const ExpectedReading expected = expected_reading(predicted.at(0), sensor.body_from_sensor, {4.0, 3.0});
  const Matrix3 in_world = world_covariance({predicted.at(0), Q});
  const LandmarkEstimate m = columns.at(0);  // rounded to single precision
  const Matrix2 P = (Matrix2() << m.xx, m.xy, m.xy, m.yy).finished();
  const Matrix2 S = expected.by_pose * in_world * expected.by_pose.transpose() +
                    expected.by_landmark * P * expected.by_landmark.transpose() + reading_covariance(sensor);
  const Vector2 innovation = innovation_of(observation, expected);
  const test::PoseTarget::Innovation found = target.innovation(0, readings[0]);
  EXPECT_LT((found.innovation - innovation).norm(), 1e-12);
  EXPECT_NEAR(found.nis, innovation.dot(S.inverse() * innovation), 1e-9);
}

}  // namespace
}  // namespace trundle::slam
