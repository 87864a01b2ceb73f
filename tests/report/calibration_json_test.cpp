#include "trundle/report/calibration_json.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/report/scatter.hpp"

#include "report/example_result.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

const Json kProvenance = {{"program", "trundle"}, {"version", "1.2.3"}, {"inputs", Json::array()}};

Json json_of(const CalibrationResult& result) {
  return calibration_json(result, kProvenance);
}

TEST(CalibrationJson, NamesItsFormatAndProvenance) {
  const Json document = json_of(test::example_result());
  EXPECT_EQ(document["format"], "trundle-calibration");
  EXPECT_EQ(document["format_version"], 1);
  EXPECT_EQ(document["provenance"], kProvenance);
  EXPECT_EQ(document["robot"]["name"], "courier");
  EXPECT_EQ(document["status"], "all_estimated");
}

TEST(CalibrationJson, SameResultSameBytes) {
  EXPECT_EQ(json_of(test::example_result()).dump(), json_of(test::example_result()).dump());
}

TEST(CalibrationJson, AnEmptyResultHasAllKeysAndNothingInThem) {
  const Json document = json_of({});
  EXPECT_EQ(document["status"], "nothing_estimated");
  EXPECT_TRUE(document["e_max"].is_null());
  EXPECT_TRUE(document["errors"]["training"].is_null());
  EXPECT_TRUE(document["errors"]["hold_out"].is_null());
  for (const char* key : {"parameters", "directions", "end_points", "runs", "warnings", "cannot_tell"})
    EXPECT_EQ(document[key], Json::array()) << key;
}

TEST(CalibrationJson, AParameterCarriesValueSigmasAndBothIntervals) {
  const CalibrationResult result = test::example_result();
  const Json track = json_of(result)["parameters"][2];
  EXPECT_EQ(track["name"], "track");
  EXPECT_EQ(track["value"], result.parameters[2].value);
  EXPECT_LT(track["interval95_within"][0], track["value"]);
  EXPECT_GT(track["interval95_between"][1], track["interval95_within"][1]);
  const double sigma = result.parameters[2].sigma_total;
  EXPECT_NEAR(track["sigmas_from_nominal"], (0.201455 - 0.2) / sigma, 1e-9);
  EXPECT_TRUE(track["reason_held"].is_null());
}

TEST(CalibrationJson, AHeldParameterSaysWhyAndGivesNoInterval) {
  const Json held = json_of(test::example_with_held_parameter())["parameters"][1];
  EXPECT_FALSE(held["observable"]);
  for (const char* key :
       {"sigma_within", "sigma_total", "interval95_within", "interval95_between", "sigmas_from_nominal"})
    EXPECT_TRUE(held[key].is_null()) << key;
  EXPECT_THAT(held["reason_held"].get<std::string>(), HasSubstr("known to ±31 mm (1σ)"));
}

TEST(CalibrationJson, AnAngleThatTheRunsDoNotSeeIsExplainedInDegrees) {
  CalibrationResult result = test::example_with_held_parameter();
  result.parameters[1].unit = "rad";
  result.parameters[1].sigma_prior = radians(10.0);
  result.parameters[1].sigma_data = std::numeric_limits<double>::infinity();
  const Json held = json_of(result)["parameters"][1];
  EXPECT_EQ(held["reason_held"],
            "Held at nominal: these runs say nothing about it (it may plausibly be ±10° off).");
  EXPECT_TRUE(held["sigma_data"].is_null());
}

TEST(CalibrationJson, UnknownSpreadBetweenSessionsIsNull) {
  const Json parameters = json_of(test::example_of_one_session())["parameters"];
  for (const Json& parameter : parameters) {
    EXPECT_TRUE(parameter["sigma_between"].is_null());
    EXPECT_TRUE(parameter["interval95_between"].is_null());
    EXPECT_EQ(parameter["sigma_total"], parameter["sigma_within"]);
  }
}

TEST(CalibrationJson, CorrelationIsOfTheObservableParameters) {
  const Json correlation = json_of(test::example_with_held_parameter())["correlation"];
  EXPECT_EQ(correlation["names"], Json({"left.diameter", "track"}));
  EXPECT_EQ(correlation["within"][0][0], 1.0);
  EXPECT_NEAR(correlation["within"][0][1], 0.31, 1e-12);
  EXPECT_EQ(correlation["within"][0][1], correlation["within"][1][0]);
}

