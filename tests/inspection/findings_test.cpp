#include "trundle/inspection/findings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include <gmock/gmock.h>

#include "trundle/simulation/scenario.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
namespace {

using test::finding;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

Robot robot_with_gyro(double time_offset_s) {
  return test::with_gyro(test::two_wheels(), {.noise_rad_s_sqrt_hz = 3e-4, .time_offset_s = time_offset_s});
}

Recording tour(const Robot& truth) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  Random random(1, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.seed = 1;
  return simulate(scenario).recording;
}

TEST(Findings, a_gyro_whose_stamps_are_late_is_found_and_named) {
  const Recording recording = tour(robot_with_gyro(-0.04));
  const Robot robot = robot_with_gyro(0.0);
  const Findings findings = find_in(recording, &robot);
  EXPECT_TRUE(findings.compares_clocks);
  ASSERT_TRUE(findings.gyro_time_offset);
  EXPECT_NEAR(findings.gyro_time_offset->offset_s, -0.04, 4.0 * findings.gyro_time_offset->sigma_s);
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::time_offset, "too late")));
  const Robot told = robot_with_gyro(-0.04);
  EXPECT_THAT(find_in(recording, &told).problems,
              Not(Contains(Field(&Finding::code, FindingCode::time_offset))));
}

// The tour never rests for as long as a rest takes: nothing else shows the bias.
TEST(Findings, a_bias_that_no_rest_would_be_recognised_by_is_named_with_its_value) {
  Robot truth = robot_with_gyro(0.0);
  truth.chassis.gyro->bias_rad_s = -0.12;
  truth.chassis.wheels()[0].diameter_m *= 1.03;  // turns by a share of the way, which is no bias
  const Recording recording = tour(truth);
  const Robot robot = robot_with_gyro(0.0);
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::gyro_bias, "write bias_rad_s = -0.1")));
  Robot vague = robot;
  vague.chassis.gyro->bias_sigma_rad_s = 0.1;
  Robot told = robot;
  told.chassis.gyro->bias_rad_s = -0.12;
  for (const Robot& right : {vague, told}) EXPECT_THAT(find_in(recording, &right).problems, IsEmpty());
}

/// Each wheel that stands still seems to be rolled by a bias.
TEST(Findings, a_wrong_bias_makes_no_encoder_seem_stuck) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot_with_gyro(0.0);
  scenario.path =
      joined({straight(3.0), turn_on_the_spot(2.0), pause(4.0), straight(3.0), turn_on_the_spot(-3.0),
              pause(4.0), straight(2.0), turn_on_the_spot(1.5), straight(2.0)});
  scenario.steering = Steering::truth;
  const Recording recording = simulate(scenario).recording;
  Robot robot = scenario.nominal;
  robot.chassis.gyro->bias_rad_s = 0.3;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::gyro_bias, "write bias_rad_s = ")));
}

/// One that is read wrongly may look biased, too.
TEST(Findings, a_gyro_in_rpm_turns_too_far_and_is_not_called_biased) {
  Robot truth = robot_with_gyro(0.0);
  truth.chassis.gyro->bias_rad_s = 0.02;
  Recording recording = tour(truth);
  for (double& rate : recording.gyro.yaw_rate_rad_s) rate *= 60.0 / (2.0 * kPi);
  const Robot robot = robot_with_gyro(0.0);
  EXPECT_THAT(find_in(recording, &robot).problems,
              Contains(finding(FindingCode::gyro_against_wheels, "times as far as the wheels")));
  EXPECT_THAT(find_in(recording, &robot).problems,
              Not(Contains(Field(&Finding::code, FindingCode::gyro_bias))));
}

/// Along the axis about which the robot turns there is a share of the turn, noise alone, or nothing.
TEST(Findings, a_gyro_that_hears_nothing_of_the_turns_is_named) {
  const Robot robot = robot_with_gyro(0.0);
  const Recording whole = tour(robot);
  Random random(4, 2);
  for (const auto& read : std::array<std::function<double(double)>, 3>{
           [](double rate) { return 0.01 * rate; }, [&](double) { return random.normal(0.003); },
           [](double) { return 0.0; }}) {
    Recording recording = whole;
    for (double& rate : recording.gyro.yaw_rate_rad_s) rate = read(rate);
    EXPECT_THAT(find_in(recording, &robot).problems,
                Contains(finding(FindingCode::gyro_against_wheels, "the axis of the gyro's column (up)")));
  }
}

