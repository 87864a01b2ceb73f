// What a landmark sensor's clock that is off makes of `trundle slam` and `localize`: it is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kSeenTour = kDemo / "session_02/tour";

class SensorClock : public testing::Test {
 protected:
  /// With a landmark sensor whose stamps are so much later than its file says.
  Outcome run(const std::string& command, double off_s, const Arguments& further) const {
    std::string robot = read_file(kDemoRobot);
    const std::string table = "[landmark_sensor]\n";
    robot.insert(robot.find(table) + table.size(), "time_offset_s = " + std::to_string(off_s) + "\n");
    write_file(sample_.folder() / "r.toml", robot);
    Arguments arguments{command, kSeenTour.string(), "--robot", "r.toml", "-o", command + ".csv"};
    arguments.insert(arguments.end(), further.begin(), further.end());
    return run_program(sample_.folder(), arguments);
  }
  Sample sample_;
};

TEST_F(SensorClock, ThatIsOffIsNamedByEveryFilter) {
  for (const std::string filter : {"smoother", "ekf"}) {
    EXPECT_THAT(run("slam", 0.0, {"--filter", filter}).out, Not(HasSubstr("stamps"))) << filter;
    const Outcome off = run("slam", 0.3, {"--filter", filter});
    ASSERT_EQ(off.exit_code, 0) << off.err;
    EXPECT_THAT(off.out, testing::ContainsRegex(
                             "warning: sightings: the landmark sensor.s stamps are (29|30)[0-9] ms"))
        << filter;
    const auto document = nlohmann::json::parse(run("slam", 0.3, {"--filter", filter, "--json"}).out);
    EXPECT_EQ(document.at("status"), "landmark sensor's time offset");
  }
}

TEST_F(SensorClock, ThatIsOffIsNamedByLocalization) {
  const Arguments on_map = {"--map", (kSeenTour / "landmarks.csv").string()};
  EXPECT_THAT(run("localize", 0.0, on_map).out, Not(HasSubstr("stamps")));
  const Outcome off = run("localize", 0.3, on_map);
  ASSERT_EQ(off.exit_code, 0) << off.err;
  EXPECT_THAT(off.out,
              testing::ContainsRegex("warning: sightings: the landmark sensor.s stamps are (29|30)[0-9] ms"));
}

}  // namespace
}  // namespace trundle::test
