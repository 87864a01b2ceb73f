// What is read of a file of results is what was written into it.
#include "trundle/report/results.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

/// The message of an InputError; fails where there is none.
template <typename Read>
std::string error_of(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return {};
}

RunRecord example_run() {
  return {.provenance = {.inputs = {{"robot.toml", "abc"}}, .options = {{"filter", "ekf"}}, .seed = 7},
          .recording_name = "tour",
          .session = "one",
          .recording_path = "in/tour",
          .given_robot = "robot.toml",
          .used_robot = "calibrated.toml",
          .held_out = false,
          .stages = {{.kind = StageKind::health_check,
                      .status = StageStatus::done,
                      .message = "no fault found",
                      .outputs = {"info.json"},
                      .remarks = {"warning: x"}},
                     {.kind = StageKind::recording, .status = StageStatus::failed, .recording = "square_1"}},
          .trajectories = {{"odometry", "odometry.csv", "what"}},
          .recordings = {"square_1"}};
}

TEST(RunRecord, IsReadAsItWasWritten) {
  const Json document = to_json(example_run());
  const RunRecord again = run_record_from_json(document.dump(), "run.json");
  EXPECT_EQ(to_json(again), document);
  EXPECT_EQ(again.stages[0].kind, StageKind::health_check);
  EXPECT_EQ(again.stages[1].kind, StageKind::recording);
  EXPECT_EQ(name_of(again.stages[1]), "square_1");
}

TEST(RunRecord, OfAnotherVersionKeepsItsName) {
  Json document = to_json(example_run());
  document["version"] = "0.0.1";
  EXPECT_EQ(run_record_from_json(document.dump(), "run.json").provenance.version, "0.0.1");
}

TEST(RunRecord, NamesTheStatusThatIsNone) {
  Json document = to_json(example_run());
  document["stages"][1]["status"] = "maybe";
  const std::string error = error_of([&] { run_record_from_json(document.dump(), "d/run.json"); });
  EXPECT_THAT(error, HasSubstr("d/run.json: \"stages[1].status\" is \"maybe\""));
  EXPECT_THAT(error, HasSubstr("done, skipped, failed"));
}

TEST(SlipResult, IsReadAsItWasWritten) {
  SlipResult slip{.counts = {{"judged", 3}},
                  .events = {{.start_s = 1.0,
                              .end_s = 1.5,
                              .wheel = "left",
                              .kind = "spin",
                              .excess_m = 0.1,
                              .confidence = 0.99,
                              .excess_sigma_m = 0.01},
                             {.start_s = 2.0, .end_s = 2.5, .wheel = "right", .kind = "skid"}},
                  .timeline = SlipTimeline{.statistic = "chi2", .limit = 9.0},
                  .cannot_see = {"skids of both"}};
  slip.timeline->end_s = {0.25, 0.5};
  slip.timeline->value = {1.5, std::nan("")};
  slip.timeline->status = {"judged", "parked"};
  slip.timeline->slipping = {true, false};
  const Json document = to_json(slip);
  EXPECT_TRUE(document.at("timeline").at("value")[1].is_null());
  EXPECT_EQ(to_json(slip_from_json(document.dump(), "slip.json")), document);
}

TEST(SlipResult, NamesAStatusThatIsNoWord) {
  const std::string error = error_of([] {
    slip_from_json(
        R"({"events": [], "intervals": {}, "learned": null, "timeline": {"status": ["judged", 7]}})",
        "d/slip.json");
  });
  EXPECT_THAT(error, HasSubstr("d/slip.json: \"timeline.status[1]\" is a number"));
}

TEST(OdometryResult, RefusesColumnsOfOtherLengths) {
  const std::string error = error_of([] {
    odometry_from_json(R"({"gyro_bias_over_time": {"time_s": [1], "rad_s": [], "sigma_rad_s": [1]}})",
                       "o.json");
  });
  EXPECT_THAT(error, HasSubstr("\"gyro_bias_over_time.rad_s\" has 0 entries"));
}

TEST(OdometryResult, RefusesRestsThatDoNotEnd) {
  EXPECT_THAT(error_of([] { odometry_from_json(R"({"rests": [[1, 2], [3]]})", "o.json"); }),
              HasSubstr("\"rests[1]\" has 1 numbers"));
}

TEST(EvaluationSummary, MayLackWhatAnEarlierVersionDidNotWrite) {
  const EvaluationSummary summary =
      evaluation_from_json(R"({"alignment": {"kind": "none"}, "trajectories": []})", "evaluation.json");
  EXPECT_EQ(summary.alignment, Alignment::none);
  EXPECT_FALSE(summary.noise.stated());
}

TEST(GrowthResult, IsReadAsItWasWritten) {
  GrowthResult growth{.snapshots = {}, .moved_time_s = {1.0, 2.5}, .moved_m = {0.0, 0.25}};
  growth.snapshots.push_back(
      {.time_s = 2.5,
       .pose = {1.0, -2.0, 0.5},
       .covariance = Matrix2::Identity(),
       .path = {{0.0, 0.0}, {1.0, -2.0}},
       .landmarks = {{.name = "a", .position = {3.0, 4.0}, .covariance = Matrix2::Identity()}}});
  const Json document = to_json(growth);
  EXPECT_EQ(to_json(growth_from_json(document.dump(), "growth.json")), document);
}

TEST(GrowthResult, RefusesWhatIsNone) {
  GrowthResult growth;
  growth.snapshots.emplace_back().path = {{0.0, 0.0}};
  Json document = to_json(growth);
  const auto error = [&] { return error_of([&] { growth_from_json(document.dump(), "g.json"); }); };
  document["snapshots"][0]["path"]["y_m"] = Json::array();
  EXPECT_THAT(error(), HasSubstr("\"path.y_m\" has 0 entries"));
  document["snapshots"][0]["path"] = 3;
  EXPECT_THAT(error(), HasSubstr("\"snapshots[0].path\" is a number"));
  document.erase("snapshots");
  EXPECT_THAT(error(), HasSubstr("g.json"));
}

TEST(EvaluationSummary, IsReadAsItWasWritten) {
  for (const Alignment alignment : {Alignment::none, Alignment::start, Alignment::se2}) {
    const EvaluationSummary summary{.alignment = alignment,
                                    .noise = {.position_sigma_m = 0.1, .heading_sigma_rad = 0.2}};
    const Json document = to_json(summary);
    EXPECT_EQ(to_json(evaluation_from_json(document.dump(), "evaluation.json")), document);
  }
}

}  // namespace
}  // namespace trundle::report