/// Nothing else tells a wheel that counts backwards from a gyro that hears nothing; a dead encoder is told.
TEST(Findings, on_a_straight_drive_a_gyro_is_not_blamed_for_a_dead_encoder) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot_with_gyro(0.0);
  scenario.path = joined({pause(3.0), straight(8.0), pause(2.0), straight(-8.0)});
  scenario.steering = Steering::truth;
  const Recording recording = simulate(scenario).recording;
  const auto problems_where_left_is_times = [&](double factor) {
    Recording faulty = recording;
    for (double& count : faulty.wheels.series[0].value) count *= factor;
    return find_in(faulty, &scenario.nominal).problems;
  };
  const auto is_blamed = Field(&Finding::code, FindingCode::gyro_against_wheels);
  EXPECT_THAT(problems_where_left_is_times(0.0), Not(Contains(is_blamed)));
  EXPECT_THAT(problems_where_left_is_times(-1.0),
              Contains(finding(FindingCode::gyro_against_wheels, "the sign of each wheel")));
}

/// Wheels of one axle, rolling along it, would read alike in every motion.
TEST(Findings, wheels_that_no_motion_explains_are_named) {
  for (const bool has_gyro : {false, true}) {
    Robot robot = has_gyro ? robot_with_gyro(0.0) : test::two_wheels();
    Scenario scenario;
    scenario.nominal = scenario.truth = robot;
    for (int side = 0; side < 4; ++side)
      scenario.path = joined({scenario.path, straight(2.0), turn_on_the_spot(kPi / 2.0)});
    scenario.steering = Steering::truth;
    const Recording recording = simulate(scenario).recording;
    EXPECT_THAT(find_in(recording, &robot).problems, IsEmpty());
    for (Wheel& wheel : robot.chassis.wheels()) wheel.direction_rad = kPi / 2.0;
    EXPECT_THAT(find_in(recording, &robot).problems,
                Contains(finding(FindingCode::contrary_wheels, "check direction_deg")));
  }
}

/// Rounding of counts, a few of them a row, is no contradiction.
TEST(Findings, coarse_counts_are_no_contradiction) {
  for (const auto& [ticks, rate_hz] : {std::pair{20.0, 50.0}, {100.0, 100.0}, {2048.0, 1000.0}}) {
    Scenario scenario;
    scenario.nominal.chassis = mecanum({.diameter_m = 0.1, .ticks_per_revolution = ticks}, 0.3, 0.3);
    scenario.nominal.wheel_names = {"fl", "fr", "rl", "rr"};
    scenario.truth = scenario.nominal;
    scenario.path = joined({straight(3.0), turn_on_the_spot(3.0), straight(-2.0), turn_on_the_spot(-2.0)});
    scenario.encoders.rate_hz = rate_hz;
    scenario.steering = Steering::truth;
    EXPECT_THAT(find_in(simulate(scenario).recording, &scenario.nominal).problems,
                Not(Contains(Field(&Finding::code, FindingCode::contrary_wheels))))
        << ticks;
  }
}

/// Wheels that roll unevenly are no turn that the gyro should hear.
TEST(Findings, a_straight_drive_says_nothing_of_the_gyro) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scenario scenario;
    scenario.nominal = scenario.truth = robot_with_gyro(0.0);
    scenario.truth.chassis.wheels()[0].diameter_m *= 1.02;
    scenario.truth.chassis.gyro->bias_rad_s = 0.01;
    scenario.path = joined({pause(3.0), straight(8.0), pause(2.0), straight(-8.0)});
    scenario.steering = Steering::truth;
    scenario.seed = seed;
    EXPECT_THAT(find_in(simulate(scenario).recording, &scenario.nominal).problems, IsEmpty()) << seed;
  }
}

