#include "trundle/recording/detail/turn_integral.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::recording {
namespace {

/// Steps of any length at any rate, one of them lost.
struct Turner {
  std::vector<double> time_s, rate_rad_s;
  static constexpr std::size_t kLost = 40;

  explicit Turner(std::uint64_t seed) {
    Random random(seed, 1);
    double now_s = 10.0;
    for (int i = 0; i < 80; ++i) {
      time_s.push_back(now_s += 0.01 * (0.5 + random.uniform()));
      rate_rad_s.push_back(random.uniform() - 0.5);
    }
  }

  TurnIntegral integral() const {
    Turns turns{.turn_rad = {NAN}, .lost = {kLost}};
    for (std::size_t i = 1; i < time_s.size(); ++i)
      turns.turn_rad.push_back(rate_rad_s[i] * (time_s[i] - time_s[i - 1]));
    return {Stamps::of(time_s), std::move(turns)};
  }

  double angle_at(double at_s) const {
    double angle = 0.0;
    for (std::size_t i = 1; i < time_s.size(); ++i)
      if (i != kLost)
        angle += rate_rad_s[i] * std::clamp(at_s - time_s[i - 1], 0.0, time_s[i] - time_s[i - 1]);
    return angle;
  }
};

/// In steps of any length, forth and back, wherever it is looked for.
TEST(TurnIntegral, IsTheAreaUnderTheAngle) {
  const Turner turner(6);
  const TurnIntegral integral = turner.integral();
  Random random(7, 1);
  std::size_t near = 0;
  for (int i = 0; i < 100; ++i) {
    const double at_s = i % 10 == 0 ? turner.time_s[static_cast<std::size_t>(i) % turner.time_s.size()]
                                    : random.uniform(integral.first_s(), integral.last_s());
    if (i % 3 == 0) near = static_cast<std::size_t>(random.uniform(0.0, 80.0));
    const TurnIntegral::Reading reading = integral.at(at_s, near);
    ASSERT_TRUE(reading.known);
    double area = 0.0;
    constexpr int kPieces = 4000;
    const double piece_s = (at_s - integral.first_s()) / kPieces;
    for (int p = 0; p < kPieces; ++p)
      area += piece_s * turner.angle_at(integral.first_s() + (p + 0.5) * piece_s);
    EXPECT_NEAR(reading.area, area, 1e-8);
    EXPECT_EQ(reading.lost_before, at_s < turner.time_s[Turner::kLost] ? 0 : 1);
    EXPECT_EQ(reading.lost_after, at_s <= turner.time_s[Turner::kLost - 1] ? 0 : 1);
  }
  EXPECT_FALSE(integral.at(integral.first_s() - 1e-3, near).known);
  EXPECT_FALSE(integral.at(integral.last_s() + 1e-3, near).known);
}

/// Whether a stream's stamps, moved, stand for those that are added or not.
TEST(TurnIntegral, StampsAreThoseThatWereAdded) {
  const std::vector<double> stream_s = {0.1, 0.2, 0.3, 0.4};
  for (const std::vector<double>& added_s :
       {std::vector<double>{0.6, 0.7, 0.8, 0.9},  // rows 0 to 3
        std::vector<double>{0.6, 0.8, 0.9},       // row 1 is missing
        std::vector<double>{0.6, 0.7, 0.8, 0.9, 1.0}, std::vector<double>{5.0}}) {
    Stamps stamps(stream_s, 0.5);
    for (const double time_s : added_s) stamps.push_back(time_s);
    ASSERT_EQ(stamps.size(), added_s.size());
    for (std::size_t i = 0; i < added_s.size(); ++i) EXPECT_EQ(stamps[i], added_s[i]);
  }
}

}  // namespace
}  // namespace trundle::recording
