// Robots with steered wheels: simulated ones, whose truth is known, and a real tricycle.
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/defaults.hpp"
#include "trundle/calibration/estimator.hpp"
#include "trundle/simulation/scenario.hpp"

#include "chassis/robots.hpp"
#include "real_data.hpp"
#include "recording/folder.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {
using namespace simulation;

constexpr double kStep_s = 0.05;
constexpr double kSpeed_m_s = 0.8;
constexpr double kPositionSigma_m = 0.002;
constexpr double kHeadingSigma_rad = 0.005;

/// Straight on, wide and tight curves both ways, back; some of it sideways.
Path rich_drive(double tightest_m, bool sideways = false) {
  Path path;
  const auto go = [&](double length_m, double curvature_1_m, double crab_rad = 0.0) {
    path.push_back({{length_m * std::cos(crab_rad), length_m * std::sin(crab_rad), length_m * curvature_1_m},
                    std::abs(length_m) / kSpeed_m_s});
  };
  for (const double sense : {1.0, -1.0}) {
    go(3.0, 0.0);
    go(6.0 * tightest_m, sense / tightest_m);
    go(3.0, sense / (3.0 * tightest_m));
    go(-2.0, 0.0);
    go(-3.0, -sense / (2.0 * tightest_m));
    if (!sideways) continue;
    go(2.0, 0.0, sense * 1.2);
    go(2.0, 0.5, sense * 0.6);
  }
  return path;
}

Path circles(double radius_m, double length_m) {
  return {Segment{{length_m, 0.0, length_m / radius_m}, length_m / kSpeed_m_s}};
}

/// What the robot `truth` records on that drive, with the reference at every fifth step.
Recording recorded_drive(const Robot& truth, const Path& drive, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  scenario.path = drive;
  scenario.steering = Steering::truth;
  scenario.encoders = {.rate_hz = 1.0 / kStep_s, .unit = WheelUnit::radians};
  scenario.reference.rate_hz = 0.2 / kStep_s;
  scenario.reference.position_sigma_m = kPositionSigma_m;
  scenario.reference.heading_sigma_rad = kHeadingSigma_rad;
  scenario.seed = seed;
  Recording recording = simulate(scenario).recording;
  recording.name = fmt::format("drive {}", seed);
  recording.session = "one";
  return recording;
}

/// A reading of the steering is that of the interval before its stamp.
constexpr SteeringSensor kHalfAStepEarlier{.sigma_rad = 0.005, .time_offset_s = -0.5 * kStep_s};

Robot robot_of(const Chassis& chassis) {
  Robot robot = test::robot_of(chassis);
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 0.0;
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  return robot;
}

Robot nominal_tricycle() {
  return robot_of(tricycle(test::kSize, 0.6, kHalfAStepEarlier));
}
Robot nominal_car() {
  return robot_of(ackermann(test::kSize, 0.4, 0.6, 0.0, kHalfAStepEarlier));
}

Robot nominal_swerve() {
  return robot_of(swerve(test::kSize, 0.4, 0.6, kHalfAStepEarlier));
}

/// Each of its default parameters off by some of its prior.
Robot off(const Robot& nominal) {
  Robot truth = nominal;
  int sign = 1;
  for (const Parameter& parameter : default_parameters(nominal, {.length = true, .anything = true})) {
    const double share = parameter.kind == ParameterKind::place_x ? 0.1 : 0.3;
    const double moved = (sign = -sign) * share * prior_sigma(parameter, nominal);
    set_value(parameter, value_of(parameter, nominal) + moved, truth);
  }
  return truth;
}

/// The share of 95 % intervals that hold the truth, parameter by parameter.
void expect_intervals_to_hold(const Robot& nominal, int full, bool sideways = false) {
  const Robot truth = off(nominal);
  const int times = test::trials(full, 4);
  Eigen::VectorXd covered;
  std::vector<Parameter> parameters;
  for (int i = 0; i < times; ++i) {
    const auto seed = 100 + 2 * static_cast<std::uint64_t>(i);
    std::vector<Run> runs;
    for (const Recording& recording : {recorded_drive(truth, rich_drive(1.0, sideways), seed),
                                       recorded_drive(truth, rich_drive(0.7, sideways), seed + 1)})
      runs.push_back(prepare_run(recording, nominal));
    parameters = default_parameters(nominal, from_outside(runs));
    if (covered.size() == 0) covered = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
    const Estimate estimate = estimate_parameters({runs, nominal, parameters});
    for (Eigen::Index j = 0; j < covered.size(); ++j) {
      const Parameter& parameter = parameters[static_cast<std::size_t>(j)];
      const double error = value_of(parameter, estimate.robot) - value_of(parameter, truth);
      if (std::abs(error) <= 1.959964 * std::sqrt(estimate.covariance(j, j))) covered[j] += 1.0 / times;
    }
  }
  // 93 to 97 % over a thousand; with fewer, 3 σ of the binomial are added to both sides.
  const double missing = times < 1000 ? 3.0 * std::sqrt(0.95 * 0.05 / times) : 0.0;
  for (Eigen::Index j = 0; j < covered.size(); ++j) {
    const std::string name = name_of(parameters[static_cast<std::size_t>(j)], nominal);
    std::printf("%s: %.3f\n", name.c_str(), covered[j]);
    EXPECT_GE(covered[j], 0.93 - missing) << name;
    EXPECT_LE(covered[j], 0.97 + missing) << name;
  }
}

