#include "trundle/slam/localization/localizer.hpp"

#include <gtest/gtest.h>

#include "scale.hpp"
#include "slam/field.hpp"

namespace trundle::slam {
namespace {

struct Case {
  LocalizerFilter filter;
  bool named;
};

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  return std::string(name_of(info.param.filter)) + (info.param.named ? "_named" : "_unidentified");
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

class EitherLocalizer : public testing::TestWithParam<LocalizerFilter> {};

// Turned half around, the map is the same: nothing that is ever seen without names can tell.
TEST_P(EitherLocalizer, ClaimsNoPoseOnASymmetricMap) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    test::Field field({.landmarks = 15, .symmetric = true, .seed = seed});
    Localizer localizer(field.map(), field.sensor(), {.filter = GetParam()});
    std::size_t in_question = 0;
    for (int k = 0; k < 1500; ++k) {
      const SlamStep step = field.step(false);
      in_question = localizer.step(step.motion, step.observations).hypotheses;
      ASSERT_FALSE(localizer.estimate()) << "seed " << seed << ", step " << k;
    }
    EXPECT_GE(in_question, 2U);
  }
}

TEST_P(EitherLocalizer, TellsByNamesWhatLooksAlike) {
  test::Field field({.landmarks = 15, .symmetric = true, .seed = 1});
  Localizer localizer(field.map(), field.sensor(), {.filter = GetParam()});
  for (int k = 0; k < 300; ++k) {
    const SlamStep step = field.step(true);
    localizer.step(step.motion, step.observations);
  }
  EXPECT_TRUE(test::is_right(localizer.estimate(), field.truth()));
}

// A robot that was told the wrong one of two places that look almost alike.
TEST_P(EitherLocalizer, GivesUpAPoseWhenAnotherExplainsMore) {
  int right = 0;
  const int seeds = test::trials(10, 3);
  for (int seed = 1; seed <= seeds; ++seed) {
    test::Field field(
        {.landmarks = 15, .symmetric = true, .without_twin = 8, .seed = static_cast<std::uint64_t>(seed)});
    PoseEstimate start;
    start.pose = field.opposite();
    Localizer localizer(field.map(), field.sensor(), {.filter = GetParam(), .start = start});
    for (int k = 0; k < 1500; ++k) {
      const SlamStep step = field.step(false);
      localizer.step(step.motion, step.observations);
    }
    right += test::is_right(localizer.estimate(), field.truth()) ? 1 : 0;
  }
  EXPECT_GE(right, seeds - 1);
}

/// Further steps at 10 Hz of a robot that wanders on and reads the names of what it sees.
void wander_on(int steps, test::Field& field, SlamInput& input) {
  for (int k = 0; k < steps; ++k) {
    input.steps.push_back(field.step(true));
    input.steps.back().time_s = 0.1 * static_cast<double>(input.steps.size());
  }
}

/// The same of one that sees nothing, and by its wheels stands.
void stand_blind(int steps, SlamInput& input) {
  const Matrix3 covariance = 1e-10 * Matrix3::Identity();
  for (int k = 0; k < steps; ++k)
    input.steps.push_back({0.1 * static_cast<double>(input.steps.size() + 1), motion_of({}, covariance), {}});
}

double last_look_s(const SlamInput& input) {
  double time_s = 0.0;
  for (const SlamStep& step : input.steps)
    if (!step.observations.empty()) time_s = step.time_s;
  return time_s;
}

// It is carried off while it sees nothing and its wheels stand: nobody knows when. What was claimed since the
// last sighting that fitted is withdrawn, though nothing spoke against it then.
TEST_P(EitherLocalizer, WithdrawsWhatItClaimedWhileItSawNothing) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    test::Field field({.outlier_share = 0.0, .seed = seed});
    LocalizerOptions known{.filter = GetParam(), .start = PoseEstimate{}};
    known.start->pose = field.truth();
    SlamInput input;
    wander_on(100, field, input);
    const double last_fit_s = last_look_s(input);
    stand_blind(200, input);
    const double sees_again_s = input.steps.back().time_s;
    field.carry_away();
    wander_on(300, field, input);
    const Localization found = localize(input, field.map(), field.sensor(), known);
    ASSERT_EQ(found.stretches.size(), 2U) << seed;
    const KnownStretch& first = found.stretches.front();
    EXPECT_EQ(first.start_s, input.steps.front().time_s);
    EXPECT_EQ(first.end_s, last_fit_s) << seed;
    ASSERT_TRUE(first.noticed_s);
    EXPECT_GT(*first.noticed_s, sees_again_s);
    EXPECT_TRUE(found.refuted_s.empty());
    for (const StampedPose& row : found.trajectory.poses)
      EXPECT_TRUE(row.time_s <= last_fit_s || row.time_s >= found.stretches.back().start_s) << row.time_s;
    EXPECT_EQ(found.trajectory.covariances.size(), found.trajectory.poses.size());
    EXPECT_TRUE(test::is_right(PoseEstimate{.pose = found.trajectory.poses.back().pose}, field.truth()));
  }
}

