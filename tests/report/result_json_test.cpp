#include "trundle/report/result_json.hpp"

#include <array>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "trundle/report/calibration_json.hpp"
#include "trundle/report/calibration_parts.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/result_parts.hpp"

#include "recording/folder.hpp"
#include "report/example_result.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::ElementsAre;

constexpr const char* kHeader = "time_s,x_m,y_m,heading_rad,var_xx,var_xy,var_xh,var_yy,var_yh,var_hh\n";

/// Along x at 1 m/s, with its covariance.
std::string track(double start_s, double y_m = 0.0) {
  std::string rows = kHeader;
  for (int k = 0; k <= 20; ++k)
    rows += fmt::format("{},{},{},0,1e-4,0,0,1e-4,0,1e-6\n", start_s + 0.1 * k, 0.1 * k, y_m);
  return rows;
}

std::string reference(double start_s) {
  std::string rows = "time_s,x_m,y_m,heading_rad\n";
  for (int k = 0; k <= 20; ++k) rows += fmt::format("{},{},0,0\n", start_s + 0.1 * k, 0.1 * k);
  return rows;
}

std::vector<std::string> names(const Json& list) {
  std::vector<std::string> found;
  for (const Json& one : list) found.push_back(one.at("name"));
  return found;
}

TEST(Result, IsShownOnceWhereNothingWasCorrected) {
  const test::Folder folder;
  folder.write("odometry.csv", track(0.5));
  folder.write("trajectory.csv", track(0.5));
  folder.write("reference.csv", reference(0.5));
  EXPECT_THAT(names(read_result(folder.path()).at("errors")), ElementsAre("odometry"));
  folder.write("trajectory.csv", track(0.5, 0.01));
  EXPECT_THAT(names(read_result(folder.path()).at("errors")), ElementsAre("odometry", "trajectory"));
}

TEST(Result, IsJudgedByWhatTheReferenceStates) {
  const test::Folder folder;
  folder.write("odometry.csv", track(0.5));
  folder.write("reference.csv", reference(0.5));
  EXPECT_TRUE(read_result(folder.path()).at("errors")[0].at("summary").at("reference_noise").is_null());
  folder.write("evaluation.json",
               R"({"reference_noise": {"position_sigma_m": 0.02, "heading_sigma_rad": 0.1}})");
  const Json summary = read_result(folder.path()).at("errors")[0].at("summary");
  EXPECT_EQ(summary.at("reference_noise").at("position_sigma_m"), 0.02);
  EXPECT_EQ(summary.at("before_motion"), 1);
}

Json document_of(const std::vector<std::filesystem::path>& folders) {
  std::vector<Json> results;
  for (const auto& folder : folders) results.push_back(read_result(folder));
  return report_json(results, Json::object()).at("results");
}

TEST(Report, OnAPageOfManyResultsEachKeepsFewRows) {
  Results results{.label = "long", .tracks = {{.name = "odometry", .role = TrackRole::odometry}}};
  Trajectory& trajectory = results.tracks[0].trajectory;
  for (int i = 0; i <= 5000; ++i)
    trajectory.poses.push_back({0.1 * i, {0.1 * i, i == 1234 ? 7.0 : 0.0, 0.0}});
  const Json all = result_json(results), few = result_json(results, {}, 100);
  EXPECT_EQ(all.at("tracks")[0].at("drawn"), 5001);
  EXPECT_EQ(few.at("tracks")[0].at("poses"), 5001);
  EXPECT_LE(few.at("tracks")[0].at("drawn"), 102);
  EXPECT_GT(all.at("tracks")[0].at("marks").size(), few.at("tracks")[0].at("marks").size());
  EXPECT_FALSE(few.at("tracks")[0].at("marks").empty());
}

TEST(Report, RunsOfACalibrationAreThinnedEvenly) {
  Json column = Json::array();
  for (int i = 0; i < 500; ++i) column.push_back(i);
  const Json run = {{"trajectories", {{"nominal", {{"x_m", column}}}, {"reference", nullptr}}},
                    {"deviation", {{"path_m", column}, {"nominal_m", column}}}};
  const Json document = {{"runs", Json::array({run, {{"trajectories", nullptr}}})}};
  EXPECT_EQ(with_thinned_runs(document, 500), document);
  const Json thinned = with_thinned_runs(document, 100).at("runs")[0];
  for (const Json& values : {thinned.at("trajectories").at("nominal").at("x_m"),
                             thinned.at("deviation").at("path_m"), thinned.at("deviation").at("nominal_m")}) {
    EXPECT_LE(values.size(), 101U);
    EXPECT_GE(values.size(), 80U);
    EXPECT_EQ(values.front(), 0);
    EXPECT_EQ(values.back(), 499);
  }
}