TEST(CalibrationJson, DirectionsAreNamedBySignAndSize) {
  const Json directions = json_of(test::example_with_held_parameter())["directions"];
  EXPECT_EQ(directions[0]["words"], "left.diameter against right.diameter");
  EXPECT_EQ(directions[1]["words"], "track");
  EXPECT_EQ(directions[2]["words"], "right.diameter and left.diameter together");
  EXPECT_TRUE(directions[0]["told"]);
  EXPECT_FALSE(directions[2]["told"]);
  EXPECT_NEAR(directions[2]["log10_singular_value"], std::log10(0.14), 1e-12);
}

TEST(CalibrationJson, ADirectionThatIsNotSeenAtAllHasNoLogarithm) {
  CalibrationResult result = test::example_result();
  result.directions[0].singular_value = 0.0;
  EXPECT_TRUE(json_of(result)["directions"][0]["log10_singular_value"].is_null());
}

TEST(CalibrationJson, EndPointsAreThoseOfTheTrainingRunsByTurn) {
  const CalibrationResult result = test::example_result();
  const Json groups = json_of(result)["end_points"];
  ASSERT_EQ(groups.size(), 2);
  EXPECT_EQ(groups[0]["turn"], "cw");
  EXPECT_EQ(groups[0]["before"]["run"], Json({0, 1, 5, 6, 10, 11}));
  EXPECT_EQ(groups[1]["before"]["run"].size(), 9);
  std::vector<Vector2> points;
  for (const RunResult& run : result.runs)
    if (run.turn == "cw") points.emplace_back(run.after->end_x_m, run.after->end_y_m);
  const Scatter scatter = scatter_of(points);
  EXPECT_EQ(groups[0]["after"]["centroid_x_m"], scatter.centroid.x());
  EXPECT_EQ(groups[0]["after"]["ellipse95"]["semi_major_m"], scatter.ellipse95->semi_major_m);
}

TEST(CalibrationJson, AHeldOutSquareIsAGroupOfItsOwn) {
  CalibrationResult result = test::example_result();
  result.runs[0].hold_out = true;
  const Json groups = json_of(result)["end_points"];
  ASSERT_EQ(groups.size(), 3);
  EXPECT_TRUE(groups[2]["hold_out"]);
  EXPECT_TRUE(groups[2]["before"]["ellipse95"].is_null());
}

TEST(CalibrationJson, ASheetHasNoEndPointsAfterwards) {
  CalibrationResult result = test::example_result();
  for (RunResult& run : result.runs) run.after.reset();
  const Json document = json_of(result);
  EXPECT_TRUE(document["end_points"][0]["after"].is_null());
  EXPECT_TRUE(document["errors"]["training"]["after"].is_null());
  EXPECT_EQ(document["errors"]["training"]["runs"], 15);
}

TEST(CalibrationJson, PooledErrorsAreRootMeanSquareOverTheRuns) {
  CalibrationResult result;
  result.runs.resize(3);
  for (std::size_t i = 0; i < 2; ++i) {
    result.runs[i].before =
        TrajectoryError{.position_rms_m = i == 0 ? 3.0 : 4.0, .position_max_m = i == 0 ? 9.0 : 7.0};
    result.runs[i].after = TrajectoryError{.position_rms_m = 1.0, .position_max_m = 2.0};
  }
  result.runs[2].before = TrajectoryError{.position_rms_m = 100.0};  // has no 'after': not compared
  result.runs[0].nees = 2.0;
  result.runs[1].nees = 5.0;
  const Json training = json_of(result)["errors"]["training"];
  EXPECT_EQ(training["runs"], 2);
  EXPECT_NEAR(training["before"]["position_rms_m"], std::sqrt(12.5), 1e-12);
  EXPECT_EQ(training["before"]["position_max_m"], 9.0);
  EXPECT_EQ(training["nees"], 3.5);
  EXPECT_TRUE(training["nees_white_only"].is_null());
}

TEST(CalibrationJson, ADownWeightedRunIsNamedAnOutlierWithItsRemark) {
  const Json run = json_of(test::example_result())["runs"][7];
  EXPECT_TRUE(run["outlier"]);
  EXPECT_EQ(run["remark"], "the reference jumps by 0.11 m at 23.4 s");
  EXPECT_FALSE(json_of(test::example_result())["runs"][6]["outlier"]);
}

