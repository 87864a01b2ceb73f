// How tyres grow with their speed: estimated where it is asked for, offered where it shows.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/offers.hpp"
#include "calibration/simulated_runs.hpp"
#include "calibration/stated_errors.hpp"
#include "held_limits.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

constexpr Parameter kTyreGrowth{ParameterKind::tyre_growth, -1};

Robot true_growing(double tyre_growth_s2_m2) {
  Robot robot = true_differential();
  set_value(kTyreGrowth, tyre_growth_s2_m2, robot);
  return robot;
}

/// Slow and fast, ahead and in curves.
std::vector<Path> at_all_speeds() {
  return {square(3.0, TurnSense::cw, {.forward_m_s = 0.3}), square(3.0, TurnSense::ccw, {.forward_m_s = 2.0}),
          circle(1.5, 2.0, TurnSense::cw, {.forward_m_s = 1.0}),
          circle(1.5, 2.0, TurnSense::ccw, {.forward_m_s = 2.0})};
}

std::vector<Recording> driven_fast(const Robot& truth, const std::vector<Path>& paths, std::uint64_t seed) {
  return recorded(nominal_differential(), truth, paths, seed, 20.0);
}

CalibrationResult calibrated_growth(double truth, std::uint64_t seed, const CalibrateOptions& options = {}) {
  return calibrate(driven_fast(true_growing(truth), at_all_speeds(), seed), {}, nominal_differential(),
                   options);
}

TEST(CalibratedTyreGrowth, IntervalsHoldTheTruth) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int times = trials(30, 3);
  const Robot truth = true_growing(0.005);
  int held = 0;
  double nees = 0.0, expected_nees = 0.0, bias = 0.0, variance = 0.0;
  for (int i = 0; i < times; ++i) {
    const CalibrationResult result =
        calibrated_growth(0.005, static_cast<std::uint64_t>(i), {.free = {"tyre_growth"}});
    const StatedErrors stated = stated_errors(result, truth);
    nees += stated.nees();
    expected_nees += stated.expected_nees();
    for (const ParameterEstimate& e : result.parameters) {
      if (e.parameter != kTyreGrowth) continue;
      const double error = e.value - 0.005;
      held += std::abs(error) < statistics::kNormalAt95 * e.sigma_within;
      bias += error, variance += e.sigma_within * e.sigma_within;
    }
  }
  RecordProperty("bias", fmt::format("{:.2e}", bias / times));
  RecordProperty("sigma", fmt::format("{:.2e}", std::sqrt(variance / times)));
  EXPECT_GE(held, held_limits(times).first * times);
  EXPECT_LT(nees, statistics::chi_squared_limit(0.00135, expected_nees));  // as rare as 3σ
  EXPECT_LT(std::abs(bias), 3.0 * std::sqrt(variance));
}

TEST(CalibratedTyreGrowth, OfATyreThatGrowsItIsOffered) {
  const auto times = static_cast<std::uint64_t>(trials(10, 1));
  for (std::uint64_t seed = 0; seed < times; ++seed) {
    const CalibrationResult result = calibrated_growth(0.005, seed);
    expect_offered(result, kTyreGrowth, 0.005, at_all_speeds().size());
    EXPECT_THAT(result.notes,
                Contains(AllOf(HasSubstr("tyre_growth 0.00"), HasSubstr("--free tyre_growth"))));
    EXPECT_EQ(result.calibrated.chassis.tyre_growth_s2_m2, 0.0);
  }
}

TEST(CalibratedTyreGrowth, OfOthersItIsOfferedNoMoreOftenThanItsLevelSays) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int times = trials(25, 2);
  int offered = 0;
  for (int i = 0; i < times; ++i)
    offered += !calibrated_growth(0.0, static_cast<std::uint64_t>(i)).offers.empty();
  RecordProperty("offered", offered);
  EXPECT_LE(offered, most_offered_by_chance(times));
}

TEST(CalibratedTyreGrowth, OfOneRunHalvesSayWhetherToOfferIt) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const std::vector<Path> paths = at_all_speeds();
  const Path tour = trundle::simulation::joined({paths[1], paths[0], paths[3], paths[2], paths[1], paths[0]});
  const auto of = [&](double growth) {
    return calibrate(driven_fast(true_growing(growth), {tour}, 5), {}, nominal_differential()).offers;
  };
  const auto offers = of(0.01);
  ASSERT_EQ(offers.size(), 1U);
  EXPECT_TRUE(offers.front().of_halves);
  EXPECT_TRUE(of(0.0).empty());
}

TEST(CalibratedTyreGrowth, IsNotOfferedWhereItIsFreeOrFixed) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  EXPECT_TRUE(calibrated_growth(0.005, 1, {.free = {"tyre_growth"}}).offers.empty());
  EXPECT_TRUE(calibrated_growth(0.005, 1, {.fix = {"tyre_growth"}}).offers.empty());
}

}  // namespace
}  // namespace trundle::calibration
