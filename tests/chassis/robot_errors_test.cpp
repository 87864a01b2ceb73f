#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/error.hpp"

namespace trundle::chassis {
namespace {

using namespace std::string_view_literals;

struct Malformed {
  const char* name;
  std::string text;
  int line;                 ///< where the fault stands
  const char* fact;         ///< words of the message before "; expected "
  const char* expectation;  ///< and after it
};

std::ostream& operator<<(std::ostream& out, const Malformed& malformed) {
  return out << malformed.name;
}

class MalformedRobot : public testing::TestWithParam<Malformed> {};

TEST_P(MalformedRobot, is_refused_with_place_fact_and_expectation) {
  const Malformed& file = GetParam();
  try {
    parse_robot(file.text, "my/robot.toml");
    FAIL() << "accepted:\n" << file.text;
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_THAT(message, testing::StartsWith(fmt::format("my/robot.toml:{}: ", file.line)));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const std::size_t split = message.find("; expected ");
    ASSERT_NE(split, std::string::npos) << message;
    EXPECT_THAT(message.substr(0, split), testing::HasSubstr(file.fact));
    EXPECT_THAT(message.substr(split + 11), testing::HasSubstr(file.expectation));
  }
}

/// A wheel of lines 1 to 3, then lines of its own.
std::string wheel(const std::string& lines) {
  return "[[wheel]]\nname = \"left\"\ndiameter_m = 0.07\n" + lines;
}

std::string section(const std::string& title, const std::string& lines) {
  return "[" + title + "]\n" + lines;
}

/// "a.a.a": a table each.
std::string key_of_levels(int levels) {
  std::string key = "a";
  for (int i = 1; i < levels; ++i) key += ".a";
  return key;
}

std::string nine_wheels() {
  std::string text;
  for (int i = 0; i < 9; ++i) text += fmt::format("[[wheel]]\nname = \"w{}\"\ndiameter_m = 0.1\n", i);
  return text;
}

/// A differential drive in lines 1 to 8, [calibration] in line 9, `head` from line 10, then two parameters.
std::string calibrated(const std::string& head, const std::string& change = "", const std::string& to = "") {
  std::string text = R"([[wheel]]
name = "left"
diameter_m = 0.07
y_m = 0.1
[[wheel]]
name = "right"
diameter_m = 0.07
y_m = -0.1
[calibration]
)" + head + R"([[calibration.parameter]]
name = "left.diameter"
unit = "m"
value = 0.071
nominal = 0.07
sigma_within = 1e-4
observable = true
[[calibration.parameter]]
name = "track"
unit = "m"
value = 0.21
nominal = 0.2
sigma_within = 1e-3
observable = true
)";
  if (const auto at = change.empty() ? std::string::npos : text.find(change); at != std::string::npos)
    text.replace(at, change.size(), to);
  return text;
}

const std::string kNames = "covariance_of = [\"left.diameter\", \"track\"]\n";  // line 10
const std::string kMatrix = "covariance = [[1e-8, 0.0], [0.0, 1e-6]]\n";        // line 11
const std::string kGood = kNames + kMatrix;                                     // parameters from 12

TEST(MalformedRobot, differs_from_a_good_one) {
  EXPECT_NO_THROW(parse_robot(wheel("x_m = 0.1\n"), "r"));
  EXPECT_NO_THROW(parse_robot(calibrated(kGood), "r"));
}

// clang-format off
const Malformed kFiles[] = {
    // TOML itself
    {"no_value", "name = \n", 1, "expected value", "TOML"},
    {"no_equals", "name \"x\"\n", 1, "", "TOML"},
    {"open_string", "\nname = \"x\n", 2, "string", "TOML"},
    {"open_bracket", "[[wheel]\n", 1, "", "TOML"},
    {"key_twice", wheel("x_m = 1\nx_m = 2\n"), 5, "'x_m'", "each key once"},
    {"key_of_31000_levels", "\n" + key_of_levels(31000) + " = 1\n", 2, "a key of more than a thousand parts", "TOML"},
    {"table_of_31000_levels", "[" + key_of_levels(31000) + "]\n", 1, "a key of more than a thousand parts", "TOML"},
    {"list_of_70000_levels", "x = " + std::string(70000, '[') + "\n", 1, "nested", "TOML"},
    {"table_twice", "[gyro]\n\n[gyro]\n", 3, "'gyro'", "each table once"},
    {"not_utf8", "name = \"\xff\"\n", 1, "utf-8", "TOML"},
    {"binary", std::string("\x7f""ELF\0\1\2", 7), 1, "", "TOML"},
    {"csv", "time_s,left_ticks\n0.0,1\n", 1, "", "TOML"},
    {"integer_too_long", wheel("x_m = 99999999999999999999\n"), 4, "99999999999999999999", "in range"},
    {"float_too_large", wheel("x_m = 1e400\n"), 4, "1e400", "in range"},
    {"comma_as_decimal_point", wheel("x_m = 0,115\n"), 4, "','", "TOML"},
    // keys
    {"unknown_near", wheel("diametre_m = 0.07\n"), 4, "[[wheel]]: unknown key 'diametre_m'", "'diameter_m'"},
    {"unknown_unit", wheel("direction_rad = 0.0\n"), 4, "unknown key 'direction_rad'", "'direction_deg'"},
    {"unknown_far", wheel("colour = \"red\"\n"), 4, "unknown key 'colour'", "one of name, kind, tick_bits, passive, steered, x_m"},
    {"unknown_top", "nmae = \"x\"\n", 1, "unknown key 'nmae'", "'name'"},
    {"unknown_section", "[gyroscope]\nscale = 1\n", 1, "unknown key 'gyroscope'", "'gyro'"},
    {"velocity_of_wheels", wheel(section("velocity", "forward_scale = 1.1\n")), 4, "[velocity] of a robot with wheels", "either [[wheel]] or [velocity]"},
    {"velocity_scale_zero", section("velocity", "yaw_scale = 0.0\n"), 2, "yaw_scale is 0", "a number from 0.000001"},
    {"unknown_in_velocity", section("velocity", "yaw_bias = 0.0\n"), 2, "[velocity]: unknown key 'yaw_bias'", "'yaw_bias_rad_s'"},
    {"unknown_in_gyro", section("gyro", "bias_rads = 0.0\n"), 2, "[gyro]: unknown key 'bias_rads'", "'bias_rad_s'"},
    {"unknown_in_noise", section("noise", "wheel_per_m = 0.01\n"), 2, "[noise]: unknown key 'wheel_per_m'", "'wheel_per_sqrt_m'"},
    {"unknown_in_sensor", section("landmark_sensor", "bearing_sigma_rad = 0.1\n"), 2, "[landmark_sensor]", "'bearing_sigma_deg'"},
    {"unknown_in_reference", section("reference_sensor", "x = 0.1\n"), 2, "[reference_sensor]: unknown key 'x'", "'x_m'"},
    {"unknown_in_wheels", section("wheels", "offset_s = 0.1\n"), 2, "[wheels]: unknown key 'offset_s'", "'time_offset_s'"},
    {"wheel_key_at_top", "diameter_m = 0.07\n", 1, "unknown key 'diameter_m'", "one of name, wheel"},
    // sections
    {"wheel_is_a_table", "[wheel]\nname = \"left\"\n", 1, "wheel is a table", "[[wheel]]"},
    {"wheel_is_a_number", "wheel = 2\n", 1, "wheel is 2", "[[wheel]]"},
    {"wheels_are_names", "wheel = [\"left\", \"right\"]\n", 1, "wheel is an array", "[[wheel]]"},
    {"gyro_is_a_flag", "gyro = true\n", 1, "gyro is true", "[gyro]"},
    {"gyro_is_many", "[[gyro]]\nscale = 1.0\n", 1, "gyro is an array", "[gyro]"},
    {"name_is_a_number", "\nname = 7\n", 2, "name is 7", "a string"},
    // wheels
    {"no_wheel_name", "[[wheel]]\ndiameter_m = 0.07\n", 1, "[[wheel]]: no key 'name'", "letters"},
    {"no_diameter", "name = \"x\"\n[[wheel]]\nname = \"left\"\n", 2, "[[wheel]]: no key 'diameter_m'", "metres above 0"},
    {"empty_wheel_name", "[[wheel]]\nname = \"\"\ndiameter_m = 0.07\n", 2, "name is \"\"", "letters"},
    {"wheel_name_with_comma", "[[wheel]]\nname = \"a,b\"\ndiameter_m = 0.07\n", 2, "name is \"a,b\"", "letters"},
    {"wheel_name_with_dot", "[[wheel]]\nname = \"a.b\"\ndiameter_m = 0.07\n", 2, "name is \"a.b\"", "letters"},
    {"wheel_name_reserved", "[[wheel]]\nname = \"ambiguous\"\ndiameter_m = 0.07\n", 2, "\"ambiguous\"", "neither"},
    {"wheel_name_of_a_steering", "[[wheel]]\nname = \"a_steering\"\ndiameter_m = 0.07\n", 2, "\"a_steering\"", "at its end"},
    {"wheel_name_is_a_number", "[[wheel]]\nname = 1\ndiameter_m = 0.07\n", 2, "name is 1", "letters"},
    {"wheel_name_twice", wheel("") + wheel(""), 5, "two wheels are named \"left\"", "a different name"},
    {"nine_wheels", nine_wheels(), 25, "more than 8 wheels", "at most 8"},
    {"unknown_kind", wheel("kind = \"castor\"\n"), 4, "kind is \"castor\"", "\"fixed\", \"skid\", \"omni\" or \"mecanum\""},
    {"kind_is_a_flag", wheel("kind = true\n"), 4, "kind is true", "\"fixed\""},
    {"negative_diameter", "[[wheel]]\nname = \"left\"\ndiameter_m = -0.07\n", 3, "diameter_m is -0.07", "metres above 0"},
    {"zero_diameter", "[[wheel]]\nname = \"left\"\ndiameter_m = 0\n", 3, "diameter_m is 0", "metres above 0"},
    {"diameter_in_millimetres", "[[wheel]]\nname = \"left\"\ndiameter_m = 70.4\n", 3, "diameter_m is 70.4", "at most 20"},
    {"diameter_nan", "[[wheel]]\nname = \"left\"\ndiameter_m = nan\n", 3, "diameter_m is nan", "metres above 0"},
    {"diameter_is_text", "[[wheel]]\nname = \"left\"\ndiameter_m = \"0.07\"\n", 3, "diameter_m is \"0.07\"", "metres above 0"},
    {"diameter_is_a_list", "[[wheel]]\nname = \"left\"\ndiameter_m = [0.07]\n", 3, "diameter_m is an array", "metres above 0"},
    {"diameter_is_a_date", "[[wheel]]\nname = \"left\"\ndiameter_m = 2020-01-01\n", 3, "diameter_m is a date", "metres above 0"},
    {"position_infinite", wheel("x_m = inf\n"), 4, "x_m is inf", "metres between -100 and 100"},
    {"position_in_millimetres", wheel("y_m = -115\n"), 4, "y_m is -115", "metres between -100 and 100"},
    {"direction_too_large", wheel("direction_deg = 900\n"), 4, "direction_deg is 900", "degrees between -360 and 360"},
    {"direction_nan", wheel("direction_deg = -nan\n"), 4, "direction_deg is", "degrees between"},
    {"direction_is_a_word", wheel("direction_deg = \"left\"\n"), 4, "direction_deg is \"left\"", "degrees between"},
    {"mecanum_without_roller", wheel("kind = \"mecanum\"\n"), 1, "no key 'roller_deg'", "degrees between -89 and 89"},
    {"roller_along_rolling", wheel("kind = \"mecanum\"\nroller_deg = 90.0\n"), 5, "roller_deg is 90", "degrees between -89 and 89"},
    {"roller_without_mecanum", wheel("kind = \"omni\"\nroller_deg = 45.0\n"), 5, "roller_deg without rollers", "\"mecanum\""},
    {"steered_is_a_number", wheel("steered = 1\n"), 4, "steered is 1", "true or false"},
    {"passive_is_text", wheel("passive = \"yes\"\n"), 4, "passive is \"yes\"", "true or false"},
    {"steering_of_a_wheel_that_is_not_steered", wheel("steering_zero_deg = 1.0\n"), 4, "steering_zero_deg of a wheel that is not steered", "steered is true"},
    {"steered_omni", wheel("kind = \"omni\"\nsteered = true\n"), 4, "a steered wheel that may skid sideways", "\"fixed\""},
    {"steering_scale_zero", wheel("steered = true\nsteering_scale = 0\n"), 5, "steering_scale is 0", "other than 0"},
    {"steering_sigma_negative", wheel("steered = true\nsteering_sigma_deg = -1\n"), 5, "steering_sigma_deg is -1", "at least 0"},
    {"passive_with_an_encoder", "[[wheel]]\nname = \"left\"\npassive = true\nticks_per_revolution = 100\n", 4, "ticks_per_revolution of a passive wheel", "an encoder"},
    {"passive_omni", "[[wheel]]\nname = \"left\"\nkind = \"omni\"\npassive = true\n", 3, "a passive wheel that may skid sideways", "\"fixed\""},
    {"all_passive", "[[wheel]]\nname = \"left\"\npassive = true\n", 1, "every wheel is passive", "one with an encoder"},
    {"ticks_infinite", wheel("ticks_per_revolution = inf\n"), 4, "ticks_per_revolution is inf", "a finite number"},
    {"bits_negative", wheel("tick_bits = -1\n"), 4, "tick_bits is -1", "a whole number between 0 and 64"},
    {"bits_too_many", wheel("tick_bits = 65\n"), 4, "tick_bits is 65", "a whole number between 0 and 64"},
    {"bits_fractional", wheel("tick_bits = 15.5\n"), 4, "tick_bits is 15.5", "a whole number between 0 and 64"},
    {"recorded_diameter_negative", wheel("recorded_diameter_m = -1.0\n"), 4, "recorded_diameter_m is -1", "metres above 0"},
    {"icr_is_text", "icr_x_m = \"0\"\n", 1, "icr_x_m is \"0\"", "metres between"},
    {"tyres_that_explode", "tyre_growth_s2_m2 = 1.5\n", 1, "tyre_growth_s2_m2 is 1.5", "from -1 to 1"},
    {"wheel_name_of_two_lines", "[[wheel]]\nname = \"a\\nb\"\ndiameter_m = 0.07\n", 2, "name is \"a\\x0Ab\"", "letters"},
    // sensors and noise
    {"offset_infinite", section("wheels", "time_offset_s = inf\n"), 2, "time_offset_s is inf", "a finite number"},
    {"scale_zero", section("gyro", "scale = 0.0\n"), 2, "scale is 0", "a number other than 0"},
    {"noise_of_a_wheel_negative", wheel("noise_per_sqrt_m = -0.01\n"), 4, "noise_per_sqrt_m is -0.01", "at least 0"},
    {"noise_of_a_wheel_infinite", wheel("noise_per_sqrt_m = inf\n"), 4, "noise_per_sqrt_m is inf", "at least 0"},
    {"noise_of_a_wheel_unknown", wheel("noise_per_sqrt_m = nan\n"), 4, "noise_per_sqrt_m is nan", "at least 0"},
    {"gyro_noise_negative", section("gyro", "\nnoise_rad_s_sqrt_hz = -1e-4\n"), 3, "noise_rad_s_sqrt_hz is -0.0001", "at least 0"},
    {"wheel_noise_beyond_all_measure", section("noise", "wheel_per_sqrt_m = 1e3\n"), 2, "wheel_per_sqrt_m is 1000", "at most 10"},
    {"noise_of_a_wheel_beyond_all_measure", wheel("noise_per_sqrt_m = 1e6\n"), 4, "noise_per_sqrt_m is 1000000", "at most 10"},
    {"gyro_noise_beyond_all_measure", section("gyro", "\nnoise_rad_s_sqrt_hz = 1e4\n"), 3, "noise_rad_s_sqrt_hz is 10000", "at most 100"},
    {"range_sigma_beyond_all_measure", section("landmark_sensor", "range_sigma_m = 1e6\n"), 2, "range_sigma_m is 1000000", "at most 1000"},
    {"max_rate_zero", section("gyro", "max_rate_rad_s = 0\n"), 2, "max_rate_rad_s is 0", "a number above 0"},
    {"bias_nan", section("gyro", "bias_rad_s = nan\n"), 2, "bias_rad_s is nan", "a finite number"},
    {"range_sigma_zero", section("landmark_sensor", "range_sigma_m = 0.0\n"), 2, "range_sigma_m is 0", "a number above 0"},
    {"max_range_negative", section("landmark_sensor", "max_range_m = -8\n"), 2, "max_range_m is -8", "a number above 0"},
    {"wheel_noise_negative", section("noise", "wheel_per_sqrt_m = -0.01\n"), 2, "wheel_per_sqrt_m is -0.01", "at least 0"},
    {"reference_is_a_flag", section("reference_sensor", "x_m = false\n"), 2, "x_m is false", "metres between"},
    // [calibration]
    {"calibration_unknown_key", calibrated("covarience = 1\n" + kGood), 10, "[calibration]: unknown key 'covarience'", "'covariance'"},
    {"calibration_unknown_parameter", calibrated(kGood, "\"left.diameter\"\nunit", "\"left.diametre\"\nunit"), 13, "no parameter \"left.diametre\"", "\"left.diameter\""},
    {"calibration_parameter_twice", calibrated(kGood, "\"track\"\nunit", "\"left.diameter\"\nunit"), 19, "a second parameter \"left.diameter\"", "once"},
    {"calibration_wrong_unit", calibrated(kGood, "unit = \"m\"", "unit = \"mm\""), 14, "unit of left.diameter is \"mm\"", "\"m\""},
    {"calibration_no_value", calibrated(kGood, "value = 0.071\n", ""), 12, "no key 'value'", "a finite number"},
    {"calibration_negative_sigma", calibrated(kGood, "1e-4", "-1e-4"), 17, "sigma_within is -0.0001", "at least 0"},
    {"calibration_infinite_sigma_of_a_known", calibrated(kGood, "1e-4", "inf"), 17, "sigma_within is inf", "at least 0"},
    {"calibration_observable_is_text", calibrated(kGood, "observable = true", "observable = \"yes\""), 18, "observable is", "true or false"},
    {"covariance_missing", calibrated(kNames), 9, "no key 'covariance'", "2 arrays of 2 numbers"},
    {"covariance_names_missing", calibrated(kMatrix), 9, "no key 'covariance_of'", "left.diameter, track"},
    {"covariance_names_swapped", calibrated("covariance_of = [\"track\", \"left.diameter\"]\n" + kMatrix), 10, "covariance_of names others", "left.diameter, track"},
    {"covariance_names_numbers", calibrated("covariance_of = [1, 2]\n" + kMatrix), 10, "covariance_of is 1", "strings"},
    {"covariance_too_few_rows", calibrated(kNames + "covariance = [[1e-8, 0.0]]\n"), 11, "another shape", "2 arrays of 2 numbers"},
    {"covariance_ragged", calibrated(kNames + "covariance = [\n[1e-8, 0.0],\n[0.0]]\n"), 13, "row 2", "2 numbers"},
    {"covariance_of_text", calibrated(kNames + "covariance = [[1e-8, \"0\"], [0.0, 1e-6]]\n"), 11, "covariance is \"0\"", "finite number"},
    {"covariance_nan", calibrated(kNames + "covariance = [[1e-8, nan], [0.0, 1e-6]]\n"), 11, "covariance is nan", "finite number"},
    {"covariance_asymmetric", calibrated(kNames + "covariance = [[1e-8, 2e-8], [3e-8, 1e-6]]\n"), 11, "2e-08 at (1, 2) and 3e-08 at (2, 1)", "symmetric"},
    {"covariance_negative_variance", calibrated(kNames + "covariance = [[-1e-8, 0.0], [0.0, 1e-6]]\n"), 11, "negative variance", "positive semidefinite"},
    {"covariance_indefinite", calibrated(kNames + "covariance = [[1e-8, 2e-7], [2e-7, 1e-6]]\n"), 11, "negative variance", "positive semidefinite"},
    {"covariance_beside_a_zero_variance", calibrated(kNames + "covariance = [[0.0, 1e-9], [1e-9, 1e-6]]\n"), 11, "negative variance", "positive semidefinite"},
    {"error_without_unit", calibrated(kGood) + "[[calibration.error]]\nwhat = \"x\"\nbefore = 1\nafter = 0.1\n", 26, "no key 'unit'", "its unit"},
    {"provenance_is_text", calibrated("provenance = \"trundle\"\n" + kGood), 10, "provenance is \"trundle\"", "strings"},
};
// clang-format on

TEST(MalformedRobot, of_any_bytes_is_read_or_refused_in_one_line) {
  const std::string good =
      calibrated(kGood) + "[gyro]\nscale = -1.0\n[reference_sensor]\nheading_deg = 9_0.5\n";
  constexpr std::string_view kBytes = "0.-+=[]{}\"'#\n\r\t\\_eE\0\x80xnaif"sv;
  std::mt19937_64 engine(6);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = good.substr(0, 1 + engine() % good.size());
    for (auto changes = engine() % 4; changes > 0; --changes)
      text[engine() % text.size()] = kBytes[engine() % kBytes.size()];
    try {
      parse_robot(text, "r");
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos) << error.what();
    }
  }
  EXPECT_GT(refused, 1000);
}

