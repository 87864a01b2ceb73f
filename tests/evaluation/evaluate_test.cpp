#include "trundle/evaluation/evaluate.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/evaluation/align.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/random.hpp"

#include "brute_force.hpp"

namespace trundle::evaluation {
namespace {

/// A winding drive sampled at a rate, with headings that grow past π.
Trajectory winding(double rate_hz, double duration_s, double start_s = 0.0) {
  Trajectory trajectory;
  Pose2 pose{1.0, -2.0, 3.0};
  for (int k = 0; k / rate_hz <= duration_s; ++k) {
    trajectory.poses.push_back({start_s + k / rate_hz, pose});
    pose =
        pose * exp({0.4 / rate_hz, 0.0, 0.3 * std::sin(0.1 * k / rate_hz + 0.4) / rate_hz + 0.1 / rate_hz});
  }
  return trajectory;
}

/// The same drive with drift and noise, in another frame.
Trajectory disturbed(const Trajectory& truth, const Pose2& frame, std::uint64_t seed) {
  Random random(seed);
  Trajectory trajectory;
  Pose2 pose = frame * truth.poses.front().pose;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    if (i > 0) {
      const Twist2 step = log(truth.poses[i - 1].pose.inverse() * truth.poses[i].pose);
      pose = pose * exp({1.01 * step.dx, random.normal(0.001), step.dtheta + random.normal(0.003)});
    }
    trajectory.poses.push_back({truth.poses[i].time_s, {pose.x, pose.y, wrap_angle(pose.heading)}});
  }
  return trajectory;
}

struct Runs {
  Trajectory reference = winding(13.0, 60.0, 0.03);  // other stamps than the estimate's
  Trajectory estimate = disturbed(winding(20.0, 60.0), {0.3, -0.2, 0.7}, 5);
};

TEST(Evaluate, RelativeErrorsAgreeWithEveryPairTried) {
  const Runs runs;
  const auto all = test::brute_force::samples(runs.estimate, runs.reference, 0.5);
  const Evaluation result = evaluate(runs.estimate, runs.reference);
  ASSERT_EQ(result.relative.size(), 4u);
  for (const RelativePoseError& error : result.relative) {
    const auto expected = test::brute_force::relative(all, error.distance_m, 0.01);
    EXPECT_GT(expected.pairs, 100u);
    EXPECT_EQ(error.pairs, expected.pairs);
    EXPECT_NEAR(error.translation_rms_m, expected.translation_rms_m, 1e-9);
    EXPECT_NEAR(error.translation_mean_percent, expected.translation_mean_percent, 1e-7);
    EXPECT_NEAR(error.heading_rms_rad, expected.heading_rms_rad, 1e-9);
  }
}

TEST(Evaluate, AlignmentSe2AgreesWithNumericMinimisation) {
  const Runs runs;
  const auto all = test::brute_force::samples(runs.estimate, runs.reference, 0.5);
  const Eigen::Matrix3d T = test::brute_force::align_se2(all);
  const Evaluation result = evaluate(runs.estimate, runs.reference, {.alignment = Alignment::se2});
  EXPECT_NEAR(wrap_angle(result.reference_from_estimate.heading - test::brute_force::angle_of(T)), 0.0, 1e-7);
  EXPECT_NEAR(result.reference_from_estimate.x, T(0, 2), 1e-6);
  EXPECT_NEAR(result.reference_from_estimate.y, T(1, 2), 1e-6);
  const double angle = result.reference_from_estimate.heading;
  EXPECT_NEAR(result.position_m.rms, std::sqrt(test::brute_force::cost(all, angle) / double(all.size())),
              1e-9);
}

class EveryAlignment : public testing::TestWithParam<Alignment> {};

TEST_P(EveryAlignment, AbsoluteErrorsAgreeWithTheirDefinition) {
  const Runs runs;
  const auto all = test::brute_force::samples(runs.estimate, runs.reference, 0.5);
  const Evaluation result = evaluate(runs.estimate, runs.reference, {.alignment = GetParam()});
  Eigen::Matrix3d T = Eigen::Matrix3d::Identity();
  if (GetParam() == Alignment::start) T = all.front().reference * all.front().estimate.inverse();
  if (GetParam() == Alignment::se2) T = test::brute_force::align_se2(all);
  double sum = 0.0, sum2 = 0.0, greatest = 0.0, heading2 = 0.0;
  std::vector<double> errors;
  for (const auto& s : all) {
    const Eigen::Matrix3d estimate = T * s.estimate;
    errors.push_back((estimate - s.reference).topRightCorner<2, 1>().norm());
    sum += errors.back(), sum2 += errors.back() * errors.back(), greatest = std::max(greatest, errors.back());
    heading2 += std::pow(test::brute_force::angle_of(s.reference.inverse() * estimate), 2);
  }
  const auto n = double(all.size());
  EXPECT_EQ(result.compared, all.size());
  EXPECT_NEAR(result.position_m.mean, sum / n, 1e-6);
  EXPECT_NEAR(result.position_m.rms, std::sqrt(sum2 / n), 1e-6);
  EXPECT_NEAR(result.position_m.max, greatest, 1e-6);
  EXPECT_NEAR(*result.heading_rms_rad, std::sqrt(heading2 / n), 1e-7);
  EXPECT_NEAR(result.final_position_m, errors.back(), 1e-6);
  std::ranges::sort(errors);
  EXPECT_NEAR(result.position_m.median, 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]),
              1e-6);
  EXPECT_NEAR(result.path_m, test::brute_force::way(all, all.size() - 1, 0.01), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Alignments, EveryAlignment,
                         testing::Values(Alignment::none, Alignment::start, Alignment::se2),
                         [](const auto& test) { return std::string(name_of(test.param)); });