Recording parked_now_and_then(const Robot& truth) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  scenario.path = joined({pause(10.0), circle(0.5, 1.0, TurnSense::ccw), pause(10.0)});
  scenario.steering = Steering::truth;
  return simulate(scenario).recording;
}

TEST(Findings, a_gyro_louder_than_a_rest_is_recognised_by_is_named) {
  for (const double times : {1.0, 1.2, 6.0}) {
    Robot loud = robot_with_gyro(0.0);
    loud.chassis.gyro->noise_rad_s_sqrt_hz *= times;
    const Robot robot = robot_with_gyro(0.0);
    const auto is_named = Contains(finding(FindingCode::noise, "write noise_rad_s_sqrt_hz = 0.0018"));
    EXPECT_THAT(find_in(parked_now_and_then(loud), &robot).problems,
                times > 2.0 ? testing::Matcher<std::vector<Finding>>(is_named)
                            : testing::Matcher<std::vector<Finding>>(
                                  Not(Contains(Field(&Finding::code, FindingCode::noise)))))
        << times;
  }
}

/// A gyro slower than the wheels, whose readings between are interpolated, and a faster one.
TEST(Findings, a_louder_gyro_is_named_at_any_rate) {
  const Robot robot = robot_with_gyro(0.0);
  for (const double rate_hz : {10.0, 100.0})
    for (const double times : {1.0, 3.0}) {
      Recording recording = parked_now_and_then(robot);
      GyroStream& gyro = recording.gyro;
      gyro.yaw_rate_rad_s.clear();
      Random random(3, 4);
      const double end_s = gyro.time_s.back();
      gyro.time_s.clear();
      for (double time_s = 0.0; time_s < end_s; time_s += 1.0 / rate_hz) {
        gyro.time_s.push_back(time_s);
        gyro.yaw_rate_rad_s.push_back(random.normal(times * 3e-4 * std::sqrt(rate_hz)));
      }
      const auto is_noise = [](const Finding& finding) { return finding.code == FindingCode::noise; };
      EXPECT_EQ(std::ranges::any_of(find_in(recording, &robot).problems, is_noise), times > 2.0)
          << rate_hz << " Hz, " << times;
    }
}

/// A leg, and 0.4 s later a turn: seen by a wheel that counts backwards the leg is the turn.
Recording legs_and_turns(const Robot& robot) {
  const Pace pace{.forward_m_s = 0.3, .turn_rad_s = 1.2, .rest_s = 0.0};
  std::vector<Path> pieces;
  for (int n = 0; n < 25; ++n) {
    pieces.push_back(pause(1.0 + 0.13 * (n % 7)));
    pieces.push_back(straight(0.12, pace));
    pieces.push_back(turn_on_the_spot(0.48, pace));
  }
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  for (const Path& piece : pieces) std::ranges::copy(piece, std::back_inserter(scenario.path));
  scenario.steering = Steering::truth;
  scenario.reference.rate_hz = 10.0;
  return simulate(scenario).recording;
}

/// What a wheel that counts backwards makes of the motion is no measure of clocks, lengths and landmarks.
TEST(Findings, a_wheel_that_counts_backwards_is_the_only_fault) {
  const Robot robot = robot_with_gyro(0.0);
  const Recording recording = legs_and_turns(robot);
  EXPECT_THAT(find_in(recording, &robot).problems, IsEmpty());
  Robot reversed = robot;
  reversed.chassis.wheels()[0].ticks_per_revolution *= -1.0;
  const Findings findings = find_in(recording, &reversed);
  EXPECT_THAT(findings.problems, ElementsAre(finding(FindingCode::reversed_counter, "counts backwards")));
  EXPECT_FALSE(findings.gyro_time_offset);
  EXPECT_FALSE(findings.reference_time_offset);
}

