#include "trundle/calibration/squares/sheet.hpp"

#include <cmath>
#include <string>

#include <gmock/gmock.h>

#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

using testing::HasSubstr;

TEST(Sheet, ReadsRunsAsWritten) {
  const SquareSheet sheet = parse_sheet(
      "# square in the hall\n"
      "# side_m = 2\n"
      "turn,x_m,y_m,heading_deg\n"
      "cw, 0.1 ,-0.2,170\r\n"
      "\n"
      "# the second was windy\n"
      "ccw,+0.3,4e-1,-540\n",
      "s.csv");
  EXPECT_EQ(sheet.name, "s.csv");
  EXPECT_EQ(sheet.side_m, 2.0);
  ASSERT_EQ(sheet.runs.size(), 2u);
  EXPECT_EQ(sheet.runs[0].turn, Turn::cw);
  EXPECT_EQ(sheet.runs[0].name, "s.csv:4");
  EXPECT_EQ(sheet.runs[0].error.y, -0.2);
  EXPECT_EQ(sheet.runs[0].error.heading, radians(170.0));
  EXPECT_FALSE(sheet.runs[0].leg_m.has_value());
  EXPECT_EQ(sheet.runs[1].turn, Turn::ccw);
  EXPECT_EQ(sheet.runs[1].error.x, 0.3);
  EXPECT_EQ(sheet.runs[1].error.heading, radians(-540.0));
}

TEST(Sheet, ColumnsInAnyOrderOthersIgnoredOptionalOnesMayBeEmpty) {
  const SquareSheet sheet = parse_sheet(
      "\xEF\xBB\xBFrun,heading_deg,leg_m,y_m,x_m,turn,right_revolutions,left_revolutions\n"
      "1,1,2.01,2,3,cw,4.2,4.1\n"
      "2,1,,2,3,ccw,,\n",
      "s.csv", 2.0);
  EXPECT_EQ(sheet.runs[0].error.x, 3.0);
  EXPECT_EQ(sheet.runs[0].leg_m, 2.01);
  EXPECT_EQ(sheet.runs[0].left_revolutions, 4.1);
  EXPECT_EQ(sheet.runs[0].right_revolutions, 4.2);
  EXPECT_FALSE(sheet.runs[1].leg_m.has_value());
  EXPECT_FALSE(sheet.runs[1].left_revolutions.has_value());
}

TEST(Sheet, TheSideMayBeGivenTwiceIfItIsTheSame) {
  EXPECT_EQ(parse_sheet("# side_m = 2.0\n# side_m=2\nturn,x_m,y_m,heading_deg\ncw,0,0,0\n", "s", 2.0).side_m,
            2.0);
}

struct BadSheet {
  const char* name;
  const char* text;
  std::optional<double> side_m;
  const char* where;
  const char* fact;
};

#define HEADER "turn,x_m,y_m,heading_deg\n"
#define LEGS "turn,x_m,y_m,heading_deg,leg_m\n"
#define REVOLUTIONS "turn,x_m,y_m,heading_deg,left_revolutions,right_revolutions\n"

