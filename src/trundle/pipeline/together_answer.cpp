#include "trundle/pipeline/together_answer.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/slam/consistency_checks.hpp"
#include "trundle/slam/models/metre.hpp"

namespace trundle::pipeline {
namespace {

/// Folders of results are called so.
std::vector<std::string> robot_names(const std::vector<TeamRobot>& team) {
  std::vector<std::string> names;
  for (const TeamRobot& one : team) {
    std::string name = one.recording.name;
    for (int n = 2; std::ranges::find(names, name) != names.end(); ++n)
      name = fmt::format("{}_{}", one.recording.name, n);
    names.push_back(std::move(name));
  }
  return names;
}

/// Which robot is seen under a name.
std::map<std::string, std::size_t> robots_by_name(const std::vector<TeamRobot>& team) {
  std::map<std::string, std::size_t> robots;
  for (std::size_t i = 0; i < team.size(); ++i) {
    const std::string& name = team[i].recording.seen_as;
    if (!name.empty() && !robots.try_emplace(name, i).second)
      throw InputError(team[i].recording.name,
                       fmt::format("is seen as '{}', and so is {}", name, team[robots[name]].recording.name),
                       "a name for each robot: 'seen_as' of recording.toml");
  }
  return robots;
}

/// A sighting of a robot by another, on the clocks of their odometries.
struct Meeting {
  double time_s = 0.0;       ///< of the seer
  double seen_time_s = 0.0;  ///< of the other: the same instant, where recordings count from other seconds
  std::size_t seer = 0;
  std::size_t seen = 0;
  double range_m = 0.0;
  double bearing_rad = 0.0;