/// Curves of one sense, by which a wheel that counts backwards passes for wheels of another size.
TEST(Findings, a_wheel_that_counts_backwards_is_told_from_a_size) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot_with_gyro(0.0);
  scenario.path = joined({pause(2.0), circle(1.0, 0.5, TurnSense::ccw), straight(1.0),
                          circle(0.5, 1.0, TurnSense::ccw), straight(1.0)});
  const Recording recording = simulate(scenario).recording;
  for (const std::size_t wheel : {0U, 1U}) {
    Robot reversed = scenario.nominal;
    reversed.chassis.wheels()[wheel].ticks_per_revolution *= -1.0;
    EXPECT_THAT(find_in(recording, &reversed).problems,
                ElementsAre(finding(FindingCode::reversed_counter, "counts backwards")));
  }
  Robot geared = scenario.nominal;
  for (Wheel& wheel : geared.chassis.wheels()) wheel.ticks_per_revolution *= 4.0;
  EXPECT_THAT(find_in(recording, &geared).problems,
              ElementsAre(finding(FindingCode::gyro_against_wheels, "times as far as the wheels")));
}

TEST(Findings, wheels_in_one_place_are_named) {
  Robot robot = robot_with_gyro(0.0);
  const Recording recording = tour(robot);
  const auto is_named = Contains(finding(FindingCode::geometry, "stand in one place"));
  EXPECT_THAT(find_in(recording, &robot).problems, Not(is_named));
  for (Wheel& wheel : robot.chassis.wheels()) wheel.y_m = 0.0;
  EXPECT_THAT(find_in(recording, &robot).problems, is_named);
}

TEST(Findings, fixed_wheels_whose_axles_cross_are_named) {
  const auto is_named = Contains(finding(FindingCode::geometry, "roll in directions"));
  Robot robot;
  robot.name = "omni";
  robot.wheel_names = {"a", "b", "c"};
  robot.chassis = omni3({0.06, 1000.0, 0}, 0.2);
  const Recording none;
  EXPECT_THAT(find_in(none, &robot).problems, Not(is_named));
  for (Wheel& wheel : robot.chassis.wheels()) wheel.kind = WheelKind::fixed;
  EXPECT_THAT(find_in(none, &robot).problems, is_named);
  // A differential drive's wheels, one of which is turned round, a little out of line.
  robot = robot_with_gyro(0.0);
  robot.chassis.wheels()[1].direction_rad = radians(172.0);
  EXPECT_THAT(find_in(none, &robot).problems, Not(is_named));
}

TEST(Findings, what_no_sensor_on_board_can_see_is_said) {
  const Robot robot = robot_with_gyro(0.0);
  const Findings findings = find_in(tour(robot), &robot);
  ASSERT_TRUE(findings.abilities);
  EXPECT_THAT(findings.abilities->cannot, Contains(HasSubstr("all wheels slipping together")));
}

TEST(Findings, the_track_on_the_ground_where_wheels_scrub) {
  Robot robot;
  robot.name = "skid-steer";
  robot.chassis = skid_steer({.diameter_m = 0.2, .ticks_per_revolution = 4000.0}, 0.9, 0.4);
  robot.chassis.gyro = Gyro{};
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  const Findings findings = find_in(tour(robot), &robot);
  ASSERT_THAT(findings.tracks, Not(IsEmpty()));
  EXPECT_NEAR(findings.tracks.front().track_m, 0.9, 4.0 * findings.tracks.front().sigma_m);
}

TEST(Findings, a_recording_that_does_not_suit_the_robot_says_what_is_missing) {
  Robot robot = robot_with_gyro(0.0);
  const Recording recording = tour(robot);
  robot.wheel_names = {"front", "rear"};
  const Findings findings = find_in(recording, &robot);
  EXPECT_THAT(findings.missing, Contains(HasSubstr("the wheel 'front'")));
  EXPECT_FALSE(findings.gyro_time_offset);
}

TEST(Findings, without_a_robot_nothing_is_compared) {
  const Findings findings = find_in(tour(robot_with_gyro(-0.04)));
  EXPECT_FALSE(findings.abilities);
  EXPECT_FALSE(findings.compares_clocks);
  EXPECT_THAT(findings.streams, Contains(Field(&StreamSummary::stream, "gyro")));
}

