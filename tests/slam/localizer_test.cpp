#include "trundle/slam/localization/localizer.hpp"

#include <gtest/gtest.h>

#include "scale.hpp"
#include "slam/field.hpp"

namespace trundle {
namespace {

struct Case {
  LocalizerFilter filter;
  bool named;
};

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  return std::string(name_of(info.param.filter)) + (info.param.named ? "_named" : "_nameless");
}

class FromNowhere : public testing::TestWithParam<Case> {
 protected:
  std::size_t enough() const { return GetParam().named ? 10 : 30; }

  /// Whether the pose is right once so many landmarks were seen, and for 20 s after.
  bool finds_and_keeps(test::Field& field, Localizer& localizer) const {
    std::size_t seen = 0;
    while (seen < enough()) seen += take_step(field, localizer);
    bool right = test::is_right(localizer.estimate(), field.truth());
    for (int k = 0; k < 200 && right; ++k) {
      take_step(field, localizer);
      right = test::is_right(localizer.estimate(), field.truth());
    }
    return right;
  }
  std::size_t take_step(test::Field& field, Localizer& localizer) const {
    const SlamStep step = field.step(GetParam().named);
    localizer.step(step.motion, step.observations);
    return step.observations.size();
  }
  Localizer lost_in(const test::Field& field) const {
    return {field.map(), field.sensor(), {.filter = GetParam().filter}};
  }
};

// Wanted in 95 % of 200 worlds. Of fewer, a rate of 95 % is below `wanted - 3 sigma` once in a thousand
// times.
double least_share(int trials) {
  return 0.95 - (trials == 200 ? 0.0 : 3.0 * std::sqrt(0.95 * 0.05 / trials));
}

TEST_P(FromNowhere, FindsThePoseAndKeepsIt) {
  const int seeds = test::trials(200);
  int right = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    test::Field field({.seed = static_cast<std::uint64_t>(seed)});
    Localizer localizer = lost_in(field);
    right += finds_and_keeps(field, localizer) ? 1 : 0;
  }
  RecordProperty("right", right);
  EXPECT_GE(right, least_share(seeds) * seeds);
}

TEST_P(FromNowhere, NoticesThatItWasCarriedAwayAndFindsItselfAgain) {
  const int seeds = test::trials(200);
  int noticed = 0;
  int right = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    test::Field field({.seed = static_cast<std::uint64_t>(seed)});
    Localizer localizer = lost_in(field);
    for (int k = 0; k < 300; ++k) take_step(field, localizer);
    field.carry_away();
    int steps = 0;
    while (test::is_right(localizer.estimate(), field.truth())) take_step(field, localizer);
    for (; localizer.estimate() && steps < 100; ++steps) take_step(field, localizer);
    noticed += steps < 100 ? 1 : 0;
    right += finds_and_keeps(field, localizer) ? 1 : 0;
  }
  RecordProperty("noticed", noticed);
  RecordProperty("right", right);
  EXPECT_GE(noticed, least_share(seeds) * seeds);
  EXPECT_GE(right, least_share(seeds) * seeds);
}

INSTANTIATE_TEST_SUITE_P(, FromNowhere,
                         testing::Values(Case{LocalizerFilter::ekf, true}, Case{LocalizerFilter::ekf, false},
                                         Case{LocalizerFilter::particles, true},
                                         Case{LocalizerFilter::particles, false}),
                         name_of_case);

// Ten hours: bench/localization_bench.cpp.
TEST(Localizer, RaisesNoFalseAlarmInAnHour) {
  for (const bool named : {true, false}) {
    test::Field field({.outlier_share = 0.05, .seed = 3});
    PoseEstimate start;
    start.pose = field.truth();
    Localizer localizer(field.map(), field.sensor(), {.start = start});
    const int steps = test::trials(36'000, 6'000);
    int alarms = 0;
    for (int k = 0; k < steps; ++k) {
      const SlamStep step = field.step(named);
      alarms += localizer.step(step.motion, step.observations).phase == LocalizerPhase::lost ? 1 : 0;
    }
    EXPECT_EQ(alarms, 0) << named;
    EXPECT_TRUE(test::is_right(localizer.estimate(), field.truth()));
  }
}

}  // namespace
}  // namespace trundle
