// `trundle localize` as its users meet it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
namespace {

using testing::IsEmpty;

TEST(Localize, FindsThePoseThatAWrongStartHides) {
  const Sample sample;
  const std::filesystem::path demo = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";
  const std::filesystem::path tour = demo / "session_02/tour";
  for (const std::string filter : {"ekf", "particles"}) {
    for (const std::string start : {"3,0,0", "0,0,180", "20,0,0"}) {
      const Outcome outcome = run_program(
          sample.folder(), {"localize", tour, "--robot", demo / "robot.toml", "--map", tour / "landmarks.csv",
                            "--start", start, "--filter", filter, "--json", "-o", "out.csv"});
      ASSERT_EQ(outcome.exit_code, 0) << filter << " from " << start;
      EXPECT_THAT(outcome.err, IsEmpty());
      EXPECT_LT(nlohmann::json::parse(outcome.out).at("localized_s").get<double>(), 1.0) << start;
    }
  }
}

}  // namespace
}  // namespace trundle::test
