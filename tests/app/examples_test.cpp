// The examples do what they say.
#ifdef TRUNDLE_EXAMPLES
#include <cmath>
#include <cstdio>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
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

}  // namespace
}  // namespace trundle::test
#endif