Recording tour_with_reference(const Robot& truth, std::uint64_t seed = 1) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  Random random(seed, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.reference.rate_hz = 10.0;
  scenario.seed = seed;
  return simulate(scenario).recording;
}

TEST(Findings, a_gyro_in_degrees_is_one_fault_even_beyond_its_limit) {
  Robot robot = robot_with_gyro(0.0);
  robot.chassis.gyro->max_rate_rad_s = 8.7;
  Recording recording = tour(robot_with_gyro(0.0));
  for (double& rate : recording.gyro.yaw_rate_rad_s) rate *= 180.0 / kPi;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::gyro_unit, "write unit = \"deg/s\"")));
  for (double& rate : recording.gyro.yaw_rate_rad_s) rate *= kPi / 180.0 * kPi / 180.0;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::gyro_unit, "leave out unit")));
}

TEST(Findings, a_reference_in_degrees_is_named) {
  const Robot robot = test::two_wheels();
  Recording recording = tour_with_reference(robot);
  EXPECT_THAT(find_in(recording, &robot).problems, IsEmpty());
  for (double& heading : recording.reference.heading_rad) heading *= 180.0 / kPi;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::reference_unit, "write unit = \"deg\"")));
  for (double& heading : recording.reference.heading_rad) heading *= kPi / 180.0 * kPi / 180.0;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::reference_unit, "leave out unit")));
}

TEST(Findings, a_reference_whose_stamps_are_in_another_unit_is_named) {
  const Robot robot = test::two_wheels();
  Recording recording = tour_with_reference(robot);
  for (double& stamp : recording.reference.time_s) stamp *= 1e3;
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::time_unit, "time_unit = \"ms\"")));
}

/// The counts of each row since the one before.
Recording with_differences(Recording recording) {
  for (WheelSeries& series : recording.wheels.series)
    for (std::size_t row = series.value.size(); row-- > 0;)
      series.value[row] = row == 0 ? 0.0 : series.value[row] - series.value[row - 1];
  return recording;
}

TEST(Findings, counts_that_agree_with_nothing_but_read_otherwise_are_named) {
  for (const bool has_gyro : {true, false}) {
    const Robot robot = has_gyro ? robot_with_gyro(0.0) : test::two_wheels();
    const Recording counters = tour_with_reference(robot);
    EXPECT_THAT(find_in(counters, &robot).problems, IsEmpty());
    EXPECT_THAT(find_in(with_differences(counters), &robot).problems,
                ElementsAre(finding(FindingCode::increments, "write increments = true")));
    Recording summed = counters;  // as recording.toml's increments = true has it, of counters
    for (WheelSeries& series : summed.wheels.series)
      std::partial_sum(series.value.begin(), series.value.end(), series.value.begin());
    EXPECT_THAT(find_in(summed, &robot).problems,
                ElementsAre(finding(FindingCode::not_increments, "leave out increments = true")));
  }
}

/// Without another fault: who turns right is not told of degrees.
TEST(Findings, a_reference_in_another_unit_of_length_is_named) {
  const Robot robot = test::two_wheels();
  const std::pair<double, const char*> units[] = {
      {1e3, "(unit = \"mm\""}, {1e2, "(unit = \"cm\""}, {1.0 / 0.0254, "(unit = \"in\""}};
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    for (const auto& [factor, advice] : units)
      for (const bool has_headings : {true, false}) {
        Recording recording = tour_with_reference(robot, seed);
        for (auto* column : {&recording.reference.x_m, &recording.reference.y_m})
          for (double& place : *column) place *= factor;
        if (!has_headings) std::ranges::fill(recording.reference.heading_rad, kNotMeasured);
        EXPECT_THAT(find_in(recording, &robot).problems,
                    ElementsAre(finding(FindingCode::reference_unit, advice)))
            << factor << has_headings << seed;
      }
}

