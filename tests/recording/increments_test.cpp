#include "trundle/recording/alignment/increments.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>

#include <gtest/gtest.h>

namespace trundle::recording {
namespace {

static_assert(std::random_access_iterator<Increments::Iterator>);

/// Of a robot with three wheels, of which the second never turns.
std::vector<Increment> drive() {
  std::vector<Increment> drive;
  for (int i = 0; i < 40; ++i) {
    const double time_s = 0.1 * (i + 1);
    Increment increment{.time_s = time_s, .duration_s = drive.empty() ? 0.1 : time_s - drive.back().time_s};
    increment.turned[0] = 0.01 * i;
    increment.turned[2] = i < 5 ? 0.0 : -0.0;
    if (i > 10) increment.gyro_rad = std::sin(i), increment.has_gyro = i % 7 != 0;
    if (i > 20) increment.gyro_change_rad_s = 1.0 / i;
    drive.push_back(increment);
  }
  return drive;
}

std::uint64_t bits(double value) {
  return std::bit_cast<std::uint64_t>(value);
}

void expect_same_bits(const Increment& a, const Increment& b) {
  EXPECT_EQ(bits(a.time_s), bits(b.time_s));
  EXPECT_EQ(bits(a.duration_s), bits(b.duration_s));
  for (std::size_t w = 0; w < kMaxWheels; ++w) {
    EXPECT_EQ(bits(a.turned[w]), bits(b.turned[w])) << w;
    EXPECT_EQ(bits(a.slip_variance[w]), bits(b.slip_variance[w])) << w;
    EXPECT_EQ(bits(a.steering_rad[w]), bits(b.steering_rad[w])) << w;
  }
  EXPECT_EQ(bits(a.gyro_rad), bits(b.gyro_rad));
  EXPECT_EQ(a.has_gyro, b.has_gyro);
  EXPECT_EQ(bits(a.gyro_change_rad_s), bits(b.gyro_change_rad_s));
  EXPECT_EQ(bits(a.shaking_m_s2), bits(b.shaking_m_s2));
}

void expect_same_bits(const Increments& kept, const std::vector<Increment>& expected) {
  ASSERT_EQ(kept.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    SCOPED_TRACE(i);
    expect_same_bits(kept[i], expected[i]);
    EXPECT_EQ(kept.time_s(i), expected[i].time_s);
  }
}

TEST(Increments, GiveTheBitsThatTheyTook) {
  expect_same_bits(Increments(drive()), drive());
}

TEST(Increments, KeepDurationsThatAreNotTheDifferenceOfStamps) {
  std::vector<Increment> expected = drive();
  expected[30].duration_s = std::nextafter(expected[30].duration_s, 1.0);
  expect_same_bits(Increments(expected), expected);
}

TEST(Increments, TakeAnotherValueInAnyPlace) {
  std::vector<Increment> expected = drive();
  Increments kept(expected);
  for (const std::size_t i : {3u, 39u, 0u}) {
    expected[i].slip_variance[3] = 1e-6;
    expected[i].turned[1] = -2.0;
    expected[i].shaking_m_s2 = 0.5;
    expected[i].has_gyro = !expected[i].has_gyro;
    kept.set(i, expected[i]);
  }
  expect_same_bits(kept, expected);
}

TEST(Increments, AreCut) {
  const std::vector<Increment> whole = drive();
  for (const auto& [first, end] : {std::pair{0, 40}, {0, 7}, {13, 30}, {20, 20}}) {
    Increments part(whole);
    part.cut(static_cast<std::size_t>(first), static_cast<std::size_t>(end));
    expect_same_bits(part, {whole.begin() + first, whole.begin() + end});
  }
}

TEST(Increments, AreGoneThroughAndSearched) {
  const std::vector<Increment> expected = drive();
  const Increments kept(expected);
  std::size_t i = 0;
  for (const Increment& increment : kept) expect_same_bits(increment, expected[i++]);
  EXPECT_EQ(i, expected.size());
  const auto found = std::ranges::upper_bound(kept, expected[17].time_s, {}, &Increment::time_s);
  EXPECT_EQ(found - kept.begin(), 18);
  i = 5;
  for (const Increment& increment : IncrementRange(kept, 5, 9)) expect_same_bits(increment, expected[i++]);
  EXPECT_EQ(i, 9u);
}

}  // namespace
}  // namespace trundle::recording
