// Whatever the system has closed or does not give, a result is whole and an end has its exit code.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

const Arguments kOdometry = {"odometry", "cw", "--robot", "nominal.toml", "-o", "t.csv"};

/// No file takes the number of a stream that is not there, and what is printed does not end in it.
TEST(StreamsThatAreClosed, ChangeNoResult) {
  const Sample sample;
  ASSERT_EQ(run_program(sample.folder(), kOdometry).exit_code, 0);
  const std::string whole = read_file(sample.folder() / "t.csv");
  const std::vector<std::vector<int>> combinations = {{0}, {1}, {2}, {0, 1}, {0, 2}, {1, 2}, {0, 1, 2}};
  for (const std::vector<int>& closed : combinations) {
    const bool lost = std::ranges::find(closed, 1) != closed.end();
    std::filesystem::remove(sample.folder() / "t.csv");
    const Outcome outcome = run_program(sample.folder(), kOdometry, Circumstances{.closed = closed});
    EXPECT_EQ(outcome.exit_code, lost ? 3 : 0) << testing::PrintToString(closed);
    EXPECT_EQ(read_file(sample.folder() / "t.csv"), whole) << testing::PrintToString(closed);
  }
}

#ifndef __SANITIZE_ADDRESS__  // which takes terabytes of addresses
TEST(Memory, ThatDoesNotSufficeIsNamedAndLeavesNothing) {
  const Sample sample;
  std::string wheels = "time_s,left_ticks,right_ticks\n";
  for (int i = 0; i < 500'000; ++i) wheels += std::to_string(0.1 * i) + ",0,0\n";
  write_file(sample.folder() / "long/wheels.csv", wheels);
  const Outcome outcome =
      run_program(sample.folder(), {"odometry", "long", "--robot", "nominal.toml", "-o", "o/t.csv"},
                  Circumstances{.memory_bytes = 30'000'000});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, testing::HasSubstr("memory"));
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "o"));
}

/// At whatever allocation it ends; of JSON that is half built the destructors allocate.
TEST(Memory, ThatEndsAnywhereIsNoCrash) {
  const Sample sample;
  ASSERT_EQ(run_program(sample.folder(), {"run", "cw", "--robot", "nominal.toml", "-o", "o"}).exit_code, 0);
  std::size_t least = 10'000'000;  // to begin with
  while (run_program(sample.folder(), {"--version"}, Circumstances{.memory_bytes = least}).exit_code != 0)
    least += 500'000;
  int failed = 0;
  for (std::size_t bytes = least; bytes < least + 10'000'000; bytes += 100'000) {
    const Outcome outcome = run_program(sample.folder(), {"report", "o", "-o", "page.html"},
                                        Circumstances{.memory_bytes = bytes});
    ASSERT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 3) << bytes << outcome.err;
    failed += outcome.exit_code == 3 ? 1 : 0;
  }
  EXPECT_GT(failed, 0) << "memory sufficed always: the test tests nothing";
}
#endif

}  // namespace
}  // namespace trundle::test
