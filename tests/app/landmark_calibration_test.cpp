// `trundle calibrate --landmarks`: a robot file from what the robot saw, and `trundle run` where that is all
// there is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

constexpr const char* kTour = R"(name = "tour"
robot = "sighted.toml"
[truth]
track_m = 0.21
[truth.wheel.left]
diameter_m = 0.102
[encoders]
rate_hz = 10
[sightings]
rate_hz = 2
give_map = false
[landmarks]
count = 12
box_x_m = 6
box_y_m = 6
[[run]]
[[run.path]]
drive = "tour"
length_m = 20
)";

class CalibrateFromLandmarks : public testing::Test {
 protected:
  CalibrateFromLandmarks() {
    write_file(sample_.folder() / "tour.toml", kTour);
    EXPECT_EQ(run({"simulate", "tour.toml", "-o", "tour"}).exit_code, 0);
  }
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }
  std::string read(const std::string& file) const { return read_file(sample_.folder() / file); }
  Robot robot(const std::string& file) const { return read_robot(sample_.folder() / file); }

  Sample sample_;
};

TEST_F(CalibrateFromLandmarks, WritesARobotFileWithErrorBars) {
  const Outcome outcome =
      run({"calibrate", "tour", "--landmarks", "--robot", "sighted.toml", "-o", "out/calibrated.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("left.diameter"));
  const Robot calibrated = robot("out/calibrated.toml");
  ASSERT_TRUE(calibrated.calibration);
  EXPECT_EQ(calibrated.calibration->covariance.rows(), 4);  // with the scale of ranges, which stays as given
  EXPECT_EQ(calibrated.calibration->parameters.back().name, "sensor.range_scale");
  EXPECT_NEAR(calibrated.chassis.wheels()[0].diameter_m, 0.102, 0.001);
  EXPECT_NEAR(calibrated.chassis.wheels()[1].diameter_m, 0.1, 0.001);
  const Json document = Json::parse(read("out/calibration.json"));
  EXPECT_EQ(document.at("method"), "landmarks");
  EXPECT_EQ(document.at("status"), "all_estimated");
  EXPECT_EQ(document.at("provenance").at("options").at("landmarks"), "true");
}

TEST_F(CalibrateFromLandmarks, IsWhatARunDoesWithoutAReference) {
  std::filesystem::remove(sample_.folder() / "tour/reference.csv");
  ASSERT_EQ(run({"run", "tour", "--robot", "sighted.toml", "-o", "run"}).exit_code, 0);
  ASSERT_EQ(
      run({"calibrate", "tour", "--landmarks", "--robot", "sighted.toml", "-o", "alone/calibrated.toml"})
          .exit_code,
      0);
  EXPECT_EQ(read("run/calibrated.toml"), read("alone/calibrated.toml"));
}

TEST_F(CalibrateFromLandmarks, RefusesWhatCannotAnswer) {
  EXPECT_EQ(run({"calibrate", "blind", "--landmarks", "--robot", "sighted.toml"}).exit_code, 4);
  EXPECT_EQ(run({"calibrate", "tour", "--landmarks", "--robot", "nominal.toml"}).exit_code, 3);
}

TEST_F(CalibrateFromLandmarks, LearnsNoiseIntoTheRobotFile) {
  const Outcome outcome = run({"calibrate", "tour", "--landmarks", "--learn-noise", "--robot", "sighted.toml",
                               "-o", "out/calibrated.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("landmark_sensor.range_sigma_m"));
  const Robot before = robot("sighted.toml");
  const Robot after = robot("out/calibrated.toml");
  EXPECT_NE(after.landmark_sensor->range_sigma_m, before.landmark_sensor->range_sigma_m);
  EXPECT_NEAR(after.landmark_sensor->range_sigma_m, before.landmark_sensor->range_sigma_m,
              0.5 * before.landmark_sensor->range_sigma_m);
  EXPECT_THAT(read("out/calibrated.toml"), HasSubstr("landmark_sensor.range_sigma_m"));
}

}  // namespace
}  // namespace trundle::test