TEST(CalibrationJson, DeviationIsTheDistanceAtTheReferencesStamps) {
  CalibrationResult result;
  result.runs.resize(1);
  RunResult& run = result.runs[0];
  run.reference.poses = {{0.0, {0.0, 0.0, 0.0}}, {1.0, {1.0, 0.0, 0.0}}, {3.0, {2.0, 0.0, 0.0}}};
  run.nominal.poses = {{0.0, {0.0, 0.0, 0.0}}, {2.0, {2.0, 0.0, 0.0}}};
  run.calibrated.poses = {{0.0, {0.0, 0.5, 0.0}}, {3.0, {3.0, 0.5, 0.0}}};
  const Json deviation = json_of(result)["runs"][0]["deviation"];
  EXPECT_EQ(deviation["path_m"], Json({0.0, 1.0, 2.0}));
  EXPECT_EQ(deviation["nominal_m"], Json({0.0, 0.0, nullptr}));
  EXPECT_NEAR(deviation["calibrated_m"][2], std::hypot(1.0, 0.5), 1e-5);
}

TEST(CalibrationJson, LongTrajectoriesAreThinnedToTheirLastPose) {
  CalibrationResult result;
  result.runs.resize(1);
  for (int i = 0; i < 20000; ++i) result.runs[0].reference.poses.push_back({0.1 * i, {0.01 * i, 0.0, 0.0}});
  const Json reference = json_of(result)["runs"][0]["trajectories"]["reference"];
  EXPECT_LE(reference["x_m"].size(), 501);
  EXPECT_GE(reference["x_m"].size(), 400);
  EXPECT_EQ(reference["time_s"].size(), reference["x_m"].size());
  EXPECT_NEAR(reference["x_m"].back(), 199.99, 1e-9);
}

TEST(CalibrationJson, AHeldOutRunHasNoResidualOfTheFit) {
  const Json runs = json_of(test::example_result())["runs"];
  EXPECT_TRUE(runs.back()["chi2_per_dof"].is_null());
  EXPECT_TRUE(runs[0]["chi2_per_dof"].is_number());
}

TEST(CalibrationJson, WithoutAReferenceThereIsNothingToDraw) {
  CalibrationResult result;
  result.runs.resize(1);
  const Json run = json_of(result)["runs"][0];
  EXPECT_TRUE(run["trajectories"].is_null());
  EXPECT_TRUE(run["deviation"].is_null());
}

TEST(CalibrationJson, NumbersThatAreNotFiniteBecomeNull) {
  CalibrationResult result = test::example_result();
  result.runs[0].chi2_per_dof = std::numeric_limits<double>::infinity();
  result.runs[1].before->position_rms_m = std::numeric_limits<double>::quiet_NaN();
  result.parameters[0].sigma_within = std::numeric_limits<double>::quiet_NaN();
  const Json document = json_of(result);
  EXPECT_TRUE(document["runs"][0]["chi2_per_dof"].is_null());
  EXPECT_TRUE(document["runs"][1]["before"]["position_rms_m"].is_null());
  EXPECT_TRUE(document["parameters"][0]["interval95_within"].is_null());
  EXPECT_EQ(Json::parse(document.dump()), document);
}

TEST(CalibrationJson, TextThatIsNotUtf8IsRepaired) {
  CalibrationResult result = test::example_result();
  result.runs[0].name = "caf\xe9";
  EXPECT_EQ(json_of(result)["runs"][0]["name"], "caf\xef\xbf\xbd");
}

TEST(CalibrationJson, HostileNamesStayWhatTheyAre) {
  const std::string names[] = {"</script><script>alert(1)</script>", "\"quoted\" 'twice' \\", "🤖 naïve",
                               std::string(10000, 'x'), ""};
  for (const std::string& name : names) {
    CalibrationResult result = test::example_result();
    result.nominal.name = name;
    result.runs[0].name = name;
    result.parameters[0].name = name;
    const Json document = json_of(result);
    EXPECT_EQ(document["robot"]["name"], name);
    EXPECT_EQ(document["runs"][0]["name"], name);
    EXPECT_EQ(Json::parse(document.dump()), document);
  }
}

}  // namespace
}  // namespace trundle::report
