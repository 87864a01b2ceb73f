#include "trundle/recording/csv/number.hpp"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "trundle/recording/csv/reader.hpp"

#include "scale.hpp"

namespace trundle::recording {
namespace {

/// What the reader makes of a cell.
double read_cell(const std::string& cell) {
  const std::string text = "x\n" + cell + "\n";
  const CsvColumn column{0};
  return CsvTable(text, "memory", {}).read({&column, 1}).numbers[0].at(0);
}

void expect_the_bits_of_strtod(const std::string& cell) {
  const double expected = std::strtod(cell.c_str(), nullptr);
  const double value = read_cell(cell);
  if (std::isfinite(expected)) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(value), std::bit_cast<std::uint64_t>(expected)) << cell;
  } else {
    EXPECT_TRUE(std::isnan(value)) << cell;
  }
}

TEST(Number, has_the_bits_of_strtod_where_rounding_is_hard) {
  for (const char* cell : {"0",
                           "-0",
                           "+1",
                           "-.5",
                           "5.",
                           "1e22",
                           "1e23",
                           "9007199254740993",
                           "9007199254740992.5",
                           "0.1",
                           "0.3",
                           "123456789012345678",
                           "1234567890123456789",
                           "12345678901234567890",
                           "99999999999999999999",
                           "2.2250738585072011e-308",
                           "5e-324",
                           "2.4703282292062327e-324",
                           "2.4703282292062328e-324",
                           "1.7976931348623157e308",
                           "1e309",
                           "-1e400",
                           "1e-400",
                           "8.5",
                           "0.000000000000000000000000000001",
                           "1.00000000000000011102230246251565404236316680908203125",
                           "7.2057594037927933e16",
                           "1E5",
                           "1e+5",
                           "00012.50",
                           "0000000000000000000000001",
                           "9007199254740993e-3",
                           "0.1234567890123456789012345"})
    expect_the_bits_of_strtod(cell);
}

/// Numbers of all the forms that logs hold.
std::string random_cell(std::mt19937_64& random) {
  const auto below = [&](std::uint64_t n) { return random() % n; };
  switch (below(6)) {
    case 0:
      return fmt::format("{}", std::bit_cast<double>(random()));  // any double, denormals too, shortest form
    case 1:
      return fmt::format("{:.{}e}", std::bit_cast<double>(random()), below(25));
    case 2:
      return fmt::format("{}{}.{:0{}}", below(2) == 0 ? "-" : "", below(100000), below(1000000),
                         6 + below(4));
    case 3:
      return fmt::format("{}{}", below(2) == 0 ? "-" : "", random() >> below(64));
    case 4:
      return fmt::format("{}.{}{}", random(), random(), random());
    default:
      return fmt::format("{}e{}", random() >> below(64), static_cast<int>(below(660)) - 340);
  }
}

TEST(Number, has_the_bits_of_strtod_for_a_million_random_numbers) {
  std::mt19937_64 random(20);
  const int count = test::trials(1'000'000);
  std::vector<std::string> cells;
  std::string text = "x\n";
  for (int i = 0; i < count; ++i) {
    std::string cell = random_cell(random);
    if (cell.find("nan") != std::string::npos || cell.find("inf") != std::string::npos) cell = "0.25";
    text += cell + "\n";
    cells.push_back(std::move(cell));
  }
  const CsvColumn column{0};
  const std::vector<double> values = CsvTable(text, "memory", {}).read({&column, 1}).numbers[0];
  ASSERT_EQ(values.size(), cells.size());
  int wrong = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double expected = std::strtod(cells[i].c_str(), nullptr);
    const bool same = std::isfinite(expected)
                          ? std::bit_cast<std::uint64_t>(values[i]) == std::bit_cast<std::uint64_t>(expected)
                          : std::isnan(values[i]);
    if (!same && ++wrong < 10) ADD_FAILURE() << cells[i] << " read as " << values[i];
  }
  EXPECT_EQ(wrong, 0);
}

TEST(Number, stamps_of_nanoseconds_keep_their_digits) {
  const std::string text = "t\n1494449906828639784\n1494449906848379493\n";
  const CsvColumn stamp{0, CellKind::time, {-9, 1494449906}};
  const std::vector<double> seconds = CsvTable(text, "memory", {}).read({&stamp, 1}).numbers[0];
  EXPECT_EQ(seconds[0], 0.828639784);
  EXPECT_EQ(seconds[1], 0.848379493);
}

TEST(Number, stamps_without_origin_are_the_nearest_double) {
  const std::string text = "t\n1494449906828639784\n-2500000000\n";
  const CsvColumn stamp{0, CellKind::time, {-9, 0}};
  const std::vector<double> seconds = CsvTable(text, "memory", {}).read({&stamp, 1}).numbers[0];
  EXPECT_EQ(seconds[0], 1494449906.828639784);
  EXPECT_EQ(seconds[1], -2.5);
}

TEST(Number, stamps_of_seconds_take_off_the_origin_before_rounding) {
  const std::string text = "t\n1248444187.156\n1.2484441881e9\n";
  const CsvColumn stamp{0, CellKind::time, {0, 1248444187}};
  const std::vector<double> seconds = CsvTable(text, "memory", {}).read({&stamp, 1}).numbers[0];
  EXPECT_EQ(seconds[0], 0.156);
  EXPECT_NEAR(seconds[1], 1.1, 1e-6);
}

}  // namespace
}  // namespace trundle::recording