TEST(Report, WhatSeveralHeadsSayIsSaidOnce) {
  const Json sources =
      result_json({.label = "",
                   .sources = {{.name = "a", .file = {}, .made_by = {"trundle 1", "option a"}},
                               {.name = "b", .file = {}, .made_by = {"trundle 1", "option b"}}}})
          .at("sources");
  EXPECT_EQ(sources[0].at("made_by"), Json::array({"trundle 1", "option a"}));
  EXPECT_EQ(sources[1].at("made_by"), Json::array({"option b"}));
}

TEST(Report, GoesByTheRecordingsOwnClockWhereItCanBeRead) {
  const test::Folder folder;
  folder.write("odometry.csv", track(12.25));
  EXPECT_EQ(document_of({folder.path()})[0].at("origin_s"), 0.0);
  folder.write("odometry.csv", track(1494449906.75));
  EXPECT_EQ(document_of({folder.path()})[0].at("origin_s"), 1494449906.0);
}

TEST(Report, NamesResultsByWhatTellsThemApart) {
  const test::Folder folder;
  folder.write("a/odometry.csv", track(0.0));
  folder.write("b/odometry.csv", track(0.0));
  const Json results = document_of({folder / "a", folder / "b"});
  EXPECT_EQ(results[0].at("label"), "a");
  EXPECT_EQ(results[1].at("label"), "b");
  EXPECT_EQ(document_of({folder / "a"})[0].at("label"), (folder / "a").string());
}

/// What attention sees of a result of which these are the other parts.
Json attention_to(const Results& results) {
  return attention_json({{"slip", nullptr}, {"errors", Json::array()}, {"sightings", nullptr}}, results);
}

/// A calibration without anything to act on; it may have set the gyro's clock.
CalibrationDocument quiet_calibration(const std::optional<std::string>& gyro_clock) {
  CalibrationResult calibration = test::example_result();
  calibration.warnings.clear();
  calibration.unobservable.clear();
  calibration.gyro_clock = gyro_clock;
  calibration.notes = {gyro_clock.value_or("something else")};
  return calibration_document(calibration, Json::object());
}

constexpr auto kLateGyro = &HealthProblem::is_of_gyro_clock;
constexpr auto kLateSteering = &HealthProblem::is_of_steering_clock;

/// Of a log one of whose clocks was late.
Json attention_to_late(bool HealthProblem::*clock, CalibrationDocument calibration) {
  HealthProblem late{.is_warning = true, .place = "run/imu.csv", .message = "late"};
  late.*clock = true;
  Json problems = Json::array();
  for (const Json& one : attention_to({.label = "",
                         .info = InfoResult{.document = {}, .problems = {late}},
                         .calibration = std::move(calibration)}))
    if (one.at("kind") == "problem") problems.push_back(one);
  return problems;
}

TEST(Attention, NamesTheFile) {
  const Json problems = attention_to_late(kLateGyro, quiet_calibration(std::nullopt));
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].at("place"), "run/imu.csv");
  EXPECT_EQ(problems[0].at("words"), "late");
}

TEST(Attention, IsNotAskedForWhatTheCalibrationHasSet) {
  const CalibrationDocument set =
      quiet_calibration("gyro.time_offset_s -0.0631 ± 0.0009 s (was 0.0000), from the turns");
  EXPECT_TRUE(attention_to_late(kLateGyro, set).empty());
  const auto read_again = [](const CalibrationDocument& written) {
    return calibration_from_json(json_text(written.document), "calibration.json");
  };
  EXPECT_TRUE(attention_to_late(kLateGyro, read_again(set)).empty());
  EXPECT_FALSE(attention_to_late(kLateGyro, read_again(quiet_calibration(std::nullopt))).empty());
}

