#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/trajectory_file.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::HasSubstr;

struct Malformed {
  const char* name;
  const char* file;  ///< that holds the fault
  std::string content;
  int line;  ///< 0: the message names the file alone
  const char* fact;
  const char* expectation;
};

std::ostream& operator<<(std::ostream& out, const Malformed& malformed) {
  return out << malformed.name;
}

std::string wheels(const std::string& lines) {
  return "[wheels]\nfile = \"log.csv\"\n" + lines;
}

std::string reference(const std::string& lines) {
  return "[reference]\n" + lines;
}

constexpr const char* kMap = "recording.toml";
constexpr const char* kWheels = "wheels.csv";
constexpr const char* kColumns = "columns = { time_s = \"t\", left_ticks = \"l\" }\n";
const std::string kNul(
    "time_s,left_ticks\n0,1\0"
    "2\n",
    23);

const Malformed kCases[] = {
    // Native files.
    {"empty_file", kWheels, "", 0, "is empty", "a header and rows"},
    {"comments_alone", kWheels, "# nothing\n\n", 0, "is empty", "a header and rows"},
    {"utf16", kWheels, "\xFF\xFEt\0", 0, "is UTF-16 text", "UTF-8"},
    {"no_stamps", kWheels, "left_ticks\n1\n", 1, "has no column 'time_s'", "'time_s'"},
    {"stamps_misspelt", "gyro.csv", "times_s,yaw_rate_rad_s\n0,1\n", 1, "has no column 'time_s'",
     "'time_s' in place of 'times_s'"},
    {"no_wheel", kWheels, "time_s,left\n0,1\n", 1, "has no column of a wheel", "<wheel>_ticks"},
    {"semicolons", kWheels, "time_s;left_ticks\n0;1\n", 1, "has no column", "delimiter = \";\""},
    {"column_twice", kWheels, "time_s,left_ticks,left_ticks\n0,1,2\n", 1,
     "names the column 'left_ticks' twice", "every column once"},
    {"word_in_a_number", kWheels, "# log\ntime_s,left_ticks\n0,1\n1,hello\n", 4,
     "column 'left_ticks' holds 'hello'", "a number"},
    {"count_beyond_64_bits", kWheels, "time_s,left_ticks\n0,1\n1,1e308\n", 3, "left_ticks is 1e+308",
     "between -2^64 and 2^64"},
    {"two_points", kWheels, "time_s,left_ticks\n0,1.2.3\n1,2\n", 2, "column 'left_ticks' holds '1.2.3'",
     "a number"},
    {"number_then_word", kWheels, "time_s,left_ticks\n0,12abc\n1,2\n", 2, "holds '12abc'", "a number"},
    {"hexadecimal", kWheels, "time_s,left_ticks\n0,0x10\n1,2\n", 2, "holds '0x10'", "a number"},
    {"two_signs", kWheels, "time_s,left_ticks\n0,+-1\n1,2\n", 2, "holds '+-1'", "a number"},
    {"nul_byte", kWheels, kNul, 2, "holds '1?2'", "a number"},
    {"word_in_a_stamp", kWheels, "time_s,left_ticks\nnoon,1\n1,2\n", 2, "column 'time_s' holds 'noon'",
     "a number"},
    {"too_few_cells", kWheels, "time_s,left_ticks,right_ticks\n0,1,2\n1,2\n2,3,4\n", 3, "has 2 cells",
     "3 cells as in the header"},
    {"too_many_cells", kWheels, "time_s,left_ticks\n0,1\n1,2,3\n", 3, "has more than 2 cells",
     "2 cells as in the header"},
    {"decimal_comma", kWheels, "time_s,left_ticks\n0,1\n0,5,2\n", 3, "has more than 2 cells", "2 cells"},
    {"word_in_the_last_line", kWheels, "time_s,left_ticks\n0,1\n1,word", 3, "holds 'word'", "a number"},
    {"gyro_without_rate", "gyro.csv", "time_s,rate\n0,1\n", 1, "has no column 'yaw_rate_rad_s'",
     "'yaw_rate_rad_s'"},
    {"commands_without_turn", "commands.csv", "time_s,forward_m_s\n0,1\n", 1,
     "has no column 'yaw_rate_rad_s'", "'yaw_rate_rad_s'"},
    {"reference_without_pose", "reference.csv", "time_s,z_m\n0,1\n", 1, "has none of the stream's columns",
     "x_m or y_m or heading_rad"},
    {"sightings_without_range", "sightings.csv", "time_s,landmark,bearing_rad\n0,a,1\n", 1,
     "has no column 'range_m'", "range_m"},
    {"landmark_without_place", "landmarks.csv", "landmark,x_m\na,1\n", 1, "has no column 'y_m'", "y_m"},
    {"header_alone", kWheels, "time_s,left_ticks\n", 0, "holds no samples", "at least one stream with rows"},
    // recording.toml.
    {"no_toml", kMap, "[wheels\n", 1, "", "TOML"},
    {"key_twice", kMap, "session = \"a\"\nsession = \"b\"\n", 2, "", "each key once"},
    {"unknown_table", kMap, "[wheel]\nfile = \"log.csv\"\n", 1, "unknown key 'wheel'", "'wheels'"},
    {"unknown_key", kMap, wheels("heder = true\n") + kColumns, 3, "[wheels]: unknown key 'heder'",
     "'header'"},
    {"session_a_number", kMap, "session = 3\n", 1, "session is not a text", "a text in quotes"},
    {"wheels_no_table", kMap, "wheels = \"log.csv\"\n", 1, "wheels is not a table", "a table [wheels]"},
    {"no_file", kMap, "[gyro]\nheader = true\n", 1, "[gyro]: has no key 'file'", "CSV file"},
    {"missing_file", kMap, "[gyro]\nfile = \"nowhere.csv\"\n", 2, "the file 'nowhere.csv' does not exist",
     "a file beside recording.toml"},
    {"file_a_folder", kMap, "[gyro]\nfile = \".\"\n", 2, "does not exist", "a file"},
    {"long_delimiter", kMap, wheels("delimiter = \"::\"\n") + kColumns, 3, "delimiter is '::'",
     "one character"},
    {"long_comment", kMap, wheels("comment = \"//\"\n") + kColumns, 3, "comment is '//'", "one character"},
    {"strange_decimal", kMap, wheels("decimal = \"*\"\n") + kColumns, 3, "decimal is '*'", "\",\""},
    {"decimal_is_delimiter", kMap, wheels("decimal = \",\"\n") + kColumns, 3,
     "decimal and delimiter are the same", "a delimiter like"},
    {"header_a_text", kMap, wheels("header = \"yes\"\n") + kColumns, 3, "header is neither true nor false",
     "true or false"},
    {"time_unit", kMap, wheels("time_unit = \"min\"\n") + kColumns, 3, "time_unit is 'min'", "\"ns\""},
    {"time_offset", kMap, wheels("time_offset_s = \"1\"\n") + kColumns, 3, "time_offset_s is not a number",
     "a finite number"},
    {"infinite_offset", kMap, wheels("time_offset_s = inf\n") + kColumns, 3, "time_offset_s is not a number",
     "a finite number"},
    {"time_origin", kMap, "time_origin = \"zero\"\n", 1, "time_origin is neither", "\"first\""},
    {"empty_cut", kMap, wheels("start_s = 3\nend_s = 2\n") + kColumns, 4, "the cut from 3 s to 2 s is empty",
     "end_s after start_s"},
    {"no_columns", kMap, wheels(""), 1, "[wheels]: has no columns", "columns."},
    {"no_time", kMap, wheels("columns = { left_ticks = \"l\" }\n"), 3, "neither columns.time_s nor rate_hz",
     "the rate of the rows"},
    {"time_and_rate", kMap, wheels("rate_hz = 10\n") + kColumns, 3, "gives rate_hz besides columns.time_s",
     "one of them"},
    {"zero_rate", kMap, wheels("rate_hz = 0\ncolumns = { left_ticks = \"l\" }\n"), 3, "rate_hz is 0",
     "a number above 0"},
    {"wheels_without_wheel", kMap, wheels("columns = { time_s = \"t\" }\n"), 3,
     "[wheels.columns]: names no column of a wheel", "<wheel>_ticks"},
    {"wheel_without_unit", kMap, wheels("columns = { time_s = \"t\", left = \"l\", right_m = \"l\" }\n"), 3,
     "unknown key 'left'", "right_m"},
    {"column_not_there", kMap, wheels("columns = { time_s = \"t\", left_ticks = \"left\" }\n"), 3,
     "has no column 'left'", "'left'"},
    {"column_misspelt", kMap, wheels("columns = { time_s = \"t\", left_ticks = \"count_lef\" }\n"), 3,
     "has no column 'count_lef'", "'count_left' in place of"},
    {"column_too_high", kMap, wheels("columns = { time_s = \"t\", left_ticks = 9 }\n"), 3,
     "column 9 is beyond the 3 columns", "from 1 to 3"},
    {"column_zero", kMap, wheels("columns = { time_s = \"t\", left_ticks = 0 }\n"), 3,
     "'left_ticks' is no column", "number from 1"},
    {"column_a_list", kMap, wheels("columns = { time_s = \"t\", left_ticks = [1] }\n"), 3,
     "'left_ticks' is no column", "number from 1"},
    {"name_without_header", kMap, wheels("header = false\ncolumns = { time_s = 1, left_ticks = \"l\" }\n"), 4,
     "of a file without header", "the column's number"},
    {"table_without_column", kMap, wheels("columns.time_s = \"t\"\ncolumns.left_ticks = { scale = 2 }\n"), 4,
     "has no key 'column'", "column ="},
    {"unknown_unit", kMap,
     wheels("columns.time_s = \"t\"\ncolumns.left_m = { column = \"l\", unit = \"yd\" }\n"), 4,
     "unit 'yd' does not fit left_m", "m, mm, cm"},
    {"unit_of_another_kind", kMap,
     wheels("columns.time_s = \"t\"\ncolumns.left_ticks = { column = \"l\", unit = \"m\" }\n"), 4,
     "unit 'm' does not fit left_ticks", "ticks"},
    {"scale_zero", kMap, wheels("columns.time_s = \"t\"\ncolumns.left_m = { column = \"l\", scale = 0 }\n"),
     4, "scale is 0", "other than 0"},
    {"sign_two", kMap, wheels("columns.time_s = \"t\"\ncolumns.left_m = { column = \"l\", sign = 2 }\n"), 4,
     "sign is 2", "1 or -1"},
    {"unknown_key_of_column", kMap,
     wheels("columns.time_s = \"t\"\ncolumns.left_m = { column = \"l\", units = \"m\" }\n"), 4,
     "unknown key 'units'", "'unit'"},
    {"rates_as_increments", kMap,
     wheels("increments = true\ncolumns = { time_s = \"t\", left_rad_s = \"l\" }\n"), 4,
     "left_rad_s is a rate", "counts, radians or metres"},
    {"increments_of_a_gyro", kMap,
     "[gyro]\nfile = \"log.csv\"\nincrements = true\ncolumns = { time_s = \"t\", yaw_rate_rad_s = \"l\" }\n",
     3, "unknown key 'increments'", "one of"},
    {"gyro_without_column", kMap, "[gyro]\nfile = \"log.csv\"\ncolumns = { time_s = \"t\" }\n", 3,
     "has no key 'yaw_rate_rad_s'", "yaw_rate_rad_s ="},
    {"one_column_for_two_kinds", kMap,
     "[sightings]\nfile = \"log.csv\"\ncolumns = { time_s = \"t\", landmark = \"l\", range_m = \"l\", "
     "bearing_rad = \"l\" }\n",
     1, "for two kinds of values", "a column each"},
    {"empty_reference", kMap, "[reference]\n", 1, "[reference]: has no key 'file'", "file"},
    {"closed_a_number", kMap, reference("closed = 1\n"), 2, "closed is neither true nor false",
     "true or false"},
    {"sigma_without_closed", kMap, reference("closed_sigma_m = 0.1\n"), 2, "without closed = true",
     "closed = true"},
    {"sigma_without_value", kMap, reference("turns_sigma = 0.1\n"), 2, "gives turns_sigma without turns",
     "turns"},
    {"negative_sigma", kMap, reference("turns = 1\nturns_sigma = -0.1\n"), 3, "turns_sigma is -0.1",
     "above 0"},
    {"distance_beyond_all_measure", kMap, reference("distance_m = 1e300\n"), 2, "distance_m is 1e+300",
     "between -1e9 and 1e9"},
    {"sigma_beyond_all_measure", kMap, reference("distance_m = 1\ndistance_m_sigma = 1e300\n"), 3,
     "distance_m_sigma is 1e+300", "between 1e-12 and 1e9"},
    {"sigma_of_nothing", kMap, reference("closed = true\nclosed_sigma_m = 1e-300\n"), 3,
     "closed_sigma_m is 1e-300", "between 1e-12 and 1e9"},
    {"negative_distance", kMap, reference("distance_m = -1\n"), 2, "distance_m is negative", "at least 0"},
    {"heading_twice", kMap, reference("end_heading_deg = 1\nend_heading_rad = 1\n"), 2,
     "gives end_heading_rad and end_heading_deg", "one of them"},
    {"heading_noise_twice", kMap, reference("heading_sigma_deg = 1\nheading_sigma_rad = 1\n"), 2,
     "gives heading_sigma_rad and heading_sigma_deg", "one of them"},
    {"noise_of_nothing", kMap, reference("position_sigma_m = 0\n"), 2, "position_sigma_m is 0", "above 0"},
    {"misspelt_reference", kMap, reference("closed = true\nend_x = 1\n"), 3, "unknown key 'end_x'",
     "'end_x_m'"},
    {"missing_tuples", kMap, "tuple_file = \"no.tuple\"\n", 1, "does not exist", "a .tuple file"},
};

