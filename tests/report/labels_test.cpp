#include "trundle/report/labels.hpp"

#include <gmock/gmock.h>

namespace trundle::report {
namespace {

using testing::ElementsAre;

TEST(Labels, AreWhatTellsPathsApart) {
  EXPECT_THAT(shortest_labels({"out/a", "out/b"}), ElementsAre("a", "b"));
  EXPECT_THAT(shortest_labels({"/results/a/tour", "/results/b/tour"}), ElementsAre("a", "b"));
  EXPECT_THAT(shortest_labels({"x/a/1/r", "x/b/1/r", "x/a/2/r"}), ElementsAre("a/1", "b/1", "a/2"));
  EXPECT_THAT(shortest_labels({"./out/a/", "out/b"}), ElementsAre("a", "b"));
}

TEST(Labels, KeepSomethingOfEveryPath) {
  EXPECT_THAT(shortest_labels({"out", "out/later"}), ElementsAre("out", "out/later"));
  EXPECT_THAT(shortest_labels({"out/a", "out/a"}), ElementsAre("a", "a"));
  EXPECT_THAT(shortest_labels({"", "b"}), ElementsAre("", "b"));
  EXPECT_THAT(shortest_labels({"only/one"}), ElementsAre("one"));
}

}  // namespace
}  // namespace trundle::report
