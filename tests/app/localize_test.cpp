// `trundle localize` as its users meet it.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
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

std::ptrdiff_t count_of_lines(const std::string& text) {
  return std::ranges::count(text, '\n');
}

TEST(Localize, TellsEveryStepAndEverySighting) {
  const Sample sample;
  for (const std::string filter : {"ekf", "particles"}) {
    const Outcome outcome =
        run_program(sample.folder(), {"localize", "seen", "--robot", "sighted.toml", "--map", "map.csv",
                                      "--start", "0,0,0", "--filter", filter, "--steps", "s.csv",
                                      "--innovations", "i.csv", "--json", "-o", "t.csv"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto document = nlohmann::json::parse(outcome.out);
    const std::string steps = read_file(sample.folder() / "s.csv");
    const std::string rows = steps.substr(steps.find("\ntime_s") + 1);
    EXPECT_EQ(count_of_lines(rows), document.at("steps").get<std::ptrdiff_t>() + 1);
    EXPECT_THAT(rows,
                testing::StartsWith("time_s,phase,sightings,matched,rejected,alarm,hypotheses,particles,"
                                    "effective_particles\n"));
    EXPECT_THAT(rows, testing::HasSubstr("\n1.02,tracking,1,"));
    EXPECT_TRUE(rows.ends_with(",0,0\n")) << filter;  // with names both are one Gaussian
    const std::string innovations = read_file(sample.folder() / "i.csv");
    EXPECT_EQ(count_of_lines(innovations.substr(innovations.find("\ntime_s") + 1)), 9);
    EXPECT_THAT(innovations,
                testing::ContainsRegex("\n1.02,c,(matched|rejected),[-0-9.e]+,[-0-9.e]+,[0-9.e-]+\n"));
  }
}

}  // namespace
}  // namespace trundle::test
