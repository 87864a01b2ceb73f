// Reading by reading, the same numbers as from the whole recording at once.
#include "trundle/pipeline/live.hpp"

#include <chrono>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/slip_answer.hpp"

#include "kobuki.hpp"
#include "real_data.hpp"
#include "recording/folder.hpp"

namespace trundle::pipeline {
namespace {

const std::filesystem::path kDemo = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";

constexpr std::array<const char*, 4> kEndings = {"_ticks", "_rad", "_m", "_rad_s"};

/// What a robot would have said while it recorded: each reading at its stamp.
std::vector<LiveLine> lines_of(const Recording& recording) {
  std::vector<LiveLine> lines;
  for (std::size_t row = 0; row < recording.wheels.time_s.size(); ++row) {
    LiveLine& line = lines.emplace_back();
    line.time_s = recording.wheels.time_s[row];
    for (const WheelSeries& series : recording.wheels.series)
      line.wheels.emplace_back(series.wheel + kEndings[static_cast<std::size_t>(series.unit)],
                               series.value[row]);
  }
  for (std::size_t row = 0; row < recording.gyro.time_s.size(); ++row) {
    LiveLine& line = lines.emplace_back();
    line.time_s = recording.gyro.time_s[row];
    line.yaw_rate_rad_s = recording.gyro.yaw_rate_rad_s[row];
  }
  for (const Sighting& sighting : recording.sightings) {
    if (lines.back().sightings.empty() || lines.back().time_s != sighting.time_s)
      lines.emplace_back().time_s = sighting.time_s;
    lines.back().sightings.push_back(sighting);
  }
  std::ranges::stable_sort(lines, {}, &LiveLine::time_s);
  return lines;
}

std::vector<LiveEstimate> estimates_of(const std::vector<LiveLine>& lines, LiveOdometer& odometer) {
  std::vector<LiveEstimate> estimates;
  for (const LiveLine& line : lines) odometer.take(line, "test", estimates);
  odometer.finish(estimates);
  return estimates;
}

std::string row_of(double time_s, const Pose2& pose, const Matrix3& P) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{}", time_s, pose.x, pose.y, pose.heading, P(0, 0), P(0, 1),
                     P(0, 2), P(1, 1), P(1, 2), P(2, 2));
}

std::string row_of(const Trajectory& trajectory, std::size_t i) {
  return row_of(trajectory.poses[i].time_s, trajectory.poses[i].pose, trajectory.covariances[i]);
}

void expect_same(const std::vector<LiveEstimate>& live, const Trajectory& offline) {
  ASSERT_EQ(live.size(), offline.poses.size());
  for (std::size_t i = 0; i < live.size(); ++i)
    ASSERT_EQ(row_of(live[i].time_s, live[i].pose, live[i].covariance), row_of(offline, i)) << "row " << i;
}

std::vector<std::string> told(const std::vector<SlipEvent>& events) {
  std::vector<std::string> lines;
  for (const SlipEvent& e : events)
    lines.push_back(fmt::format("{} {} {} {} {}", e.start_s, e.end_s, e.wheel, e.excess_m, e.confidence));
  return lines;
}

/// Where an interval is decided, the pose is that of the corrected trajectory; and so are the slips, but for
/// one that lasts to the end.
void expect_same(const std::vector<LiveEstimate>& live, const SlipAnswer& offline, const Recording& recording,
                 const Robot& robot) {
  const Trajectory corrected = corrected_odometry(recording, offline, robot).trajectory;
  ASSERT_EQ(live.size(), corrected.poses.size());
  std::vector<SlipEvent> events;
  std::size_t decided = 0;
  for (std::size_t i = 0; i < live.size(); ++i) {
    const LiveSlip& slip = *live[i].slip;
    if (!slip.verdict) continue;
    ++decided;
    ASSERT_EQ(row_of(live[i].time_s, slip.pose, slip.covariance), row_of(corrected, i)) << i;
    for (std::size_t k = 0; k < slip.verdict->ended_count; ++k) events.push_back(slip.verdict->ended[k]);
  }
  EXPECT_GT(decided, offline.report.counts.judged);
  std::vector<SlipEvent> expected = offline.report.events;
  if (events.size() + 1 == expected.size()) expected.pop_back();
  EXPECT_EQ(told(events), told(expected));
}