class MalformedRecording : public testing::TestWithParam<Malformed> {};

TEST_P(MalformedRecording, is_refused_with_place_fact_and_expectation) {
  const Malformed& fault = GetParam();
  const test::Folder folder;
  folder.write("log.csv", "t,l,count_left\n0,1,2\n1,2,3\n");
  folder.write(fault.file, fault.content);
  try {
    read_recording(folder.path());
    FAIL() << "accepted:\n" << fault.content;
  } catch (const InputError& error) {
    const std::string message = error.what();
    const bool about_folder = std::string_view(fault.fact) == "holds no samples";
    std::string where = about_folder ? folder.path().string() : (folder / fault.file).string();
    if (fault.line > 0) where += ":" + std::to_string(fault.line);
    EXPECT_THAT(message, testing::StartsWith(where + ": "));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const std::size_t split = message.find("; expected ");
    ASSERT_NE(split, std::string::npos) << message;
    EXPECT_THAT(message.substr(0, split), HasSubstr(fault.fact));
    EXPECT_THAT(message.substr(split + 11), HasSubstr(fault.expectation));
  }
}

INSTANTIATE_TEST_SUITE_P(All, MalformedRecording, testing::ValuesIn(kCases),
                         [](const auto& instance) { return std::string(instance.param.name); });

