#include "trundle/slam/association/joint_compatibility.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

/// Observations, each with some landmarks it may show; an innovation all share, and noise of each.
JointReadings some_readings(Random& random, std::size_t observations, std::size_t landmarks) {
  JointReadings readings;
  readings.observations = observations;
  for (std::size_t i = 0; i < observations; ++i)
    for (std::size_t j = 0; j < landmarks; ++j)
      if (random.uniform() < 0.6) readings.pairings.push_back({i, j});
  const auto rows = 2 * static_cast<Index>(readings.pairings.size());
  Eigen::MatrixXd H(rows, 3);
  for (Index k = 0; k < H.size(); ++k) H(k) = random.normal();
  readings.S = H * H.transpose();
  readings.S.diagonal().array() += 0.1;
  readings.innovation.resize(rows);
  const Eigen::Vector3d shared(random.normal(), random.normal(), random.normal());
  for (Index k = 0; k < rows; ++k) readings.innovation[k] = H.row(k).dot(shared) + random.normal(0.4);
  return readings;
}

struct Scored {
  double cost;
  double nis;
};

/// Of a whole choice, by dense algebra.
Scored scored(const JointReadings& readings, const std::vector<int>& choice, double none) {
  std::vector<Index> rows;
  double cost = 0.0;
  for (const int p : choice) {
    if (p < 0)
      cost += none;
    else
      rows.insert(rows.end(), {2 * p, 2 * p + 1});
  }
  if (rows.empty()) return {cost, 0.0};
  const Eigen::MatrixXd S = readings.S(rows, rows);
  const Eigen::VectorXd nu = readings.innovation(rows);
  const double nis = nu.dot(S.inverse() * nu);
  return {cost + nis + std::log(S.determinant()) + static_cast<double>(rows.size()) * std::log(2.0 * M_PI),
          nis};
}

/// Costs of all explanations that are allowed, cheapest first.
std::vector<double> by_trying_all(const JointReadings& readings, double none,
                                  const std::vector<double>& limit) {
  std::vector<double> costs;
  std::vector<int> choice(readings.observations, JointExplanation::kNone);
  const std::function<void(std::size_t)> extend = [&](std::size_t i) {
    if (i == choice.size()) {
      std::vector<std::size_t> landmarks;
      for (const int p : choice)
        if (p >= 0) landmarks.push_back(readings.pairings[static_cast<std::size_t>(p)].landmark);
      const std::set<std::size_t> distinct(landmarks.begin(), landmarks.end());
      const Scored all = scored(readings, choice, none);
      if (distinct.size() == landmarks.size() && all.nis <= limit[landmarks.size()])
        costs.push_back(all.cost);
      return;
    }
    choice[i] = JointExplanation::kNone;
    extend(i + 1);
    for (std::size_t p = 0; p < readings.pairings.size(); ++p)
      if (readings.pairings[p].observation == i) {
        choice[i] = static_cast<int>(p);
        extend(i + 1);
      }
    choice[i] = JointExplanation::kNone;
  };
  extend(0);
  std::ranges::sort(costs);
  return costs;
}

TEST(JointCompatibility, AreTheMostProbableOfAllExplanations) {
  Random random(3);
  constexpr double kNone = 8.0;
  const double least = 2.0 * std::log(0.1) + 2.0 * std::log(2.0 * M_PI);
  const std::vector<double> limit = joint_limits(1e9, 8);
  for (int run = 0; run < 200; ++run) {
    const JointReadings readings = some_readings(random, 1 + random.below(4), 1 + random.below(3));
    const auto all = by_trying_all(readings, kNone, limit);
    const auto found = most_probable_explanations(
        readings, {.none = kNone, .least = least, .limit = limit, .most = 5, .most_nodes = 1'000'000});
    ASSERT_EQ(found.size(), std::min<std::size_t>(5, all.size()));
    for (std::size_t k = 0; k < found.size(); ++k) {
      ASSERT_NEAR(found[k].cost, all[k], 1e-8);
      ASSERT_NEAR(scored(readings, found[k].pairing, kNone).cost, found[k].cost, 1e-8);
    }
  }
}

TEST(JointCompatibility, WhatIsIncompatibleTogetherIsNotTaken) {
  // Each alone is within two sigma; but both depend on the same unknown, which cannot be +2 and −2.
  JointReadings readings;
  readings.observations = 2;
  readings.pairings = {{0, 0}, {1, 1}};
  readings.S = Eigen::MatrixXd::Zero(4, 4);
  readings.S.block<2, 2>(0, 0).setIdentity();
  readings.S.block<2, 2>(2, 2).setIdentity();
  readings.S(0, 2) = readings.S(2, 0) = 0.99;
  readings.innovation = Eigen::Vector4d(2.0, 0.0, -2.0, 0.0);
  const std::vector<double> limit = joint_limits(13.8, 4);
  const JointCompatibilityOptions options{.none = 12.0, .limit = limit};
  EXPECT_EQ(
      std::ranges::count(most_probable_explanations(readings, options)[0].pairing, JointExplanation::kNone),
      1);
  readings.innovation[2] = 2.0;
  EXPECT_EQ(
      std::ranges::count(most_probable_explanations(readings, options)[0].pairing, JointExplanation::kNone),
      0);
}

TEST(JointCompatibility, WorkIsBounded) {
  Random random(4);
  const JointReadings readings = some_readings(random, 30, 25);
  const std::vector<double> limit = joint_limits(13.8, 30);
  const auto found = most_probable_explanations(readings, {.none = 8.0, .limit = limit, .most_nodes = 500});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(scored(readings, found[0].pairing, 8.0).cost, found[0].cost, 1e-6);
}

TEST(JointCompatibility, OfNothing) {
  const auto found = most_probable_explanations({}, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].pairing.empty());
}

TEST(JointCompatibility, LimitsHaveTheTailOfTheGate) {
  const std::vector<double> limit = joint_limits(9.21, 10);
  EXPECT_NEAR(limit[1], 9.21, 1e-9);
  EXPECT_NEAR(chi_squared_tail(limit[10], 20.0), chi_squared_tail(9.21, 2.0), 1e-9);
}

}  // namespace
}  // namespace trundle::slam