RobotFile in_memory(Robot robot) {
  return {std::move(robot), {}};
}

void expect_live_is_offline(const Recording& recording, const RobotFile& robot) {
  LiveOdometer odometer(robot.robot, {});
  const std::vector<LiveEstimate> live = estimates_of(lines_of(recording), odometer);
  expect_same(live, answer_odometry(recording, robot, {}).odometry.trajectory);
  if (live.front().slip) expect_same(live, answer_slip(recording, robot, {}), recording, robot.robot);
}

TEST(Live, GivesTheOdometryAndTheSlipsOfTheWholeRecording) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  for (const char* name : {"slip", "session_01/tour", "session_02/square_cw_01"}) {
    SCOPED_TRACE(name);
    expect_live_is_offline(read_recording(kDemo / name), robot);
  }
}

/// The robot as one whose wheels scrub.
RobotFile scrubbing(RobotFile file) {
  for (Wheel& wheel : file.robot.chassis.wheels()) wheel.kind = WheelKind::skid;
  file.robot.chassis.scrub = 0.1;
  return file;
}

/// The robot on tyres that grow.
RobotFile growing(RobotFile file) {
  file.robot.chassis.tyre_growth_s2_m2 = 0.5;
  return file;
}

TEST(Live, GivesThemOfWheelsThatScrubOrGrow) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  expect_live_is_offline(read_recording(kDemo / "slip"), scrubbing(robot));
  expect_live_is_offline(read_recording(kDemo / "slip"), growing(robot));
}

SlamAnswer offline_slam(const Recording& recording, const RobotFile& robot, bool unknown_ids = false) {
  return answer_slam(
      recording, robot,
      {.method = SlamMethod::smoother, .window_s = LiveSlamOptions{}.window_s, .unknown_ids = unknown_ids});
}

void expect_same(const std::vector<LiveSighted>& live, const SlamAnswer& offline) {
  std::size_t next = 0;
  for (std::size_t k = 0; k < offline.input.steps.size(); ++k) {
    const auto& reports = offline.result.reports[k].observations;
    if (reports.empty()) continue;
    ASSERT_LT(next, live.size());
    const LiveSighted& sighted = live[next++];
    ASSERT_EQ(row_of(sighted.time_s, sighted.slam.pose, sighted.slam.covariance),
              row_of(offline.result.online, k));
    ASSERT_EQ(sighted.sightings.size(), reports.size());
    for (std::size_t i = 0; i < reports.size(); ++i) {
      EXPECT_EQ(sighted.sightings[i].report.nis, reports[i].nis);
      EXPECT_EQ(sighted.sightings[i].report.decision, reports[i].decision);
    }
  }
  EXPECT_EQ(next, live.size());
}

/// A robot that says everything so much later than it was, and sightings later than the rest.
std::vector<LiveSighted> sighted_of(std::vector<LiveLine> lines, LiveOdometer& odometer,
                                    double late_s = 0.0) {
  const auto said_s = [&](const LiveLine& line) {
    return line.time_s + (line.sightings.empty() ? 0.0 : late_s);
  };
  std::ranges::stable_sort(lines,
                           [&](const LiveLine& a, const LiveLine& b) { return said_s(a) < said_s(b); });
  std::vector<LiveEstimate> estimates;
  std::vector<LiveSighted> all;
  const auto keep = [&] { std::ranges::move(odometer.take_sighted(), std::back_inserter(all)); };
  for (const LiveLine& line : lines) {
    odometer.take(line, "test", estimates);
    keep();
  }
  odometer.finish(estimates);
  keep();
  return all;
}

/// The robot as one whose sensor's ranges a calibration knows to 2 % in proportion.
RobotFile with_open_range_scale(RobotFile file) {
  file.robot.calibration.emplace().parameters = {{.name = "sensor.range_scale", .unit = "1"}};
  file.robot.calibration->covariance = Eigen::MatrixXd::Constant(1, 1, 4e-4);
  return file;
}

