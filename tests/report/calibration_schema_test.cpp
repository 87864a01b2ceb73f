// Reading a calibration.json back: what is malformed is refused with place, fact and expectation.
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/calibration_json.hpp"

#include "report/example_result.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;
using testing::StartsWith;

std::string message_for(const std::string& text) {
  try {
    parse_calibration_json(text, "c.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CalibrationSchema, ReadsBackWhatIsWritten) {
  for (const CalibrationResult& result : {test::example_result(), test::example_with_held_parameter(),
                                          test::example_of_one_session(), CalibrationResult{}}) {
    const Json document = calibration_json(result, Json::object());
    EXPECT_EQ(parse_calibration_json(document.dump(2), "c.json"), document);
  }
}

TEST(CalibrationSchema, ReadsBackNulls) {
  CalibrationResult result = test::example_result();
  result.runs[0].chi2_per_dof = std::numeric_limits<double>::infinity();
  result.runs[1].before->end_x_m = std::numeric_limits<double>::quiet_NaN();
  result.covariance_within(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const Json document = calibration_json(result, Json::object());
  EXPECT_EQ(parse_calibration_json(document.dump(), "c.json"), document);
}

TEST(CalibrationSchema, NamesTheLineThatIsNotJson) {
  EXPECT_THAT(message_for("{\n\"format\": \"trundle-calibration\",\n oops }"),
              StartsWith("c.json:3: is not JSON here; expected"));
  EXPECT_THAT(message_for(""), StartsWith("c.json:1: is not JSON here; expected"));
}

TEST(CalibrationSchema, RefusesNestingOfAnyDepthWithoutFalling) {
  EXPECT_THAT(message_for(std::string(200000, '[')), HasSubstr("nests deeper"));
  EXPECT_THAT(message_for("{\"runs\": " + std::string(70000, '[') + std::string(70000, ']') + "}"),
              HasSubstr("nests deeper"));
}

// Each key of an object is compared with all before it.
TEST(CalibrationSchema, RefusesObjectsOfAHundredThousandKeys) {
  std::string text = "{";
  for (int i = 0; i < 100'000; ++i) text += (i > 0 ? ",\"" : "\"") + std::to_string(i) + "\":0";
  EXPECT_THAT(message_for(text + "}"), HasSubstr("more keys"));
  EXPECT_THAT(message_for("{\"a\": " + text + "}}"), HasSubstr("more keys"));
}

TEST(CalibrationSchema, RefusesNumbersThatAreOutOfRange) {
  EXPECT_THAT(message_for(R"({"format": 1e999})"), HasSubstr("out of range"));
}

struct Damage {
  const char* name;
  std::function<void(Json&)> inflict;
  const char* message;
};

class CalibrationSchemaDamage : public testing::TestWithParam<Damage> {};

TEST_P(CalibrationSchemaDamage, IsNamed) {
  static const Json sound = calibration_json(test::example_result(), Json::object());
  Json document = sound;
  GetParam().inflict(document);
  EXPECT_THAT(message_for(document.dump()), HasSubstr(GetParam().message));
}

const Damage kDamages[] = {
    {"AnotherRoot", [](Json& d) { d = Json::array(); },
     "c.json: is JSON but not an object; expected \"format\""},
    {"NoFormat", [](Json& d) { d.erase("format"); }, "c.json: \"format\" is missing; expected"},
    {"AnotherFormat", [](Json& d) { d["format"] = "something"; },
     "c.json: \"format\" is something else; expected"},
    {"FormatIsANumber", [](Json& d) { d["format"] = 7; }, "\"format\" is something else"},
    {"NoVersion", [](Json& d) { d.erase("format_version"); }, "\"format_version\" is missing"},
    {"AnotherVersion", [](Json& d) { d["format_version"] = 99; }, "of another program version; expected 1"},
    {"NoParameters", [](Json& d) { d.erase("parameters"); }, "\"parameters\" is missing; expected an array"},
    {"ParametersAreAString", [](Json& d) { d["parameters"] = "three"; },
     "\"parameters\" is a string; expected an array"},
    {"AParameterIsANumber", [](Json& d) { d["parameters"][1] = 3; },
     "\"parameters[1]\" is a number; expected an object"},
    {"AParameterHasNoName", [](Json& d) { d["parameters"][1].erase("name"); },
     "\"parameters[1].name\" is missing; expected a string"},
    {"AValueIsAString", [](Json& d) { d["parameters"][0]["value"] = "0.08"; },
     "\"parameters[0].value\" is a string; expected a number or null"},
    {"AnIntervalIsANumber", [](Json& d) { d["parameters"][0]["interval95_within"] = 1.0; },
     "is a number; expected an array or null"},
    {"AnIntervalHasOneEnd", [](Json& d) { d["parameters"][0]["interval95_within"] = {1.0}; },
     "\"parameters[0].interval95_within\" has 1 numbers; expected 2"},
    {"AWarningIsAnObject", [](Json& d) { d["warnings"][0] = Json::object(); },
     "\"warnings[0]\" is an object; expected a string"},
    {"NoRobotName", [](Json& d) { d["robot"].erase("name"); }, "\"robot.name\" is missing"},
    {"RobotIsNull", [](Json& d) { d["robot"] = nullptr; }, "\"robot\" is null; expected an object"},
    {"ErrorsHaveNoTraining", [](Json& d) { d["errors"].erase("training"); },
     "\"errors.training\" is missing"},
    {"ARunHasNoWeight", [](Json& d) { d["runs"][4].erase("weight"); }, "\"runs[4].weight\" is missing"},
    {"ATrajectoryLacksAPoint", [](Json& d) { d["runs"][0]["trajectories"]["nominal"]["x_m"].erase(0); },
     "\"runs[0].trajectories.nominal\" has"},
    {"ATrajectoryHasText", [](Json& d) { d["runs"][0]["trajectories"]["nominal"]["x_m"][0] = "a"; },
     "\"runs[0].trajectories.nominal.x_m[0]\" is a string"},
    {"EndPointsLackAPoint", [](Json& d) { d["end_points"][0]["after"]["y_m"].erase(0); },
     "\"end_points[0].after\" has 6 x_m and 5 y_m"},
    {"ACorrelationRowIsShort", [](Json& d) { d["correlation"]["total"][1].erase(0); },
     "\"correlation.total\" has another size"},
    {"ACorrelationNameIsMissing", [](Json& d) { d["correlation"]["names"].erase(0); },
     "\"correlation.within\" has another size"},
    {"ADirectionHasNoWords", [](Json& d) { d["directions"][2].erase("words"); },
     "\"directions[2].words\" is missing"},
};

INSTANTIATE_TEST_SUITE_P(Table, CalibrationSchemaDamage, testing::ValuesIn(kDamages),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace trundle::report