void expect_refused(const std::filesystem::path& path, const char* fact, const char* expectation) {
  try {
    read_recording(path);
    FAIL() << "accepted " << path;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(fact));
    EXPECT_THAT(error.what(), HasSubstr(std::string("expected ") + expectation));
  }
}

TEST(MalformedRecording, what_is_no_folder_of_a_recording) {
  const test::Folder folder;
  expect_refused(folder / "nowhere", "does not exist", "the folder of a recording");
  expect_refused(folder.path(), "holds no recording", "a folder with wheels.csv");
  expect_refused(folder.write("notes.txt", "x"), "is neither a folder nor a log of a known format",
                 "the folder of a recording, or a log");
  expect_refused(folder.write("empty.bag", ""), "is empty", "the folder of a recording, or a log");
}

TEST(MalformedRecording, tuples) {
  const test::Folder folder;
  const auto tuple = [&](const char* text) { return folder.write("a.tuple", text); };
  expect_refused(tuple(""), "is empty", "{\"T\"");
  expect_refused(tuple("{\"T\": 1"), "a.tuple:1: an object is not closed", "{\"T\"");
  expect_refused(tuple("[1]\n"), "a.tuple:1", "{\"T\"");
  expect_refused(tuple("\n{\"T\": 0, \"phi_l\": 1, \"phi_r\": 1, \"sm\": [0,0,0]}"), "a.tuple:2: T is 0",
                 "a duration above 0 s");
  expect_refused(tuple("{\"T\": 1, \"phi_l\": 1, \"phi_r\": 1, \"sm\": [0,0]}"),
                 "sm does not have three numbers", "{\"T\"");
  expect_refused(tuple("{\"T\": 1, \"phi_r\": 1, \"sm\": [0,0,0]}"), "phi_l is missing or not a number",
                 "{\"T\"");
}

TEST(MalformedTrajectory, has_place_fact_and_expectation) {
  const test::Folder folder;
  const auto refused = [&](const std::filesystem::path& path, const char* fact) {
    try {
      static_cast<void>(read_trajectory(path));
      FAIL() << "accepted " << path;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(fact));
      EXPECT_THAT(error.what(), HasSubstr("; expected "));
    }
  };
  refused(folder / "none.csv", "does not exist");
  refused(folder.path(), "is a folder");
  refused(folder.write("empty.csv", "time_s,x_m,y_m,heading_rad\n"), "holds no pose");
  refused(folder.write("short.tum", "0 1 2 3\n"), "is beyond the 4 columns");
  refused(folder.write("word.tum", "0 1 2 0 0 0 0 1\n1 x 2 0 0 0 0 1\n"), "word.tum:2: column 2 holds 'x'");
  refused(folder.write("turned.tum", "0 1 2 0 0 0 0 0\n"), "turned.tum:1");
}

}  // namespace
}  // namespace trundle::recording
