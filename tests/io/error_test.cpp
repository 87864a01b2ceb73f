#include "trundle/io/error.hpp"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include <gtest/gtest.h>

namespace trundle::io {
namespace {

TEST(InputError, says_place_fact_and_expectation_in_one_line) {
  const InputError error(place("robot.toml", 7), "diameter_m is -1", "metres above 0");
  EXPECT_STREQ(error.what(), "robot.toml:7: diameter_m is -1; expected metres above 0");
}

TEST(InputError, stays_one_line_whatever_it_quotes) {
  const InputError error("a\nb", "name is \"x\r\t\x7f\u00e9\"", "letters");
  EXPECT_STREQ(error.what(), "a\\x0Ab: name is \"x\\x0D\\x09\\x7F\u00e9\"; expected letters");
}

TEST(ExitCode, tells_the_three_kinds_of_error_apart) {
  EXPECT_EQ(exit_code_of(InputError("robot.toml", "is empty", "a robot")), kBadInput);
  EXPECT_EQ(exit_code_of(CannotAnswer("nothing moved")), kCannotAnswer);
  EXPECT_EQ(exit_code_of(std::filesystem::filesystem_error("of a folder",
                                                           std::error_code(ELOOP, std::generic_category()))),
            kBadInput);
  EXPECT_EQ(exit_code_of(std::runtime_error("of another library")), kBug);
}

const std::vector<std::string> kNames{"diameter_m", "direction_deg", "x_m", "y_m", "kind"};

TEST(NearestName, finds_what_was_meant) {
  EXPECT_EQ(nearest_name("diametre_m", kNames), "diameter_m");
  EXPECT_EQ(nearest_name("diameter", kNames), "diameter_m");
  EXPECT_EQ(nearest_name("directoin_deg", kNames), "direction_deg");
  EXPECT_EQ(nearest_name("kind", kNames), "kind");
}

TEST(NearestName, finds_what_was_shortened_or_lengthened) {
  const std::vector<std::string> names{"time_offset_s", "wheel_per_sqrt_m", "gyro"};
  EXPECT_EQ(nearest_name("offset_s", names), "time_offset_s");
  EXPECT_EQ(nearest_name("wheel_per_m", names), "wheel_per_sqrt_m");
  EXPECT_EQ(nearest_name("gyroscope", names), "gyro");
}

TEST(NearestName, prefers_the_first_of_two_alike) {
  EXPECT_EQ(nearest_name("z_m", kNames), "x_m");
}

TEST(NearestName, is_empty_where_nothing_is_near) {
  EXPECT_EQ(nearest_name("colour", kNames), "");
  EXPECT_EQ(nearest_name("diameter_m", {}), "");
  EXPECT_EQ(nearest_name(std::string(100000, 'x'), kNames), "");
}

}  // namespace
}  // namespace trundle::io