// A blind stretch after which all fits is kept.
TEST_P(EitherLocalizer, KeepsWhatItClaimedWhileItSawNothingWhereItIsConfirmed) {
  test::Field field({.outlier_share = 0.0, .seed = 4});
  LocalizerOptions known{.filter = GetParam(), .start = PoseEstimate{}};
  known.start->pose = field.truth();
  SlamInput input;
  wander_on(100, field, input);
  stand_blind(200, input);
  wander_on(100, field, input);
  const Localization found = localize(input, field.map(), field.sensor(), known);
  ASSERT_EQ(found.stretches.size(), 1U);
  EXPECT_FALSE(found.stretches.front().noticed_s);
  EXPECT_EQ(found.trajectory.poses.size(), input.steps.size());
}

// Told a wrong start it drives 20 s before it sees anything: of what nothing ever confirmed no row is left,
// and no stretch either.
TEST_P(EitherLocalizer, KeepsNothingOfAStartThatWasNeverConfirmed) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    test::Field field({.outlier_share = 0.0, .seed = seed});
    LocalizerOptions wrong{.filter = GetParam(), .start = PoseEstimate{}};
    wrong.start->pose = field.opposite();
    SlamInput input;
    wander_on(200, field, input);
    for (SlamStep& step : input.steps) step.observations.clear();
    const double sees_s = input.steps.back().time_s;
    wander_on(300, field, input);
    const Localization found = localize(input, field.map(), field.sensor(), wrong);
    ASSERT_EQ(found.refuted_s.size(), 1U) << seed;
    EXPECT_GT(found.refuted_s.front(), sees_s);
    ASSERT_EQ(found.stretches.size(), 1U) << seed;
    const KnownStretch& right = found.stretches.front();
    EXPECT_GE(right.start_s, found.refuted_s.front());
    EXPECT_LT(right.start_s, right.end_s);
    EXPECT_FALSE(right.noticed_s);
    EXPECT_EQ(found.trajectory.poses.front().time_s, right.start_s);
    EXPECT_EQ(found.trajectory.covariances.size(), found.trajectory.poses.size());
    EXPECT_TRUE(test::is_right(PoseEstimate{.pose = found.trajectory.poses.back().pose}, field.truth()));
  }
}

TEST_P(EitherLocalizer, HasNoMeanNisWhereNothingWasMatched) {
  test::Field field({.outlier_share = 0.0, .seed = 5});
  LocalizerOptions known{.filter = GetParam(), .start = PoseEstimate{}};
  known.start->pose = field.truth();
  SlamInput input;
  wander_on(100, field, input);
  const LocalizationCounts counts = localize(input, field.map(), field.sensor(), known).counts;
  EXPECT_GT(counts.matched, 0U);
  EXPECT_GT(counts.mean_nis, 0.0);
  EXPECT_GT(counts.median_nis, 0.0);
  for (SlamStep& step : input.steps) step.observations.clear();
  const LocalizationCounts blind = localize(input, field.map(), field.sensor(), known).counts;
  EXPECT_FALSE(blind.mean_nis);
  EXPECT_FALSE(blind.median_nis);
}

INSTANTIATE_TEST_SUITE_P(, EitherLocalizer, testing::Values(LocalizerFilter::ekf, LocalizerFilter::particles),
                         [](const auto& test) { return std::string(name_of(test.param)); });

/// What a robot at the origin that looks along x reads of a point.
Observation sighting_of(const LandmarkSensor& sensor, const Vector2& point) {
  const ExpectedReading reading = expected_reading({}, sensor.body_from_sensor, point);
  return {kUnknownLandmark, reading.range_m, reading.bearing_rad};
}

// Three posts 4 m, 3.4 m and 5 m apart, seen by a robot that stands: are the two that it sees 3.8 m apart the
// first pair, turned one way or the other, or the second? The thousandth look has the error of the first.
TEST(Localizer, StandingAndLookingAgainDoesNotTellWhichLandmarkItIs) {
  const LandmarkSensor sensor{{}, 0.1, radians(1.0), 8.0, 0.0};
  const KnownMap map({{{0.0, 0.0}}, {{4.0, 0.0}}, {{4.0, 3.4}}}, 16.0);
  const std::vector<Observation> seen = {sighting_of(sensor, {3.0, -1.9}), sighting_of(sensor, {3.0, 1.9})};
  Localizer localizer(map, sensor, {});
  const std::size_t at_first = localizer.step({}, seen).hypotheses;
  EXPECT_GE(at_first, 2U);
  for (int k = 0; k < 1000; ++k) {
    EXPECT_EQ(localizer.step({}, seen).hypotheses, at_first);
    ASSERT_FALSE(localizer.estimate()) << k;
  }
}