TEST(Attention, IsAskedForAClockThatTheCalibrationHasNotSet) {
  CalibrationDocument set = quiet_calibration("gyro.time_offset_s -0.0631 ± 0.0009 s (was 0.0000)");
  EXPECT_FALSE(attention_to_late(kLateSteering, set).empty());
  set.document["notes"] = {"steering_time_offset_s -0.2003 ± 0.0029 s (was 0.0000), from turns"};
  set = calibration_from_json(json_text(set.document), "calibration.json");
  EXPECT_TRUE(attention_to_late(kLateSteering, set).empty());
  EXPECT_FALSE(attention_to_late(kLateGyro, set).empty());
}

TEST(Attention, NamesStagesThatFailedButNotThePageItself) {
  RunRecord run;
  run.stages = {{.kind = StageKind::slip, .status = StageStatus::failed, .message = "no"},
                {.kind = StageKind::slam, .status = StageStatus::skipped, .message = "nothing seen"},
                {.kind = StageKind::report, .status = StageStatus::failed, .message = "disk full"}};
  EXPECT_EQ(attention_to({.label = "", .run = run}),
            Json::array({{{"kind", "stage"}, {"name", "slip"}, {"words", "no"}}}));
}

/// What the track is in proportion to, by a calibration of these parameters beside it.
Json exact_for_track(const std::vector<std::string>& others) {
  Json json = calibration_json(test::example_result(), Json::object());
  Json track, parameters = Json::array();
  for (const Json& parameter : json.at("parameters"))
    if (parameter.at("name") == "track") track = parameter;
  parameters.push_back(track);
  for (const std::string& name : others) {
    parameters.push_back(track);
    parameters.back()["name"] = name;
  }
  json["parameters"] = parameters;
  Json result = {{"calibration", json}, {"errors", Json::array()}};
  for (const char* none : {"slip", "map", "gyro"}) result[none] = nullptr;
  for (const Json& answer : answers_json(result))
    if (answer.value("name", "") == "track") return answer.at("taken_as_exact");
  return nullptr;
}

TEST(Answers, SayWhatTheTrackIsInProportionTo) {
  EXPECT_EQ(exact_for_track({}), Json({"left.diameter", "right.diameter"}));
  EXPECT_EQ(exact_for_track({"gyro.bias"}), Json({"left.diameter", "right.diameter", "gyro.scale"}));
  EXPECT_EQ(exact_for_track({"left.diameter", "gyro.bias", "gyro.scale"}), Json::array({"right.diameter"}));
  EXPECT_EQ(exact_for_track({"left.diameter", "right.diameter"}), Json::array());
}

/// Of wheels that are as equal as configured, both larger by `share`.
Json attention_to_wheels(double share) {
  CalibrationResult calibration = test::example_result();
  Json json = calibration_json(calibration, Json::object());
  for (Json& parameter : json.at("parameters"))
    if (parameter.at("name").get<std::string>().ends_with(".diameter"))
      parameter["value"] = parameter.at("nominal").get<double>() * (1.0 + share);
  const Json all = attention_to({.label = "", .calibration = CalibrationDocument{json}});
  Json wheels = Json::array();
  for (const Json& one : all)
    if (one.at("kind") == "wheel_ratio" || one.at("kind") == "wheel_scale") wheels.push_back(one);
  return wheels;
}

TEST(Attention, TellsOfWheelsThatAreLargerInTheMean) {
  EXPECT_TRUE(attention_to_wheels(0.0).empty());
  const Json wheels = attention_to_wheels(0.1);
  ASSERT_EQ(wheels.size(), 1);
  EXPECT_EQ(wheels[0].at("kind"), "wheel_scale");
  EXPECT_NEAR(wheels[0].at("value"), 0.1, 1e-12);
  const Json& both = wheels[0].at("diameters_m");
  ASSERT_EQ(both.size(), 2);
  // Of the mean the sigma lies between that of half the difference and that of the sum: by how much, the
  // correlation says.
  const double r1 = both[0].at("sigma").get<double>() / both[0].at("nominal").get<double>();
  const double r2 = both[1].at("sigma").get<double>() / both[1].at("nominal").get<double>();
  EXPECT_GE(wheels[0].at("sigma"), 0.5 * std::abs(r1 - r2));
  EXPECT_LE(wheels[0].at("sigma"), 0.5 * (r1 + r2));
}

}  // namespace
}  // namespace trundle::report
