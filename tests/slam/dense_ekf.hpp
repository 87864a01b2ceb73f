#pragma once

#include <map>

#include <Eigen/Dense>

#include "trundle/slam/steps.hpp"

namespace trundle::test {
using namespace slam;

/// EKF-SLAM as the textbook writes it: full matrices, full Jacobians, (I − K H) P.
struct DenseEkf {
  LandmarkSensor sensor;
  Eigen::VectorXd x;
  Eigen::MatrixXd P;
  std::map<LandmarkId, Eigen::Index> at = {};

  Pose2 pose() const { return {x[0], x[1], x[2]}; }

  void predict(const Motion& motion) {
    const Eigen::Index n = x.size();
    const Pose2 after = pose() * motion.mean;
    Eigen::MatrixXd F = Eigen::MatrixXd::Identity(n, n);
    F.block<2, 1>(0, 2) = rotation(0.5 * kPi) * (after.translation() - x.head<2>());
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n, 3);
    G.topLeftCorner<2, 2>() = rotation(after.heading);
    G(2, 2) = 1.0;
    P = F * P * F.transpose() + G * motion.covariance * G.transpose();
    x.head<3>() << after.x, after.y, after.heading;
  }

  void add(const Observation& observation) {
    const Eigen::Index n = x.size();
    const SightedLandmark sighted = sighted_landmark(pose(), sensor.body_from_sensor, observation);
    Eigen::MatrixXd F = Eigen::MatrixXd::Zero(n + 2, n);
    F.topRows(n).setIdentity();
    F.block<2, 3>(n, 0) = sighted.by_pose;
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n + 2, 2);
    G.bottomRows<2>() = sighted.by_reading;
    P = (F * P * F.transpose() + G * reading_covariance(sensor) * G.transpose()).eval();
    x.conservativeResize(n + 2);
    x.tail<2>() = sighted.in_world;
    at[observation.landmark] = n;
  }

  /// All of them known, linearised at one state.
  void update(const std::vector<Observation>& observations) {
    const Eigen::Index n = x.size();
    const auto m = 2 * static_cast<Eigen::Index>(observations.size());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(m, n);
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(m, m);
    Eigen::VectorXd innovation(m);
    for (Eigen::Index row = 0; row < m; row += 2) {
      const Observation& observation = observations[static_cast<std::size_t>(row / 2)];
      const Eigen::Index column = at.at(observation.landmark);
      const ExpectedReading expected =
          expected_reading(pose(), sensor.body_from_sensor, x.segment<2>(column));
      H.block<2, 3>(row, 0) = expected.by_pose;
      H.block<2, 2>(row, column) = expected.by_landmark;
      R.block<2, 2>(row, row) = reading_covariance(sensor);
      innovation.segment<2>(row) = innovation_of(observation, expected);
    }
    const Eigen::MatrixXd K = P * H.transpose() * (H * P * H.transpose() + R).inverse();
    x += K * innovation;
    P = ((Eigen::MatrixXd::Identity(n, n) - K * H) * P).eval();
  }

  void step(const SlamStep& step) {
    predict(step.motion);
    std::vector<Observation> known, unmapped;
    for (const Observation& observation : step.observations)
      (at.contains(observation.landmark) ? known : unmapped).push_back(observation);
    if (!known.empty()) update(known);
    for (const Observation& observation : unmapped) add(observation);
  }
};

}  // namespace trundle::test