TEST(Live, GivesTheSmootherOfTheWholeRecording) {
  const RobotFile robot = with_open_range_scale(read_robot_file(kDemo / "robot.toml"));
  const Recording recording = read_recording(kDemo / "session_01/tour");
  for (const bool unknown_ids : {false, true}) {
    SCOPED_TRACE(unknown_ids);
    const SlamAnswer offline = offline_slam(recording, robot, unknown_ids);
    LiveOdometer odometer(robot.robot, {.slam = {.unknown_ids = unknown_ids}});
    expect_same(sighted_of(lines_of(recording), odometer), offline);
    const std::vector<LandmarkRow> expected = landmark_rows_of(offline);
    const std::vector<LandmarkRow> map = odometer.map();
    ASSERT_EQ(map.size(), expected.size());
    for (std::size_t i = 0; i < map.size(); ++i) {
      EXPECT_EQ(map[i].name, expected[i].name);
      EXPECT_EQ(map[i].position, expected[i].position);
      EXPECT_EQ(map[i].sightings, expected[i].sightings);
      EXPECT_EQ((*map[i].covariance)(0, 1), (*expected[i].covariance)(0, 1));
    }
  }
}

// Wheels, gyro and sightings of the tour have stamps in common: no order among them matters.
TEST(Live, SightingsOfOneStampMayComeBeforeTheRestOrAfterIt) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  const Recording recording = read_recording(kDemo / "session_01/tour");
  std::vector<LiveLine> lines = lines_of(recording);
  std::ranges::reverse(lines);
  LiveOdometer odometer(robot.robot, {});
  expect_same(sighted_of(lines, odometer), offline_slam(recording, robot));
}

TEST(Live, SightingsThatComeLateAreWaitedForAndAnyClockIsMinded) {
  RobotFile robot = read_robot_file(kDemo / "robot.toml");
  const Recording recording = read_recording(kDemo / "session_01/tour");
  for (const double clock_s : {-0.13, 0.0, 0.07}) {
    SCOPED_TRACE(clock_s);
    robot.robot.landmark_sensor->time_offset_s = clock_s;
    LiveOdometer odometer(robot.robot, {.slam = {.late_s = 0.25}});
    expect_same(sighted_of(lines_of(recording), odometer, 0.25), offline_slam(recording, robot));
  }
}

TEST(Live, SightingsThatComeTooLateAreRefusedAndNothingIsLost) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  LiveOdometer odometer(robot.robot, {});
  std::vector<LiveEstimate> estimates;
  const auto take = [&](const char* text) {
    odometer.take(parse_live_line(text, "here"), "here", estimates);
  };
  for (const char* line : {R"({"time_s": 1, "wheels": {"left_ticks": 0, "right_ticks": 0}, "gyro": 0})",
                           R"({"time_s": 1.1, "wheels": {"left_ticks": 9, "right_ticks": 9}, "gyro": 0})",
                           R"({"time_s": 1.2, "wheels": {"left_ticks": 9, "right_ticks": 9}, "gyro": 0,
            "sightings": [{"landmark": 7, "range_m": 1, "bearing_rad": 0}]})"})
    take(line);
  const std::string before = state_of(odometer);
  for (const char* wrong :
       {R"({"time_s": 1.15, "sightings": [{"range_m": 1, "bearing_rad": 0}]})",
        R"({"time_s": 1.2, "sightings": [{"range_m": 1, "bearing_rad": 0}]})",
        R"({"time_s": 1.3, "sightings": [{"range_m": 1}]})", R"({"time_s": 1.3, "sightings": [3]})",
        R"({"time_s": 1.3, "sightings": [{"landmark": 1.5, "range_m": 1, "bearing_rad": 0}]})",
        R"({"time_s": 1.3, "sightings": [{"range_m": 1, "bearing_rad": null}]})",
        R"({"time_s": 1.3, "sightings": {"range_m": 1}})", R"({"time_s": 1.3, "map": 1})"}) {
    EXPECT_THROW(take(wrong), InputError) << wrong;
    EXPECT_EQ(state_of(odometer), before) << wrong;
  }
  const std::vector<LiveSighted> sighted = odometer.take_sighted();
  ASSERT_EQ(sighted.size(), 1U);  // all of its line's stamp counts at once
  EXPECT_EQ(sighted[0].sightings[0].landmark, "7");
  ASSERT_TRUE(estimates.back().slam);
  EXPECT_EQ(estimates.back().slam->landmarks, 1U);
  EXPECT_EQ(odometer.map().size(), 1U);
}