/// Neither hides the other.
TEST(Findings, a_reference_in_millimetres_and_a_wheel_that_counts_backwards_are_named_both) {
  for (const Robot& robot : {test::two_wheels(), robot_with_gyro(0.0)})
    for (const bool has_headings : {true, false}) {
      if (!has_headings && !robot.chassis.gyro) continue;  // positions alone do not show which wheel
      Recording recording = tour_with_reference(robot);
      for (auto* column : {&recording.reference.x_m, &recording.reference.y_m})
        for (double& place : *column) place *= 1e3;
      if (!has_headings) std::ranges::fill(recording.reference.heading_rad, kNotMeasured);
      for (double& count : recording.wheels.series[1].value) count *= -1.0;
      EXPECT_THAT(find_in(recording, &robot).problems,
                  ElementsAre(finding(FindingCode::reference_unit, "(unit = \"mm\""),
                              finding(FindingCode::reversed_counter, "'right' counts backwards")))
          << has_headings;
    }
}

TEST(Findings, wheels_that_are_far_off_by_the_reference_are_named) {
  const Recording recording = tour_with_reference(test::two_wheels());
  Robot robot = test::two_wheels();
  for (Wheel& wheel : robot.chassis.wheel_storage) wheel.ticks_per_revolution *= 4.0;
  EXPECT_THAT(find_in(recording, &robot).problems,
              Contains(finding(FindingCode::scale, "times as far as the wheels")));
}

TEST(Findings, streams_that_never_ran_together_are_named) {
  Recording recording = tour(robot_with_gyro(0.0));
  for (double& time : recording.gyro.time_s) time += 1.7e9;
  const Robot robot = robot_with_gyro(0.0);
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::clocks, "never at the same time")));
}

TEST(Findings, a_column_of_no_wheel_is_named_where_recording_toml_asks_for_it) {
  const Robot robot = test::two_wheels();
  Recording recording = tour(robot_with_gyro(0.0));
  recording.wheels.series.push_back(recording.wheels.series.front());
  recording.wheels.series.back().wheel = "rigth";
  EXPECT_THAT(find_in(recording, &robot).problems, IsEmpty());
  recording.inputs.push_back({"tour/recording.toml", ""});
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::unknown_wheel, "is 'right' meant?")));
}

TEST(Findings, angles_of_a_wheel_that_is_not_steered_are_named) {
  Robot robot = test::two_wheels();
  Recording recording = tour(robot_with_gyro(0.0));
  WheelSeries angles = recording.wheels.series.front();
  angles.unit = recording::WheelUnit::radians;
  std::ranges::fill(angles.value, 0.1);
  recording.wheels.steering.push_back(angles);
  EXPECT_THAT(find_in(recording, &robot).problems,
              ElementsAre(finding(FindingCode::unused_steering, "left_steering_rad is not used")));
  robot.chassis.wheels().front().steering = SteeringSensor{};
  EXPECT_THAT(find_in(recording, &robot).problems,
              Not(Contains(finding(FindingCode::unused_steering, "not used"))));
}

Finding gap_at(const std::string& place) {
  return {.code = FindingCode::gap,
          .place = place,
          .count = 2,
          .payload = payload::Excess{.farthest = 2.0, .limit = 0.5}};
}

TEST(Findings, of_a_kind_the_first_twenty_are_listed_and_the_rest_counted) {
  Recording recording = tour(robot_with_gyro(0.0));
  const Finding one = gap_at("a.csv:3");
  recording.findings = {one, one};
  EXPECT_THAT(find_in(recording).problems, ElementsAre(finding(FindingCode::gap, "2 gaps longer than")));
  for (int i = 0; i < 26; ++i) recording.findings.push_back(gap_at("a.csv:" + std::to_string(10 + i)));
  const std::vector<Finding> folded = find_in(recording).problems;
  ASSERT_THAT(folded, SizeIs(21));
  EXPECT_EQ(folded.front().place, "a.csv:3");
  EXPECT_THAT(folded.back(), finding(FindingCode::gap, "and 7 more places of this kind"));
  EXPECT_EQ(folded.back().place, "a.csv:29");
  recording.findings = {one, gap_at("b.csv:3"), gap_at("c.csv")};
  EXPECT_THAT(find_in(recording).problems, SizeIs(3)) << "of several files";
}

}  // namespace
}  // namespace trundle::inspection
