// The examples do what they say.
#ifdef TRUNDLE_EXAMPLES
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/chassis/parameter.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/file.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/statistics/distribution.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"
#include "scale.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using Json = nlohmann::json;

Outcome run_example(const Sample& sample, const std::string& name, const Arguments& arguments,
                    const std::string& input = {}) {
  return run_program(sample.folder(), arguments,
                     {.input = input, .program = std::string(TRUNDLE_EXAMPLES) + "/example_" + name});
}

TEST(Examples, InAControllerGivesWhatTrundleLiveGives) {
  const Sample sample;
  std::string readings, lines;
  for (int i = 0; i < 200; ++i) {
    const double time_s = 0.05 * i;
    const double rate = i < 100 ? 0.0 : 0.4;
    const int left = 20 * i, right = 20 * i + (i < 100 ? 0 : 25 * (i - 100));
    readings += fmt::format("{} {} {} {}\n", time_s, left, right, rate);
    lines += fmt::format(R"({{"time_s":{},"wheels":{{"left_ticks":{},"right_ticks":{}}},"gyro":{}}})", time_s,
                         left, right, rate) +
             "\n";
  }
  write_file(sample.folder() / "readings.txt", readings);
  write_file(sample.folder() / "lines.jsonl", lines);
  const Outcome example = run_example(sample, "in_a_controller", {kDemoRobot}, "readings.txt");
  EXPECT_EQ(example.exit_code, 0) << example.err;
  const Outcome live =
      run_program(sample.folder(), {"live", "--robot", kDemoRobot}, {.input = "lines.jsonl"});
  std::string expected;
  std::istringstream stream(live.out);
  for (std::string line; std::getline(stream, line);) {
    const Json now = Json::parse(line);
    const Json& pose = now.at("slip").at("corrected");
    char text[200];
    std::snprintf(text, sizeof text, "%.3f s: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m%s\n",
                  now.at("time_s").get<double>(), pose.at("x_m").get<double>(), pose.at("y_m").get<double>(),
                  pose.at("heading_rad").get<double>(),
                  std::sqrt(pose.at("var_xx").get<double>() + pose.at("var_yy").get<double>()),
                  now.at("slip").at("slipping").get<bool>() ? ", slipping" : "");
    expected += text;
  }
  EXPECT_EQ(example.out, expected);
}