TEST(Live, BetweenSightingsThePoseMovesOnWithTheWheels) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  LiveOdometer odometer(robot.robot, {});
  const std::vector<LiveEstimate> live =
      estimates_of(lines_of(read_recording(kDemo / "session_01/tour")), odometer);
  for (std::size_t i = 2; i < live.size(); ++i) {
    ASSERT_TRUE(live[i].slam);
    const Pose2 driven = live[i - 1].pose.inverse() * live[i].pose;
    const Pose2 moved = live[i - 1].slam->pose.inverse() * live[i].slam->pose;
    const Pose2 apart = driven.inverse() * moved;
    // What sightings correct is within what was not known.
    const double sigma_m = std::sqrt(live[i - 1].slam->covariance.topLeftCorner<2, 2>().trace());
    EXPECT_LT(std::hypot(apart.x, apart.y), 5.0 * sigma_m + 0.002) << live[i].time_s;
  }
}

TEST(Live, IncludesTheUncertaintyOfACalibration) {
  const test::Folder folder;
  Robot robot = read_robot_file(kDemo / "robot.toml").robot;
  robot.calibration.emplace();
  for (const char* name : {"left.diameter", "right.diameter"}) {
    CalibratedParameter& parameter = robot.calibration->parameters.emplace_back();
    parameter.name = name;
    parameter.observable = true;
  }
  robot.calibration->covariance = Eigen::Matrix2d::Identity() * 1e-6;
  expect_live_is_offline(read_recording(kDemo / "session_01/tour"), in_memory(robot));
}

TEST(Live, WithoutAGyroThereIsOdometryAlone) {
  RobotFile robot = read_robot_file(kDemo / "robot.toml");
  robot.robot.chassis.gyro.reset();
  Recording recording = read_recording(kDemo / "session_01/tour");
  expect_live_is_offline(recording, robot);
  LiveOdometer odometer(robot.robot, {});
  for (const LiveEstimate& estimate : estimates_of(lines_of(recording), odometer)) {
    EXPECT_FALSE(estimate.slip);
    EXPECT_FALSE(estimate.gyro_bias);
  }
}

TEST(Live, AGyroThatIsNeverHeardIsNotWaitedFor) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  Recording recording = read_recording(kDemo / "session_01/tour");
  recording.gyro = {};
  recording.sightings = {};
  LiveOdometer odometer(robot.robot, {});
  std::vector<LiveEstimate> estimates;
  const std::vector<LiveLine> lines = lines_of(recording);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    odometer.take(lines[i], "test", estimates);
    ASSERT_EQ(estimates.size(), i + 1);
  }
  expect_same(estimates, answer_odometry(recording, robot, {}).odometry.trajectory);
}

TEST(Live, AGyroThatFallsSilentIsWaitedForOnce) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  Recording recording = read_recording(kDemo / "session_01/tour");
  const double silent_s = 12.0;
  LiveOdometer odometer(robot.robot, {});
  std::vector<LiveEstimate> estimates;
  std::size_t wheels = 0;
  for (const LiveLine& line : lines_of(recording)) {
    if (line.yaw_rate_rad_s && line.time_s > silent_s) continue;
    wheels += line.wheels.empty() ? 0 : 1;
    odometer.take(line, "test", estimates);
    if (line.time_s < silent_s + 1.0) continue;
    ASSERT_EQ(estimates.size(), wheels) << line.time_s;
  }
}