/// Along x with 1 m per second, `scale` times as far.
Trajectory straight_drive(int seconds, double scale) {
  Trajectory trajectory;
  for (int k = 0; k <= seconds; ++k) trajectory.poses.push_back({0.5 * k, {0.5 * k * scale, 0.0, 0.0}});
  return trajectory;
}

TEST(Evaluate, KnownExample) {
  // 10 m in steps of 0.5 m, the estimate 1 % too long: errors 0, 0.005, ..., 0.1 m.
  const Evaluation result = evaluate(straight_drive(20, 1.01), straight_drive(20, 1.0));
  EXPECT_EQ(result.compared, 21u);
  EXPECT_NEAR(result.path_m, 10.0, 1e-12);
  EXPECT_NEAR(result.overlap_s(), 10.0, 1e-12);
  EXPECT_NEAR(result.position_m.mean, 0.05, 1e-12);
  EXPECT_NEAR(result.position_m.median, 0.05, 1e-12);
  EXPECT_NEAR(result.position_m.max, 0.1, 1e-12);
  EXPECT_NEAR(result.position_m.rms, 0.005 * std::sqrt(2870.0 / 21.0), 1e-12);  // Σ k², k = 0 ... 20, is 2870
  EXPECT_NEAR(*result.final_percent, 1.0, 1e-12);
  EXPECT_EQ(*result.heading_rms_rad, 0.0);
  const std::vector<std::size_t> pairs = {19, 17, 11, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(result.relative[i].pairs, pairs[i]);
    EXPECT_NEAR(result.relative[i].translation_mean_percent, 1.0, 1e-9);
    EXPECT_NEAR(result.relative[i].translation_rms_m, 0.01 * result.relative[i].distance_m, 1e-12);
  }
}

TEST(Evaluate, EqualTrajectoriesHaveNoError) {
  const Trajectory drive = winding(10.0, 30.0);
  for (const Alignment alignment : {Alignment::none, Alignment::start, Alignment::se2}) {
    const Evaluation result = evaluate(drive, drive, {.alignment = alignment});
    EXPECT_LT(result.position_m.max, 1e-12);
    EXPECT_LT(*result.heading_rms_rad, 1e-12);
    EXPECT_LT(result.relative[3].translation_rms_m, 1e-12);
  }
}

TEST(Evaluate, NoPoseIsInventedInAGap) {
  Trajectory estimate = winding(20.0, 30.0);
  std::erase_if(estimate.poses, [](const StampedPose& p) { return p.time_s > 10.01 && p.time_s < 14.99; });
  const Trajectory reference = winding(13.0, 30.0, 0.003);
  const Evaluation result = evaluate(estimate, reference);
  const auto in_gap = std::ranges::count_if(
      reference.poses, [](const StampedPose& p) { return p.time_s > 10.0 && p.time_s < 15.0; });
  const auto after_end =
      std::ranges::count_if(reference.poses, [](const StampedPose& p) { return p.time_s > 30.0; });
  EXPECT_GT(in_gap, 50);
  EXPECT_EQ(result.compared, reference.poses.size() - static_cast<std::size_t>(in_gap + after_end));
}

TEST(Evaluate, PathAtRestIsNotMadeOfNoise) {
  Trajectory reference = straight_drive(20, 1.0);
  Random random(2);
  for (int k = 1; k <= 1000; ++k)
    reference.poses.push_back({10.0 + 0.01 * k, {10.0 + random.normal(0.001), random.normal(0.001), 0.0}});
  const Evaluation result = evaluate(reference, reference);
  EXPECT_NEAR(result.path_m, 10.0, 0.011);
}

TEST(Evaluate, ReferenceWithoutHeadingStillHasPositions) {
  const Runs runs;
  Trajectory positions = runs.reference;
  for (StampedPose& p : positions.poses) p.pose.heading = std::nan("");
  EXPECT_THROW(evaluate(runs.estimate, positions), CannotAnswer);
  const Evaluation with = evaluate(runs.estimate, runs.reference, {.alignment = Alignment::se2});
  const Evaluation without = evaluate(runs.estimate, positions, {.alignment = Alignment::se2});
  EXPECT_EQ(with.position_m.rms, without.position_m.rms);
  EXPECT_FALSE(without.heading_rms_rad);
  EXPECT_FALSE(without.final_heading_rad);
  EXPECT_TRUE(without.relative.empty());
}

TEST(Evaluate, SaysWhenThereIsNothingToCompare) {
  const Trajectory drive = winding(10.0, 5.0);
  const Trajectory later = winding(10.0, 5.0, 100.0);
  EXPECT_THROW(evaluate(drive, later), CannotAnswer);
  EXPECT_THROW(evaluate(drive, {}), CannotAnswer);
  EXPECT_THROW(evaluate({}, drive), CannotAnswer);
  const Trajectory one{{drive.poses[7]}, {}};
  EXPECT_THROW(evaluate(drive, one), CannotAnswer);
}

TEST(Evaluate, Se2OfAStandingRobotIsRefused) {
  Trajectory standing;
  for (int k = 0; k < 5; ++k) standing.poses.push_back({0.1 * k, {1.0, 1.0, 0.1 * k}});
  EXPECT_THROW(evaluate(standing, standing, {.alignment = Alignment::se2}), CannotAnswer);
  EXPECT_FALSE(evaluate(standing, standing).final_percent);
}

}  // namespace
}  // namespace trundle::evaluation