/// How far from the goal the robot is after it drove there by what `believed` says.
double real_distance(const Sample& sample, const std::string& believed) {
  const Outcome outcome = run_example(sample, "drive_to_a_goal",
                                      {(kDemo / "session_01/truth.toml").string(), believed, "-3", "2"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string after = "it is ";
  return std::stod(outcome.out.substr(outcome.out.find(after) + after.size()));
}

TEST(Examples, ACalibratedRobotDrivesToTheGoalAndAnotherDoesNot) {
  const Sample sample;
  const double calibrated = real_distance(sample, (kDemo / "session_01/truth.toml").string());
  const double nominal = real_distance(sample, kDemoRobot);
  EXPECT_LT(calibrated, 0.001);
  EXPECT_GT(nominal, 0.01);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The sample's robot, calibrated by the example on these sessions.
std::string calibrated_on(const Sample& sample, const std::vector<std::string>& sessions) {
  Arguments arguments{kDemoRobot, "calibrated.toml"};
  for (const std::string& session : sessions) arguments.push_back((kDemo / session).string());
  const Outcome outcome = run_example(sample, "calibrate", arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.out;
}

constexpr double kFalseAlarm = 0.001;  // of each of the tests below, if the covariances are right

TEST(Examples, CalibrateFindsTheTrueDimensionsWithinItsErrorBars) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Sample sample;
  const std::vector<std::string> printed = lines_of(calibrated_on(sample, {"session_01"}));
  const Robot truth = read_robot(kDemo / "session_01/truth.toml");
  const Robot calibrated = read_robot(sample.folder() / "calibrated.toml");
  ASSERT_TRUE(calibrated.calibration.has_value());
  const CalibrationRecord& found = *calibrated.calibration;
  const auto count = static_cast<Eigen::Index>(found.parameters.size());
  ASSERT_EQ(count, found.covariance.rows());
  ASSERT_GE(printed.size(), found.parameters.size());
  Eigen::VectorXd error(count), error_before(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const CalibratedParameter& parameter = found.parameters[static_cast<std::size_t>(i)];
    const double exact = value_of(*parameter_named(parameter.name, truth), truth);
    error[i] = parameter.value - exact;
    error_before[i] = parameter.nominal - exact;
    EXPECT_EQ(printed[static_cast<std::size_t>(i)],
              fmt::format("{} [{}]: {:.6f} +- {:.6f}, was {:.6f}", parameter.name, parameter.unit,
                          parameter.value, std::sqrt(found.covariance(i, i)), parameter.nominal));
  }
  const double limit = chi_squared_limit(kFalseAlarm, static_cast<double>(count));
  const Eigen::LLT<Eigen::MatrixXd> inverse(found.covariance);
  EXPECT_LT(error.dot(inverse.solve(error)), limit);
  EXPECT_GT(error_before.dot(inverse.solve(error_before)), 100.0 * limit);
}

/// x, y, heading and the 1σ of the position in a line that an example prints.
struct PrintedPose {
  Pose2 pose;
  double sigma_m = 0.0;
};
PrintedPose pose_in(const std::string& line) {
  PrintedPose printed;
  EXPECT_EQ(std::sscanf(line.c_str(), "%*[^x]x %lf m, y %lf m, heading %lf rad, +- %lf m", &printed.pose.x,
                        &printed.pose.y, &printed.pose.heading, &printed.sigma_m),
            4)
      << line;
  return printed;
}

double distance_m(const Pose2& a, const Pose2& b) {
  return (a.translation() - b.translation()).norm();
}

/// The position's error is along one axis at worst.
double greatest_error_m(double sigma_m) {
  return normal_limit(kFalseAlarm / 2.0) * sigma_m;
}

TEST(Examples, SlipFindsWhereWheelsSlippedAndWhereTheRobotEnded) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Sample sample;
  calibrated_on(sample, {"session_01", "session_02", "session_03"});
  const Outcome outcome = run_example(sample, "slip", {"calibrated.toml", (kDemo / "slip").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> printed = lines_of(outcome.out);
  ASSERT_GE(printed.size(), 2U) << outcome.out;
  const PrintedPose corrected = pose_in(printed.back());
  const PrintedPose as_recorded = pose_in(printed[printed.size() - 2]);
  printed.resize(printed.size() - 2);
  std::vector<std::string> truths = lines_of(read_file(kDemo / "slip/truth_slip.csv"));
  std::erase_if(truths, [](const std::string& line) { return !std::isdigit(line.front()); });
  for (const std::string& truth : truths) {
    double true_start_s = 0.0, true_end_s = 0.0, true_excess_m = 0.0;
    ASSERT_EQ(
        std::sscanf(truth.c_str(), "%lf,%lf,%*[^,],%*[^,],%lf", &true_start_s, &true_end_s, &true_excess_m),
        3);
    const auto found = std::ranges::find_if(printed, [&](const std::string& line) {
      double start_s = 0.0, end_s = 0.0, excess_m = 0.0, sigma_m = 0.0;
      EXPECT_EQ(std::sscanf(line.c_str(), "%lf s to %lf s: %*s %*[^,], %lf +- %lf m", &start_s, &end_s,
                            &excess_m, &sigma_m),
                4)
          << line;
      return start_s < true_end_s && end_s > true_start_s &&
             std::abs(excess_m - true_excess_m) < normal_limit(kFalseAlarm / 2.0) * sigma_m;
    });
    ASSERT_NE(found, printed.end()) << truth << "\n" << outcome.out;
    printed.erase(found);
  }
  // One of a hundred intervals without slip is flagged by chance, 0.25 s each of 84 s in motion: more than
  // ten of them once in 1500 times.
  EXPECT_LE(printed.size(), 10U) << outcome.out;
  const Pose2 end = read_trajectory(kDemo / "slip/truth.csv").poses.back().pose;
  EXPECT_LT(distance_m(corrected.pose, end), greatest_error_m(corrected.sigma_m));
  EXPECT_LT(distance_m(corrected.pose, end), 0.5 * distance_m(as_recorded.pose, end));
}

/// Every landmark of the tour is on the map, where it is, within its covariance.
void expect_right_map(const std::filesystem::path& file, const std::filesystem::path& tour) {
  const std::vector<MapLandmark> map = read_landmark_map(file);
  std::map<std::string, Vector2> truth;
  for (const MapLandmark& landmark : read_landmark_map(tour / "landmarks.csv"))
    truth[landmark.name] = landmark.position;
  EXPECT_EQ(map.size(), truth.size());
  const double limit = chi_squared_limit(kFalseAlarm / static_cast<double>(map.size()), 2.0);
  for (const MapLandmark& landmark : map) {
    ASSERT_TRUE(truth.contains(landmark.name)) << landmark.name;
    const Vector2 error = landmark.position - truth[landmark.name];
    EXPECT_LT(error.dot(landmark.covariance.llt().solve(error)), limit) << landmark.name;
    // As thirty sightings make it from as far as the sensor sees: 4 m · 1.5° / √30.
    EXPECT_LT(position_sigma(landmark.covariance), 0.02) << landmark.name;
  }
}

/// Of poses on the tour at these times.
double rms_error_m(const std::vector<StampedPose>& poses, const Trajectory& truth) {
  double sum = 0.0;
  for (const StampedPose& at : poses)
    sum += std::pow(distance_m(at.pose, pose_at(truth, at.time_s, 0.5).value()), 2);
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

class MappingExamples : public testing::Test {
 protected:
  MappingExamples() { calibrated_on(sample_, {"session_01", "session_03"}); }

  /// What the example `slam` prints, and its map.
  std::vector<std::string> online() const {
    const Outcome outcome = run_example(sample_, "slam", {"calibrated.toml", tour_.string(), "map.csv"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return lines_of(outcome.out);
  }

  const std::filesystem::path tour_ = kDemo / "session_02/tour";
  const Trajectory truth_ = read_trajectory(tour_ / "truth.csv");
  Sample sample_;
};

TEST_F(MappingExamples, SlamKnowsWhereTheRobotIsAndMapsWhatIsThere) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  std::vector<StampedPose> poses;
  for (const std::string& line : online()) {
    const PrintedPose now = pose_in(line);
    poses.push_back({std::stod(line), now.pose});
    const Pose2 truth = pose_at(truth_, poses.back().time_s, 0.5).value();
    EXPECT_LE(distance_m(now.pose, truth), greatest_error_m(now.sigma_m) + 1e-4) << line;
  }
  ASSERT_GT(poses.size(), 100U);
  const Robot robot = read_robot(sample_.folder() / "calibrated.toml");
  const Trajectory odometry = integrate(read_recording(tour_), robot).trajectory;
  std::vector<StampedPose> without_landmarks;
  for (const StampedPose& at : poses)
    without_landmarks.push_back({at.time_s, pose_at(odometry, at.time_s, 0.5).value()});
  EXPECT_LT(rms_error_m(poses, truth_), 0.5 * rms_error_m(without_landmarks, truth_));
  expect_right_map(sample_.folder() / "map.csv", tour_);
}

TEST_F(MappingExamples, SmootherIsNearerTheTruthThanTheFilterWasAndAsSureAsItMayBe) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Outcome outcome = run_example(sample_, "smoother",
                                      {"calibrated.toml", tour_.string(), "trajectory.csv", "landmarks.csv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::Not(testing::HasSubstr("inconsistent")));
  const Trajectory smoothed = read_trajectory(sample_.folder() / "trajectory.csv");
  const StampedPose& end = smoothed.poses.back();
  const Pose2 true_end = pose_at(truth_, end.time_s, 0.5).value();
  const Vector3 error(end.pose.x - true_end.x, end.pose.y - true_end.y,
                      wrap_angle(end.pose.heading - true_end.heading));
  EXPECT_LT(error.dot(smoothed.covariances.back().llt().solve(error)), chi_squared_limit(kFalseAlarm, 3.0));
  EXPECT_NEAR(pose_in(outcome.out).sigma_m, position_sigma(smoothed.covariances.back()), 1e-4);
  std::vector<StampedPose> filtered, looking_back;
  for (const std::string& line : online()) {
    filtered.push_back({std::stod(line), pose_in(line).pose});
    looking_back.push_back({filtered.back().time_s, pose_at(smoothed, filtered.back().time_s, 0.5).value()});
  }
  EXPECT_LT(rms_error_m(looking_back, truth_), rms_error_m(filtered, truth_));
  expect_right_map(sample_.folder() / "landmarks.csv", tour_);
}

TEST(Examples, AnErrorIsOneLineAndTheExitCodeOfItsKind) {
  const Sample sample;
  const std::map<std::string, Arguments> missing_robot = {
      {"calibrate", {"no.toml", "out.toml", "cw"}},
      {"drive_to_a_goal", {"no.toml", "no.toml", "1", "1"}},
      {"in_a_controller", {"no.toml"}},
      {"slam", {"no.toml", "seen", "map_out.csv"}},
      {"slip", {"no.toml", "cw"}},
      {"smoother", {"no.toml", "seen", "out.csv", "map_out.csv"}},
  };
  for (const auto& [name, arguments] : missing_robot) {
    const Outcome usage = run_example(sample, name, {});
    EXPECT_EQ(usage.exit_code, 2) << name;
    EXPECT_THAT(usage.err, testing::StartsWith("usage: example_" + name + " "));
    const Outcome wrong = run_example(sample, name, arguments);
    EXPECT_EQ(wrong.exit_code, 3) << name;
    EXPECT_THAT(wrong.err, testing::StartsWith("no.toml: "));
    EXPECT_EQ(std::ranges::count(wrong.err, '\n'), 1) << wrong.err;
  }
  // Two wheels without a gyro cannot show slip.
  EXPECT_EQ(run_example(sample, "slip", {"nominal.toml", "cw"}).exit_code, 4);
  // What was recorded stays.
  const std::string wheels = read_file(sample.folder() / "cw/wheels.csv");
  EXPECT_EQ(run_example(sample, "calibrate", {"nominal.toml", "cw/wheels.csv", "cw"}).exit_code, 3);
  EXPECT_EQ(read_file(sample.folder() / "cw/wheels.csv"), wheels);
}

}  // namespace
}  // namespace trundle::test
#endif