const BadSheet kBadSheets[] = {
    {"empty", "", 2.0, "s.csv:", "no header"},
    {"only_comments", "# side_m = 2\n# nothing\n", {}, "s.csv:", "no header"},
    {"no_runs", "# side_m = 2\n" HEADER, {}, "s.csv:", "no runs"},
    {"no_header", "cw,0,0,0\n", 2.0, "s.csv:1:", "no column turn"},
    {"missing_x", "turn,y_m,heading_deg\ncw,0,0\n", 2.0, "s.csv:1:", "no column x_m"},
    {"missing_heading", "turn,x_m,y_m\ncw,0,0\n", 2.0, "s.csv:1:", "no column heading_deg"},
    {"semicolons", "turn;x_m;y_m;heading_deg\ncw;0;0;0\n", 2.0,
     "s.csv:1:", "separates its columns otherwise"},
    {"misspelt_column", "turn,x_m,y_m,headng_deg\ncw,0,0,0\n", 2.0,
     "s.csv:1:", "unknown column 'headng_deg'"},
    {"misspelt_leg", "turn,x_m,y_m,heading_deg,legm\ncw,0,0,0,2\n", 2.0, "s.csv:1:", "unknown column 'legm'"},
    {"column_twice", "turn,x_m,x_m,y_m,heading_deg\ncw,0,0,0,0\n", 2.0, "s.csv:1:", "two columns x_m"},
    {"header_twice", HEADER "cw,0,0,0\n" HEADER, 2.0, "s.csv:3:", "header of line 1 again"},
    {"one_column_of_revolutions", "turn,x_m,y_m,heading_deg,left_revolutions\ncw,0,0,0,4\n", 2.0,
     "s.csv:1:", "only one column of revolutions"},
    {"bad_turn", HEADER "left,0,0,0\n", 2.0, "s.csv:2:", "turn is 'left'"},
    {"turn_in_capitals", HEADER "CW,0,0,0\n", 2.0, "s.csv:2:", "turn is 'CW'"},
    {"empty_turn", HEADER ",0,0,0\n", 2.0, "s.csv:2:", "turn is ''"},
    {"not_a_number", HEADER "cw,0,abc,0\n", 2.0, "s.csv:2:", "y_m is 'abc'"},
    {"number_with_unit", HEADER "cw,0.1m,0,0\n", 2.0, "s.csv:2:", "x_m is '0.1m'"},
    {"empty_number", HEADER "cw,0,,0\n", 2.0, "s.csv:2:", "y_m is ''"},
    {"nan", HEADER "cw,nan,0,0\n", 2.0, "s.csv:2:", "x_m is 'nan'"},
    {"infinite", HEADER "cw,0,0,inf\n", 2.0, "s.csv:2:", "heading_deg is 'inf'"},
    {"overflow", HEADER "cw,1e999,0,0\n", 2.0, "s.csv:2:", "x_m is '1e999'"},
    {"too_few_fields", HEADER "cw,0,0\n", 2.0, "s.csv:2:", "3 fields"},
    {"decimal_commas", HEADER "cw,0,1,0,2,0,3\n", 2.0, "s.csv:2:", "7 fields"},
    {"second_row_ragged", HEADER "cw,0,0,0\nccw,0,0,0,0\n", 2.0, "s.csv:3:", "5 fields"},
    {"heading_in_other_unit", HEADER "cw,0,0,541\n", 2.0, "s.csv:2:", "heading_deg is 541"},
    {"error_in_millimetres", HEADER "cw,120,-85,3\n", 2.0, "s.csv:2:", "147.054 m from the start"},
    {"leg_not_positive", LEGS "cw,0,0,0,0\n", 2.0, "s.csv:2:", "leg_m is 0"},
    {"leg_negative", LEGS "cw,0,0,0,-2\n", 2.0, "s.csv:2:", "leg_m is -2"},
    {"leg_in_millimetres", LEGS "cw,0,0,0,2003\n", 2.0, "s.csv:2:", "leg_m is 2003"},
    {"leg_not_a_number", LEGS "cw,0,0,0,two\n", 2.0, "s.csv:2:", "leg_m is 'two'"},
    {"revolutions_of_one_wheel", REVOLUTIONS "cw,0,0,0,4.2,\n", 2.0, "s.csv:2:", "revolutions of one wheel"},
    {"revolutions_negative", REVOLUTIONS "cw,0,0,0,4.2,-4.2\n", 2.0, "s.csv:2:", "right_revolutions is -4.2"},
    {"no_side", HEADER "cw,0,0,0\n", {}, "s.csv:", "side of the square is not given"},
    {"side_zero", "# side_m = 0\n" HEADER "cw,0,0,0\n", {}, "s.csv:1:", "side_m is '0'"},
    {"side_negative", "# side_m = -2\n" HEADER "cw,0,0,0\n", {}, "s.csv:1:", "side_m is '-2'"},
    {"side_not_a_number", "# side_m = two\n" HEADER "cw,0,0,0\n", {}, "s.csv:1:", "side_m is 'two'"},
    {"side_nan", "# side_m = nan\n" HEADER "cw,0,0,0\n", {}, "s.csv:1:", "side_m is 'nan'"},
    {"side_twice",
     "# side_m = 2\n" HEADER "# side_m = 3\ncw,0,0,0\n",
     {},
     "s.csv:3:",
     "3 here and 2 in line 1"},
    {"side_conflict", "# side_m = 2\n" HEADER "cw,0,0,0\n", 3.0, "s.csv:1:", "side_m is 2 but --side-m 3"},
    {"side_option_zero", HEADER "cw,0,0,0\n", 0.0, "--side-m:", "the side is 0"},
    {"side_option_nan", HEADER "cw,0,0,0\n", std::nan(""), "--side-m:", "the side is nan"},
    {"binary",
     "\x7f"
     "ELF\x02\x01",
     2.0, "s.csv:1:", "no column turn"},
};

class BadSheets : public testing::TestWithParam<BadSheet> {};

TEST_P(BadSheets, AreRefusedWithPlaceFactAndExpectation) {
  const BadSheet& bad = GetParam();
  try {
    parse_sheet(bad.text, "s.csv", bad.side_m);
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith(bad.where));
    EXPECT_THAT(error.what(), HasSubstr(bad.fact));
    EXPECT_THAT(error.what(), HasSubstr("; expected "));
  }
}

INSTANTIATE_TEST_SUITE_P(Table, BadSheets, testing::ValuesIn(kBadSheets),
                         [](const auto& bad) { return std::string(bad.param.name); });

TEST(Sheet, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(read_sheet("/nowhere/sheet.csv", 2.0), InputError);
}

}  // namespace
}  // namespace trundle::calibration
