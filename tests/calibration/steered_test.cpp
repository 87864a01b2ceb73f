// Robots with steered wheels: simulated ones, whose truth is known, and a real tricycle.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/io/error.hpp"

#include "calibration/steered_drives.hpp"
#include "held_limits.hpp"
#include "real_data.hpp"
#include "recording/folder.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {
using test::kHalfAStepEarlier, test::rich_drive, test::simulated_drive, test::steered_robot;

Path circles(double radius_m, double length_m) {
  return {Segment{{length_m, 0.0, length_m / radius_m}, length_m / test::kSpeed_m_s}};
}

/// The share of 95 % intervals that hold the truth, parameter by parameter.
void expect_intervals_to_hold(std::string_view kind, bool blind, int full) {
  const int times = test::trials(full, 3);
  const test::SteeredSeries series = test::steered_series(kind, blind, times);
  const auto [least, most] = test::held_limits(times);
  for (std::size_t j = 0; j < series.names.size(); ++j) {
    const double held = series.held[static_cast<Eigen::Index>(j)];
    std::printf("%s: %.3f\n", series.names[j].c_str(), held);
    EXPECT_GE(held, least - 1e-9) << series.names[j];
    EXPECT_LE(held, most + 1e-9) << series.names[j];
  }
}

TEST(Steered, intervals_of_a_tricycle_hold) {
  expect_intervals_to_hold("tricycle", false, 40);
}

TEST(Steered, intervals_of_a_tricycle_hold_by_another_simulation) {
  expect_intervals_to_hold("tricycle", true, 40);
}

TEST(Steered, intervals_of_a_car_hold) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_intervals_to_hold("car", false, 24);
}

TEST(Steered, intervals_of_a_swerve_hold) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_intervals_to_hold("swerve", false, 24);
}

std::vector<Recording> with_reversed_steering(const Robot& robot, bool has_headings) {
  std::vector<Recording> runs;
  for (const std::uint64_t seed : {1, 2}) {
    Recording run = simulated_drive(robot, rich_drive(1.0), seed);
    for (auto& steering : run.wheels.steering)
      for (double& angle : steering.value) angle = -angle;
    if (!has_headings) std::ranges::fill(run.reference.heading_rad, recording::kNotMeasured);
    runs.push_back(std::move(run));
  }
  return runs;
}

TEST(Steered, a_steering_that_is_reversed_is_put_right) {
  const Robot robot = steered_robot("tricycle");
  const CalibrationResult result = calibrate(with_reversed_steering(robot, true), {}, robot);
  EXPECT_THAT(result.warnings,
              testing::Contains(testing::HasSubstr("steering_scale = -1; already compensated")));
  EXPECT_NEAR(result.calibrated.chassis.wheels()[0].steering->scale, -1.0, 0.02);
}

/// A fit finds a zero on the other side.
TEST(Steered, a_path_that_positions_show_mirrored_is_refused) {
  const Robot robot = steered_robot("tricycle");
  try {
    calibrate(with_reversed_steering(robot, false), {}, robot);
    FAIL() << "a steering of the wrong sign was estimated away";
  } catch (const CannotAnswer& reason) {
    EXPECT_THAT(reason.what(), testing::HasSubstr("bends the other way than the wheels are steered"));
  }
}

TEST(Steered, circles_of_one_radius_do_not_show_wheelbase_and_scale_apart) {
  const Robot nominal = steered_robot("tricycle");
  Robot truth = nominal;  // so wrong that a calibration holds beyond its runs
  truth.chassis.wheels()[0].diameter_m *= 1.02;
  truth.chassis.wheels()[0].steering->zero_rad = 0.03;
  const std::vector<Recording> runs = {simulated_drive(truth, circles(8.0, 40.0), 1),
                                       simulated_drive(truth, circles(-8.0, 40.0), 2)};
  const CalibrationResult result = calibrate(runs, {}, nominal, {.learn_noise = false});
  EXPECT_THAT(result.unobservable,
              testing::Contains(testing::AllOf(
                  testing::HasSubstr("unobservable combination"), testing::HasSubstr("w0.steering_scale"),
                  testing::HasSubstr("w0.x"), testing::HasSubstr("curves of very different radii"))));
}

TEST(Steered, a_wrong_zero_is_found_without_a_word_of_noise) {
  Robot truth = steered_robot("tricycle");
  truth.chassis.wheels()[0].steering->zero_rad = 0.05;
  const std::vector<Recording> runs = {simulated_drive(truth, rich_drive(1.0), 3)};
  const CalibrationResult result = calibrate(runs, {}, steered_robot("tricycle"));
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
  TRUNDLE_NOT_UNDER_SANITIZERS();
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