  auto key() const { return std::tie(time_s, seer, seen, range_m, bearing_rad); }
};

const LandmarkSensor& sensor_of(const TeamRobot& one) {
  if (!one.robot.robot.landmark_sensor)
    throw InputError(place_of(one.robot.robot), "has no landmark sensor", "[landmark_sensor]");
  return *one.robot.robot.landmark_sensor;
}

/// From the start of the stamps of one to that of another's [s].
double seconds_between(const Recording& one, const Recording& other) {
  return static_cast<double>(other.time_origin_s - one.time_origin_s);
}

/// What is seen of the team's robots, taken out of its recordings: what is left there is of landmarks.
std::vector<Meeting> take_meetings(std::vector<TeamRobot>& team) {
  const std::map<std::string, std::size_t> robots = robots_by_name(team);
  std::vector<Meeting> meetings;
  for (std::size_t i = 0; i < team.size(); ++i) {
    Recording& recording = team[i].recording;
    const double offset_s = sensor_of(team[i]).time_offset_s;
    const auto since = [&](std::size_t robot) { return seconds_between(team[robot].recording, recording); };
    const auto take = [&](const Sighting& sighting) {
      const auto robot = robots.find(sighting.landmark);
      if (robot == robots.end()) return false;
      if (robot->second != i)
        meetings.push_back({sighting.time_s + offset_s, sighting.time_s + offset_s + since(robot->second), i,
                            robot->second, sighting.range_m, sighting.bearing_rad});
      return true;
    };
    std::erase_if(recording.sightings, take);
    const std::size_t before = recording.robot_sightings.size();
    std::erase_if(recording.robot_sightings, take);
    std::erase_if(recording.findings,
                  [&](const Finding& finding) { return finding.code == FindingCode::sighting_of_a_robot; });
    if (const std::size_t left = recording.robot_sightings.size(); left > 0 && before > 0)
      recording.findings.push_back({Severity::note, FindingCode::sighting_of_a_robot, recording.name, left});
  }
  std::ranges::sort(meetings, {}, &Meeting::key);
  const auto are_same = [](const Meeting& a, const Meeting& b) { return a.key() == b.key(); };
  meetings.erase(std::unique(meetings.begin(), meetings.end(), are_same), meetings.end());
  return meetings;
}

std::vector<std::string> landmark_names_in(const std::vector<TeamRobot>& team) {
  std::vector<std::string> names;
  std::set<std::string> known;
  for (const TeamRobot& one : team)
    for (const Sighting& sighting : one.recording.sightings)
      if (!sighting.landmark.empty() && known.insert(sighting.landmark).second)
        names.push_back(sighting.landmark);
  return names;
}

std::vector<double> stamps_of(const std::vector<Meeting>& meetings, std::size_t robot) {
  std::set<double> stamps;
  for (const Meeting& meeting : meetings) {
    if (meeting.seer == robot) stamps.insert(meeting.time_s);
    if (meeting.seen == robot) stamps.insert(meeting.seen_time_s);
  }
  return {stamps.begin(), stamps.end()};
}

/// A robot alone.
struct Alone {
  SlamInput input;
  ShownObservations shown;
  Trajectory path;
  Systematic systematic = {};
  std::vector<Finding> inconsistencies = {};
  std::optional<GrowthResult> growth = {};
};

/// Without landmarks: where its odometry takes it.
Alone by_odometry(SlamInput input) {
  Alone alone{.input = std::move(input), .shown = {}, .path = {}};
  Pose2 pose;
  for (SlamStep& step : alone.input.steps) {
    pose = pose * step.motion.mean;
    alone.path.poses.push_back({step.time_s, pose});
    alone.shown.push_back(step.observations);
  }
  return alone;
}

Alone alone(const TeamRobot& one, const SlamQuestion& question) {
  SlamAnswer answer = begun_slam(one.recording, one.robot, question);
  if (answer.input.steps.empty())
    throw CannotAnswer(fmt::format("{}: its odometry does not run", one.recording.name));
  if (answer.input.observations() > 0)
    answer = finished_slam(one.recording, one.robot, question, std::move(answer));
  if (!answer.smoothed) return by_odometry(std::move(answer.input));
  std::optional<GrowthResult> growth = growth_of(answer);
  return {.input = std::move(answer.input),
          .shown = std::move(answer.smoothed->shown),
          .path = std::move(answer.smoothed->trajectory),
          .systematic = answer.smoothed->last.systematic,
          .inconsistencies = std::move(answer.inconsistencies),
          .growth = std::move(growth)};
}

/// What grew in a frame that lies there, by a clock that begins so much later.
GrowthResult begun_at(GrowthResult growth, const Pose2& by, double since_s) {
  growth = placed(std::move(growth), by);
  for (GrowthSnapshot& snapshot : growth.snapshots) snapshot.time_s += since_s;
  for (double& time_s : growth.moved_time_s) time_s += since_s;
  return growth;
}

/// As well as its sensor's ranges are known in proportion, without a calibration as they come.
double metre_sigma_of(const Robot& robot) {
  return metre_sigma(robot).value_or(prior_sigma(kRangeScale, robot));
}

/// 1σ of what all metres are off by in common, where a calibration speaks of any. docs/theory/together.md,
/// eq. 27b.
double metre_sigma_in_common(const std::vector<TeamRobot>& team) {
  if (std::ranges::none_of(team,
                           [](const TeamRobot& one) { return metre_sigma(one.robot.robot).has_value(); }))
    return 0.0;
  double information = 0.0;
  for (const TeamRobot& one : team) information += 1.0 / squared(metre_sigma_of(one.robot.robot));
  return 1.0 / std::sqrt(information);
}

void add_metre(const Metre& metre, JointSlam& joint) {
  for (RobotEstimate& robot : joint.robots) {
    metre.add_to(robot.trajectory);
    metre.add_to(robot.last);
  }
}

/// The step at a stamp that the odometry was cut at.
std::optional<std::size_t> step_at(const SlamInput& input, double time_s) {
  const auto at = std::ranges::lower_bound(input.steps, time_s, {}, &SlamStep::time_s);
  if (at == input.steps.end() || at->time_s != time_s) return std::nullopt;
  return static_cast<std::size_t>(at - input.steps.begin());
}

std::vector<RobotSighting> sightings_of_robots(const std::vector<Meeting>& meetings,
                                               const std::vector<TeamRobot>& team,
                                               const std::vector<Alone>& robots,
                                               std::vector<Finding>& findings) {
  std::vector<RobotSighting> seen;
  std::size_t outside = 0;
  for (const Meeting& meeting : meetings) {
    const auto seer_step = step_at(robots[meeting.seer].input, meeting.time_s);
    const auto seen_step = step_at(robots[meeting.seen].input, meeting.seen_time_s);
    const Observation observation =
        observation_of(sensor_of(team[meeting.seer]), kUnknownLandmark, meeting.range_m, meeting.bearing_rad);
    if (!seer_step || !seen_step)
      ++outside;
    else if (is_valid(observation))
      seen.push_back({meeting.seer, *seer_step, meeting.seen, *seen_step, observation});
  }
  if (outside > 0)
    findings.push_back(
        {Severity::note, FindingCode::sighting_without_odometry, "sightings of robots", outside});
  return seen;
}

std::vector<GrowthResult> growth_together(const std::vector<TeamRobot>& team,
                                          const std::vector<Alone>& robots,
                                          const std::vector<RobotRecording>& recordings,
                                          const JointSlam& joint) {
  std::vector<GrowthResult> all;
  for (std::size_t i = 0; i < team.size(); ++i) {
    if (!robots[i].growth) continue;
    const Pose2 by =
        joint.robots[i].trajectory.poses.front().pose * recordings[i].path.poses.front().pose.inverse();
    all.push_back(begun_at(*robots[i].growth, by, seconds_between(team[0].recording, team[i].recording)));
  }
  return all;
}

}  // namespace

TogetherAnswer answer_together(std::vector<TeamRobot> team, const SlamQuestion& question) {
  TogetherAnswer answer{.provenance = {{}, {{"together", "true"}}, question.seed}};
  add_options_of(question, answer.provenance);
  if (question.marker_sigma_m > 0.0)
    answer.provenance.options.emplace_back("marker-sigma", fmt::format("{}", question.marker_sigma_m));
  for (const TeamRobot& one : team) add_inputs(one.recording.inputs, answer.provenance);
  for (const TeamRobot& one : team) add_inputs({one.robot.file}, answer.provenance);
  answer.names = robot_names(team);
  const std::vector<Meeting> meetings = take_meetings(team);
  SlamQuestion of_one = question;
  of_one.smooth = true;
  of_one.names = landmark_names_in(team);
  const auto named = static_cast<LandmarkId>(of_one.names.size());
  LandmarkId next = named;
  std::vector<Alone> robots;
  for (std::size_t i = 0; i < team.size(); ++i) {
    of_one.also_at_s = stamps_of(meetings, i);
    robots.push_back(alone(team[i], of_one));
    if (robots.back().growth) robots.back().growth->robot = answer.names[i];
    number_unidentified(named, next, robots.back().shown);
    for (Finding& finding : robots.back().input.findings) {
      finding.place = answer.names[i] + ": " + finding.place;
      answer.findings.push_back(std::move(finding));
    }
    for (Finding& finding : robots.back().inconsistencies) {
      finding.place = answer.names[i] + ": " + finding.place;
      answer.inconsistencies.push_back(std::move(finding));
    }
  }
  answer.landmarks = landmark_names(of_one.names, next - 1);
  const std::vector<RobotSighting> seen = sightings_of_robots(meetings, team, robots, answer.findings);
  std::optional<Vector3> shares = kUsualShareSigma;
  if (question.systematic_sigma) shares = Vector3::Constant(*question.systematic_sigma);
  std::vector<RobotRecording> recordings;
  for (std::size_t i = 0; i < team.size(); ++i) {
    const SystematicErrors& systematic = robots[i].input.systematic;
    recordings.push_back({.input = robots[i].input,
                          .sensor = sensor_of(team[i]),
                          .prior = {.start = question.start, .systematic_sigma = systematic.sigma(shares)},
                          .name = answer.names[i],
                          .shown = std::move(robots[i].shown),
                          .path = std::move(robots[i].path),
                          .systematic = robots[i].systematic,
                          .metre_sigma = metre_sigma_of(team[i].robot.robot),
                          .marker_sigma_m = question.marker_sigma_m,
                          .marker_on_body = team[i].robot.robot.marker_on_body});
    answer.systematic.push_back(systematic);
    const auto& gyro = team[i].robot.robot.chassis.gyro;
    answer.gyro_bias_rad_s.push_back(gyro ? gyro->bias_rad_s : 0.0);
  }
  answer.joint = smooth_together(recordings, seen);
  answer.growth = growth_together(team, robots, recordings, answer.joint);
  for (Finding& finding : consistency_checks(answer.joint.counts)) {
    finding.place = "all robots";
    answer.inconsistencies.push_back(std::move(finding));
  }
  answer.metre_sigma = metre_sigma_in_common(team);
  add_metre({answer.metre_sigma, question.start.translation()}, answer.joint);
  for (std::size_t i = 0; i < team.size(); ++i)
    require_sound(answer.joint.robots[i].trajectory, answer.names[i]);
  require_sound(answer.joint.map, "the map of all robots");
  return answer;
}

}  // namespace trundle::pipeline