TEST(Steered, intervals_of_a_tricycle_hold) {
  expect_intervals_to_hold(nominal_tricycle(), 40);
}

TEST(Steered, intervals_of_a_car_hold) {
  expect_intervals_to_hold(nominal_car(), 40);
}

TEST(Steered, intervals_of_a_swerve_hold) {
  expect_intervals_to_hold(nominal_swerve(), 24, true);
}

TEST(Steered, circles_of_one_radius_do_not_show_wheelbase_and_scale_apart) {
  const Robot nominal = nominal_tricycle();
  Robot truth = nominal;  // so wrong that a calibration holds beyond its runs
  truth.chassis.wheels()[0].diameter_m *= 1.02;
  truth.chassis.wheels()[0].steering->zero_rad = 0.03;
  const std::vector<Recording> runs = {recorded_drive(truth, circles(8.0, 40.0), 1),
                                       recorded_drive(truth, circles(-8.0, 40.0), 2)};
  const CalibrationResult result = calibrate(runs, {}, nominal, {.learn_noise = false});
  EXPECT_THAT(result.unobservable,
              testing::Contains(testing::AllOf(
                  testing::HasSubstr("unobservable combination"), testing::HasSubstr("w0.steering_scale"),
                  testing::HasSubstr("w0.x"), testing::HasSubstr("curves of very different radii"))));
}

TEST(Steered, a_wrong_zero_is_found_without_a_word_of_noise) {
  Robot truth = nominal_tricycle();
  truth.chassis.wheels()[0].steering->zero_rad = 0.05;
  const std::vector<Recording> runs = {recorded_drive(truth, rich_drive(1.0), 3)};
  const CalibrationResult result = calibrate(runs, {}, nominal_tricycle());
  const SteeringSensor& steering = *result.calibrated.chassis.wheels()[0].steering;
  EXPECT_NEAR(steering.zero_rad, 0.05, 0.001);
  EXPECT_EQ(parse_robot(to_toml(result.calibrated), "r").chassis.wheels()[0].steering->zero_rad,
            steering.zero_rad);
}

// --- a real tricycle

/// The runs below a folder of optiodom_tricyc: time, x, y, heading, counts since the row before, steering.
std::vector<Recording> real_tricycle(const std::string& below) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(test::real_data() / "optiodom_tricyc" / below))
    if (entry.path().filename().string().find("_run-") != std::string::npos) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<Recording> recordings;
  for (const auto& file : files) {
    const test::Folder folder;
    folder.write("recording.toml", fmt::format(R"(
session = "{0}"
[wheels]
file = "{1}"
header = false
increments = true
columns = {{ time_s = 1, front_ticks = 5, front_steering_rad = 6 }}
[reference]
file = "{1}"
header = false
columns = {{ time_s = 1, x_m = 2, y_m = 3, heading_rad = 4 }}
)",
                                               file.parent_path().filename().string(), file.string()));
    recordings.push_back(read_recording(folder.path()));
  }
  return recordings;
}

TEST(Steered, squares_and_circles_of_a_real_tricycle_predict_its_free_runs) {
  TRUNDLE_NEEDS_REAL_DATA("optiodom_tricyc");
  Robot nominal;
  nominal.wheel_names = {"front"};
  nominal.passive_names = {"rear"};
  nominal.chassis = tricycle({0.065, 1600.0, 0}, 0.15, kHalfAStepEarlier);
  std::vector<Recording> training = real_tricycle("square");
  std::ranges::move(real_tricycle("circular"), std::back_inserter(training));
  std::vector<Recording> hold_out = real_tricycle("free/140120211508");
  std::ranges::move(real_tricycle("free/140120211525"), std::back_inserter(hold_out));
  const CalibrationResult result = calibrate(training, hold_out, nominal);
  std::vector<const RunResult*> held;
  for (const RunResult& run : result.runs)
    if (run.hold_out) held.push_back(&run);
  ASSERT_EQ(held.size(), 2U);
  for (const RunResult* run : held)
    std::printf("rms %.4f m, worst point %.4f m, nominal %.4f m\n", run->after->position_rms_m,
                run->after->position_max_m, run->before->position_max_m);
  EXPECT_NEAR(held[1]->before->position_max_m, 0.824, 0.0005);  // as its authors have it
  EXPECT_LE(held[0]->after->position_rms_m, 0.03);              // of 0.37 m
  EXPECT_LE(held[1]->after->position_max_m, 0.06);              // their optimisers: 0.054 and 0.086 m
  EXPECT_NEAR(degrees(result.calibrated.chassis.wheels()[0].steering->zero_rad), 1.1, 0.1);
}

}  // namespace
}  // namespace trundle::calibration
