// Whatever files and folders are called.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;

TEST(ANameThatIsNotUtf8, IsRepairedInJson) {
  const Sample sample;
  const std::string robot = "nominal\xff.toml";
  std::filesystem::copy(sample.folder() / "nominal.toml", sample.folder() / robot);
  const Outcome outcome = run_program(sample.folder(), {"info", "ccw", "--robot", robot, "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << outcome.out;
}

TEST(ANameThatCommandsATerminal, IsShownInstead) {
  const Sample sample;
  const std::string name = "c\nw\x1b[2J";
  std::filesystem::copy(sample.folder() / "cw", sample.folder() / name);
  for (const Arguments& arguments :
       {Arguments{"info", name}, Arguments{"run", name, "--robot", "nominal.toml", "-o", "result"},
        Arguments{"odometry", name, "--robot", "nominal.toml", "-o", "t.csv"}}) {
    const Outcome outcome = run_program(sample.folder(), arguments);
    EXPECT_THAT(outcome.out + outcome.err, testing::Not(HasSubstr("\x1b"))) << arguments.front();
  }
  const std::string head = read_file(sample.folder() / "t.csv");
  EXPECT_THAT(head, HasSubstr("# input c\\x0Aw\\x1B[2J/wheels.csv"));
  EXPECT_THAT(head, testing::Not(HasSubstr("\x1b")));
}

TEST(ALoopOfLinks, IsAnInputThatIsWrong) {
  const Sample sample;
  std::filesystem::create_symlink("loop", sample.folder() / "loop");
  for (const std::string& recording : {std::string("loop"), std::string(300, 'a')}) {
    const Outcome outcome = run_program(sample.folder(), {"info", recording});
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_THAT(outcome.err, IsOneLineOfError());
  }
}

}  // namespace
}  // namespace trundle::test