TEST(Live, GapsAreBridgedAndCountersThatStartAnewAreNoTravel) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  const Recording recording = read_recording(kDemo / "session_01/tour");
  std::vector<LiveLine> lines = lines_of(recording);
  std::erase_if(lines, [](const LiveLine& line) { return line.time_s > 10.0 && line.time_s < 12.0; });
  for (LiveLine& line : lines)
    for (auto& [name, value] : line.wheels)
      if (line.time_s > 20.0) value = std::fmod(value + 20'000.0, 65'536.0);
  LiveOdometer odometer(robot.robot, {});
  const std::vector<LiveEstimate> estimates = estimates_of(lines, odometer);
  const Trajectory whole = answer_odometry(recording, robot, {}).odometry.trajectory;
  const Pose2 end = whole.poses.back().pose;
  EXPECT_LT(std::hypot(estimates.back().pose.x - end.x, estimates.back().pose.y - end.y), 0.5);
  EXPECT_GT(estimates.back().covariance(0, 0), whole.covariances.back()(0, 0));
}

void expect_goes_on_from_its_state(const RobotFile& robot) {
  const std::vector<LiveLine> lines = lines_of(read_recording(kDemo / "session_01/tour"));
  std::mt19937 random(1);
  std::vector<std::size_t> cuts(20);
  for (std::size_t& cut : cuts) cut = random() % lines.size();
  LiveOdometer whole(robot.robot, {});
  std::vector<LiveEstimate> all;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (std::ranges::count(cuts, i) > 0) {
      LiveOdometer resumed(robot.robot, {});
      resume_state(resumed, state_of(whole));
      ASSERT_EQ(state_of(resumed), state_of(whole)) << "line " << i;
      whole = resumed;
    }
    whole.take(lines[i], "test", all);
  }
  whole.finish(all);
  LiveOdometer uninterrupted(robot.robot, {});
  const std::vector<LiveEstimate> expected = estimates_of(lines, uninterrupted);
  ASSERT_EQ(all.size(), expected.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    ASSERT_EQ(line_of(all[i], robot.robot), line_of(expected[i], robot.robot)) << i;
}

TEST(Live, GoesOnFromItsStateAtAnyLine) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  expect_goes_on_from_its_state(robot);
  expect_goes_on_from_its_state(scrubbing(robot));
  expect_goes_on_from_its_state(growing(robot));
}

TEST(Live, WhatDoesNotSuitTheRobotIsLeftOut) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  LiveOdometer odometer(robot.robot, {});
  std::vector<LiveEstimate> estimates;
  const auto take = [&](const char* text) {
    odometer.take(parse_live_line(text, "here"), "here", estimates);
  };
  take(R"({"time_s": 1, "wheels": {"left_ticks": 0, "right_ticks": 0}, "gyro": 0})");
  const std::string before = state_of(odometer);
  for (const char* wrong :
       {R"({"time_s": 1, "wheels": {"left_ticks": 5, "right_ticks": 5}})",
        R"({"time_s": 2, "wheels": {"left_ticks": 5}})",
        R"({"time_s": 2, "wheels": {"left_m": 5, "right_m": 5}})", R"({"time_s": 0.5, "gyro": 0.1})",
        R"({"time_s": 2, "wheels": {"left_ticks": 1e308, "right_ticks": -1e308}})",
        R"({"time_s": 2, "wheels": {"left": 1e20, "right": 0}})", R"({"time_s": 2, "gyro": 1e300})",
        R"({"time_s": 2, "gyro": {"yaw_rate_rad_s": -1e10}})"}) {
    EXPECT_THROW(take(wrong), InputError) << wrong;
    EXPECT_EQ(state_of(odometer), before) << wrong;
  }
}

