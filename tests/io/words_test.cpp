#include "trundle/io/words.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace trundle::io {
namespace {

TEST(Words, a_value_ends_where_its_sigma_does) {
  EXPECT_EQ(with_sigma(0.083822431, 5e-5), "0.083822 ± 0.000050");
  EXPECT_EQ(with_sigma(0.20193, 2.6e-4), "0.20193 ± 0.00026");
  EXPECT_EQ(with_sigma(-2.4e-5, 2.1e-5), "-0.000024 ± 0.000021");
  EXPECT_EQ(with_sigma(12345.6, 123.4), "12346 ± 123");
  EXPECT_EQ(with_sigma(0.0, 0.0012), "0.0000 ± 0.0012");
  EXPECT_EQ(with_sigma(0.0838, 0.0), "0.0838 ± 0");
  EXPECT_EQ(with_sigma(0.0838, std::numeric_limits<double>::infinity()), "0.0838 ± inf");
}

TEST(Words, nothing_is_below_zero_by_rounding_alone) {
  EXPECT_EQ(fixed(-0.00002, 4), "0.0000");
  EXPECT_EQ(fixed(-0.0, 0), "0");
  EXPECT_EQ(fixed(-0.0631, 4), "-0.0631");
  EXPECT_EQ(with_sigma(-0.00001, 0.001), "0.0000 ± 0.0010");
}

TEST(Words, what_commands_a_terminal_is_shown_instead) {
  EXPECT_EQ(one_line("a\x1b[2J\nb\x7f°"), "a\\x1B[2J\\x0Ab\\x7F°");
  EXPECT_EQ(printable("a\x1b[2J\nb\r"), "a\\x1B[2J\nb\\x0D");
}

TEST(Words, a_sigma_has_two_digits_and_no_exponent) {
  EXPECT_EQ(sigma_text(4.9e-5), "0.000049");
  EXPECT_EQ(sigma_text(0.01), "0.010");
  EXPECT_EQ(sigma_text(8.7), "8.7");
}

}  // namespace
}  // namespace trundle::io