// Two posts ahead are two posts from the other side as well, turned round. That the sensor could see more
// from there, if it looked behind it, is no evidence, however often the two are seen.
TEST(Localizer, HowManyLandmarksAreAboutDoesNotTellWhichWayItLooks) {
  const LandmarkSensor sensor{{}, 0.03, radians(1.0), 10.0, 0.0};
  const KnownMap map({{{6.0, 1.5}}, {{6.0, -1.5}}, {{-4.0, 0.0}}, {{-3.0, 2.5}}, {{-2.5, -3.2}}}, 20.0);
  Localizer localizer(map, sensor, {});
  const Twist2 ahead{0.25, 0.0, 0.0};
  for (double x = 0.25; x < 4.6; x += 0.25) {
    const std::vector<Observation> seen = {sighting_of(sensor, {6.0 - x, 1.5}),
                                           sighting_of(sensor, {6.0 - x, -1.5})};
    EXPECT_GE(localizer.step(motion_of(ahead, 1e-6 * Matrix3::Identity()), seen).hypotheses, 2U);
    ASSERT_FALSE(localizer.estimate()) << x;
  }
}

TEST(LocalMap, ALookFromTheSamePlaceIsNoNewsAndMakesNoPointSurer) {
  const LandmarkSensor sensor{{}, 0.1, radians(1.0), 8.0, 0.0};
  LocalMap seen(sensor);
  const std::vector<Observation> one = {sighting_of(sensor, {5.0, 1.0})};
  seen.step({}, one);
  EXPECT_EQ(seen.novelty()[0], 1.0);
  const Matrix2 of_one_look = seen.points()[0].covariance;
  for (int k = 0; k < 1000; ++k) seen.step({}, one);
  EXPECT_EQ(seen.novelty()[0], 0.0);
  ASSERT_EQ(seen.points().size(), 1U);
  EXPECT_NEAR((seen.points()[0].covariance - of_one_look).norm(), 0.0, 1e-9);
  // A tenth of the distance further two independent errors are averaged.
  const Twist2 aside{0.0, 0.6, 0.0};
  seen.step(motion_of(aside, Matrix3::Zero()), std::vector<Observation>{sighting_of(sensor, {5.0, 0.4})});
  EXPECT_EQ(seen.novelty()[0], 1.0);
  EXPECT_LT(seen.points()[0].covariance.trace(), 0.6 * of_one_look.trace());
}

// Turned for 10 s by a gyro whose bias is not known, a point is carried 0.5 m aside; at rest the bias is
// read.
TEST(LocalMap, WhatIsReadOfTheBiasPutsPointsBackThatItCarriedAside) {
  const LandmarkSensor sensor{{}, 0.1, radians(1.0), 8.0, 0.0};
  const double bias = 0.01, sigma = 0.015;
  const Systematic unknown = Systematic::Zero(1);
  const SystematicCovariance variance = SystematicCovariance::Constant(1, 1, sigma * sigma);
  LocalMap seen(sensor), exact(sensor);
  for (LocalMap* map : {&seen, &exact})
    map->step({}, std::vector<Observation>{sighting_of(sensor, {5.0, 1.0})}, variance);
  Motion still;
  still.by_systematic.setZero(3, 1);
  still.by_systematic(2, 0) = -1.0;  // in a second; the reading less the bias is the rate
  for (int k = 0; k < 10; ++k) {
    seen.step(still, {}, variance);
    exact.step(about(Systematic::Constant(1, bias), still), {}, SystematicCovariance::Zero(1, 1));
  }
  EXPECT_GT((seen.points()[0].in_body - exact.points()[0].in_body).norm(), 0.4);
  EXPECT_GT(seen.points()[0].covariance.trace(), 0.5);
  seen.read_bias({bias, 1e-12}, unknown, variance);
  EXPECT_LT((seen.points()[0].in_body - exact.points()[0].in_body).norm(), 0.03);  // of first order
  EXPECT_NEAR(seen.points()[0].covariance.trace(), exact.points()[0].covariance.trace(), 1e-3);
  // What is not known any more cannot be taken away from what was known by it.
  for (int k = 0; k < 20; ++k) {
    still.by_systematic(2, 0) = 1.0;  // turned the other way round
    seen.step(still, {}, SystematicCovariance::Constant(1, 1, 1e-12));
    EXPECT_GT(seen.points()[0].covariance.determinant(), 0.0);
  }
}

// Neighbours that the sensor hardly tells apart are wrong together.
TEST(LocalMap, NeighboursAreOneSupportingLandmark) {
  const LandmarkSensor sensor{{}, 0.5, radians(2.5), 8.0, 0.0};
  LocalMap seen(sensor);
  seen.step({}, std::vector<Observation>{sighting_of(sensor, {5.0, 1.0}), sighting_of(sensor, {5.2, 1.1}),
                                         sighting_of(sensor, {1.0, 4.0})});
  EXPECT_EQ(seen.novelty()[0], 1.0);
  EXPECT_EQ(seen.novelty()[1], 0.0);
  EXPECT_EQ(seen.novelty()[2], 1.0);
}

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
}  // namespace trundle::slam