std::string dotted_key(int parts) {
  std::string key = "a";
  for (int i = 1; i < parts; ++i) key += ".a";
  return key;
}

TEST(MalformedRobot, of_keys_within_keys_breaks_no_stack) {
  for (const int parts : {500, 1001, 31'000, 1'000'000})
    for (const std::string& text : {"\n" + dotted_key(parts) + " = 1\n", "\n[" + dotted_key(parts) + "]\n"})
      EXPECT_THROW(parse_robot(text, "r"), InputError) << parts;
}

// An "=" that is no sign of equality, or one that belongs to the key before.
TEST(MalformedRobot, of_keys_behind_quotes_and_in_tables_breaks_no_stack) {
  const std::string key = dotted_key(1'000'000);
  for (const std::string& text :
       {"\"=\"." + key + " = 1\n", "'=,'." + key + " = 1\n", "a = {b = 1, " + key + " = 1}\n",
        "a = [{b = \"\"\"it's\n don't\"\"\", " + key + " = 1}] # '\n", "a = \"\\\"\" #\n" + key + " = 1\n"})
    EXPECT_THAT([&] { parse_robot(text, "r"); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr("a key of more than a thousand parts")))
        << text.substr(0, 20);
}

TEST(MalformedRobot, points_in_texts_and_comments_are_no_parts_of_a_key) {
  const std::string points(3000, '.');
  EXPECT_NO_THROW(parse_robot("# " + points + "\nname = \"\"\"\n" + points + "\"\"\"\n" + wheel(""), "r"));
}

INSTANTIATE_TEST_SUITE_P(Files, MalformedRobot, testing::ValuesIn(kFiles),
                         [](const auto& file) { return std::string(file.param.name); });

}  // namespace
}  // namespace trundle::chassis
