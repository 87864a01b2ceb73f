#include <thread>

#include <gtest/gtest.h>

#include "trundle/io/interruption.hpp"

namespace trundle::io {
namespace {

struct Stop {};

TEST(InterruptionCheck, IsAskedWhileItLives) {
  int asked = 0;
  check_interruption();
  {
    const InterruptionCheck check([&] { ++asked; });
    check_interruption();
    check_interruption();
  }
  check_interruption();
  EXPECT_EQ(asked, 2);
}

TEST(InterruptionCheck, EndsWhatAsks) {
  const InterruptionCheck check([] { throw Stop{}; });
  EXPECT_THROW(check_interruption(), Stop);
}

TEST(InterruptionCheck, TheInnerOneIsAskedAndThenTheOuterAgain) {
  int outer = 0, inner = 0;
  const InterruptionCheck around([&] { ++outer; });
  {
    const InterruptionCheck within([&] { ++inner; });
    check_interruption();
  }
  check_interruption();
  EXPECT_EQ(inner, 1);
  EXPECT_EQ(outer, 1);
}

TEST(InterruptionCheck, OtherThreadsAreLeftAlone) {
  const InterruptionCheck check([] { throw Stop{}; });
  std::thread([] { check_interruption(); }).join();
}

}  // namespace
}  // namespace trundle::io