// Believed, it would make all that follow too early.
TEST(Live, AGarbledFirstStampCostsTwoLines) {
  const RobotFile robot = read_robot_file(kDemo / "robot.toml");
  std::vector<LiveLine> lines = lines_of(read_recording(kDemo / "slip"));
  lines.resize(200);
  const std::vector<LiveLine> without_two(lines.begin() + 2, lines.end());
  LiveOdometer sound(robot.robot, {});
  const std::vector<LiveEstimate> expected = estimates_of(without_two, sound);
  lines.front().time_s = 1e12;
  LiveOdometer odometer(robot.robot, {});
  std::vector<LiveEstimate> estimates;
  int refused = 0;
  for (const LiveLine& line : lines) {
    try {
      odometer.take(line, "here", estimates);
    } catch (const InputError&) {
      ++refused;
    }
  }
  odometer.finish(estimates);
  EXPECT_EQ(refused, 1);
  ASSERT_GE(estimates.size(), expected.size());
  estimates.erase(estimates.begin(), estimates.end() - static_cast<std::ptrdiff_t>(expected.size()));
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_EQ(line_of(estimates[i], robot.robot), line_of(expected[i], robot.robot)) << i;
}

TEST(Live, ALineOfAHundredThousandNamesTakesNoTimeWorthMention) {
  std::string line = R"({"time_s": 1, "wheels": {)";
  for (int i = 0; i < 100'000; ++i) line += fmt::format("\"w{}\": 1, ", i);
  line += R"("left_ticks": 1}})";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(parse_live_line(line, "here").wheels.size(), 100'001U);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));  // it was 35 s
}

TEST(Live, LinesOfAnyOtherFormAreRefused) {
  for (const char* wrong :
       {"", "nonsense", "[]", "3", "null", "{}", R"({"time_s": 1})", R"({"wheels": {"left_ticks": 1}})",
        R"({"time_s": "1", "gyro": 0})", R"({"time_s": 1, "wheels": [1, 2]})",
        R"({"time_s": 1, "wheels": {"left_ticks": null}})", R"({"time_s": 1, "gyro": {"rate": 1}})",
        R"({"time_s": 1e999, "gyro": 0})", R"({"time_s": 1, "gyro": NaN})", R"({"time_s": 1, "gyro": 1e999})",
        "{\"time_s\": 1, \"gyro\": 0", "{\"time_s\": 1, \"gyro\": \"\xff\"}"})
    EXPECT_THROW(parse_live_line(wrong, "here"), InputError) << wrong;
}

TEST(Live, StampsMayStandWithinWhatTheyBelongTo) {
  EXPECT_EQ(parse_live_line(R"({"wheels": {"time_s": 3, "left_ticks": 1}})", "here").time_s, 3.0);
  EXPECT_EQ(parse_live_line(R"({"wheels": {"time_s": 3, "left_ticks": 1}})", "here").wheels.size(), 1U);
  const LiveLine line = parse_live_line(R"({"gyro": {"time_s": 4, "yaw_rate_rad_s": 0.5}})", "here");
  EXPECT_EQ(line.time_s, 4.0);
  EXPECT_EQ(line.yaw_rate_rad_s, 0.5);
}

TEST(Live, KobukiWithAndWithoutTapeOnAWheel) {
  TRUNDLE_NEEDS_REAL_DATA("kobuki_slip");
  for (const char* name : {"nonfaulty", "left_faulty", "right_faulty"}) {
    SCOPED_TRACE(name);
    const test::Folder folder;
    folder.write(
        "recording.toml",
        fmt::format("time_origin = \"first\"\n[wheels]\nfile = \"{0}/core.csv\"\ntime_unit = \"ns\"\n"
                    "columns = {{ time_s = \"stamp_ns\", left_ticks = \"left_ticks\", "
                    "right_ticks = \"right_ticks\" }}\n[gyro]\nfile = \"{0}/imu.csv\"\n"
                    "time_unit = \"ns\"\ncolumns = {{ time_s = \"stamp_ns\", "
                    "yaw_rate_rad_s = \"gz_rads\" }}\n",
                    (test::real_data() / "kobuki_slip" / name).string()));
    expect_live_is_offline(read_recording(folder.path()), in_memory(test::kobuki()));
  }
}

}  // namespace
}  // namespace trundle::pipeline
