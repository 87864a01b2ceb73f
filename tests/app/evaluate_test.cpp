// `trundle evaluate` on a reference whose clock is not the robot's: the same as `run` says of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
namespace {

using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

constexpr double kOffset_s = 0.2;
constexpr const char* kLate = R"(name = "late"
robot = "nominal.toml"
steering = "truth"
[truth.noise]
wheel_per_sqrt_m = 0.0005
[truth.reference_sensor]
time_offset_s = 0.2
[reference]
rate_hz = 20
[[run]]
[[run.path]]
drive = "tour"
length_m = 20
)";

/// A tour whose reference's stamps are too early, and the odometry of it.
class EvaluateLate : public testing::Test {
 protected:
  EvaluateLate() {
    write_file(sample_.folder() / "late.toml", kLate);
    EXPECT_EQ(run({"simulate", "late.toml", "-o", "late"}).exit_code, 0);
    EXPECT_EQ(run({"odometry", "late", "--robot", "nominal.toml", "-o", "t.csv"}).exit_code, 0);
  }

  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }
  Json evaluated(Arguments arguments) const {
    arguments.insert(arguments.begin(), "evaluate");
    arguments.emplace_back("--json");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out);
  }

  Sample sample_;
};

double rms_of(const Json& document) {
  return document.at("position_m").at("rms").get<double>();
}

TEST_F(EvaluateLate, FindsTheOffsetOfTheClockByTheSensorsOrByTheEstimate) {
  const std::vector<std::pair<Arguments, std::string>> calls = {
      {{"t.csv", "late", "--robot", "nominal.toml"}, "sensors"},
      {{"t.csv", "late"}, "estimate"},
      {{"t.csv", "late/reference.csv"}, "estimate"},
      {{"t.csv", "late/reference.csv", "--robot", "nominal.toml"}, "estimate"},
      {{"t.csv", "cut", "--robot", "nominal.toml"}, "estimate"}};  // has no wheels
  std::filesystem::create_directory(sample_.folder() / "cut");
  std::filesystem::copy_file(sample_.folder() / "late/reference.csv", sample_.folder() / "cut/reference.csv");
  for (const auto& [arguments, source] : calls) {
    const Json document = evaluated(arguments);
    const Json& clock = document.at("reference_clock");
    ASSERT_TRUE(clock.is_object()) << arguments.at(1);
    EXPECT_EQ(clock.at("from"), source) << arguments.at(1);
    EXPECT_NEAR(clock.at("time_offset_s").get<double>(), kOffset_s, 4.0 * clock.at("sigma_s").get<double>());
    EXPECT_LT(clock.at("sigma_s"), 0.01);
    EXPECT_LT(rms_of(document), 0.9 * rms_of(evaluated({"t.csv", "late", "--time-offset-s", "0"})));
  }
  EXPECT_THAT(run({"evaluate", "t.csv", "late"}).out,
              testing::ContainsRegex("\nClock +reference.time_offset_s 0\\.[12].* ± .* s, from the ways and "
                                     "turns that reference and estimate show\n"));
}

TEST_F(EvaluateLate, GivesTheDocumentOfRun) {
  ASSERT_EQ(run({"run", "late", "--robot", "nominal.toml", "-o", "d"}).err, "");
  const Json evaluation = Json::parse(read_file(sample_.folder() / "d/evaluation.json"));
  for (const Json& trajectory : evaluation.at("trajectories"))
    for (const auto& [alignment, document] : trajectory.at("evaluations").items()) {
      ASSERT_TRUE(document.at("reference_clock").is_object());
      const std::string robot = std::filesystem::exists(sample_.folder() / "d/calibrated.toml")
                                    ? "d/calibrated.toml"
                                    : "nominal.toml";
      EXPECT_EQ(evaluated({"d/" + trajectory.at("file").get<std::string>(), "late", "--robot", robot,
                           "--align", alignment}),
                document)
          << trajectory.at("name") << " " << alignment;
    }
}

TEST_F(EvaluateLate, AStatedOffsetStays) {
  const Json as_stamped = evaluated({"t.csv", "late", "--time-offset-s", "0"});
  EXPECT_EQ(as_stamped.at("options").at("time_offset_s"), "0");
  EXPECT_EQ(as_stamped.at("reference_clock").at("from"), "stated");
  EXPECT_TRUE(as_stamped.at("reference_clock").at("sigma_s").is_null());

  const std::string robot = read_file(sample_.folder() / "nominal.toml");
  write_file(sample_.folder() / "stated.toml", robot + "[reference_sensor]\ntime_offset_s = 0.2\n");
  const Json stated = evaluated({"t.csv", "late", "--time-offset-s", "0.2"});
  EXPECT_LT(rms_of(stated), 0.9 * rms_of(as_stamped));
  for (const Arguments& more : {Arguments{}, Arguments{"--time-offset-s", "0.2"}}) {
    Arguments arguments{"t.csv", "late", "--robot", "stated.toml"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_NEAR(rms_of(evaluated(arguments)), rms_of(stated), 1e-9);
  }
  EXPECT_THAT(run({"evaluate", "t.csv", "late", "--robot", "stated.toml"}).out, Not(HasSubstr("Clock")));
}

}  // namespace
}  // namespace trundle::test
