#include "trundle/pipeline/slam_answer.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/no_rest.hpp"
#include "trundle/pipeline/sensor_clock.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/slam/consistency_checks.hpp"
#include "trundle/slam/map_file.hpp"
#include "trundle/slam/models/metre.hpp"
#include "trundle/slam/smoothing/many_starts.hpp"

namespace trundle::pipeline {
namespace {

Provenance provenance_of(const Recording& recording, const RobotFile& robot, const SlamQuestion& question) {
  Provenance provenance{recording.inputs, {}, question.seed};
  provenance.inputs.push_back(robot.file);
  add_options_of(question, provenance);
  return provenance;
}

/// Landmarks that have no name are called 1, 2, ... in order of first sight, those removed since among them.
void name_unidentified(SlamAnswer& answer) {
  LandmarkId last = answer.result.last_landmark();
  for (const MappedLandmark& landmark : answer.map()) last = std::max(last, landmark.id);
  answer.input.landmarks = landmark_names(std::move(answer.input.landmarks), last);
}

/// All that a filter's run depends on besides the steps.
std::string settings_of(const RobotFile& robot, SlamQuestion question, const SlamInput& input) {
  question.smooth = false;
  std::string text = robot.file.sha256;
  for (const auto& [name, value] : provenance_of({}, robot, question).options)
    text += fmt::format("\n{}={}", name, value);
  if (input.has_unidentified()) text += fmt::format("\nnames={}", input.landmarks.size());
  return text + fmt::format("\nseed={}", question.seed);
}

/// To all that is said of where the robot was.
void add_metre(const Metre& metre, SlamAnswer& answer) {
  SlamResult& online = answer.result;
  metre.add_to(online.online);
  metre.add_to(online.last);
  for (Snapshot& snapshot : online.growth) metre.add_to(snapshot.pose, snapshot.covariance);
  if (!answer.smoothed) return;
  metre.add_to(answer.smoothed->trajectory);
  metre.add_to(answer.smoothed->last);
}

}  // namespace

void add_options_of(const SlamQuestion& question, Provenance& provenance) {
  provenance.options.emplace_back("filter", std::string(name_of(question.method)));
  provenance.options.emplace_back("start", question.start_text);
  if (has_particles(question.method))
    provenance.options.emplace_back("particles", std::to_string(question.particles));
  if (question.swarm.iterations != SwarmOptions{}.iterations)
    provenance.options.emplace_back("swarm-iterations", std::to_string(question.swarm.iterations));
  if (question.swarm.target_agreement > 0.0)
    provenance.options.emplace_back("swarm-agreement", fmt::format("{}", question.swarm.target_agreement));
  if (question.estimate)
    provenance.options.emplace_back("estimate", *question.estimate == PointEstimate::best ? "best" : "mean");
  if (question.window_s) provenance.options.emplace_back("window", fmt::format("{}", *question.window_s));
  if (question.unknown_ids) provenance.options.emplace_back("unknown-ids", "true");
  if (question.systematic_sigma)
    provenance.options.emplace_back("systematic-sigma", fmt::format("{}", *question.systematic_sigma));
  if (question.smooth) provenance.options.emplace_back("smooth", "true");
  if (question.smooth && question.smoother_runs != SlamQuestion{}.smoother_runs)
    provenance.options.emplace_back("smoother-runs", std::to_string(question.smoother_runs));
  add_options_of(question.slip, provenance);
  add_read_options(question.reading, provenance);
}

SlamAnswer begun_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                      const SlipAnswer* slip_found) {
  SlamAnswer answer;
  answer.provenance = provenance_of(recording, robot, question);
  const AlignedReadings readings =
      corrected_readings(recording, robot, question.slip, slip_found, answer.provenance);
  answer.input = slam_input(recording, readings, robot.robot,
                            {.hide_ids = question.unknown_ids,
                             .names = question.names,
                             .also_at_s = question.also_at_s,
                             .shares = question.systematic_sigma.has_value()});
  answer.inconsistencies = sensor_clock_checks(recording, readings, robot.robot);
  require_apart(answer.provenance.inputs, {question.checkpoints.write});
  auto& findings = answer.input.findings;
  findings.insert(findings.begin(), recording.findings.begin(), recording.findings.end());
  return answer;
}

SlamAnswer answer_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                       const SlipAnswer* slip_found) {
  return finished_slam(recording, robot, question, begun_slam(recording, robot, question, slip_found));
}

SlamAnswer finished_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                         SlamAnswer answer) {
  auto& findings = answer.input.findings;
  if (answer.input.observations() == 0)
    throw CannotAnswer(fmt::format("{}: no sightings while the robot's odometry runs", recording.name));
  const LandmarkSensor& sensor = *robot.robot.landmark_sensor;
  const SystematicErrors& systematic = answer.input.systematic;
  if (systematic.has_bias) answer.gyro_bias_rad_s = robot.robot.chassis.gyro->bias_rad_s;
  std::optional<Vector3> shares;
  if (question.systematic_sigma) shares = Vector3::Constant(*question.systematic_sigma);
  SlamPrior prior{.start = question.start, .systematic_sigma = systematic.sigma(shares)};
  const SlamOptions filter = slam_options_for(answer.input, {.method = question.method,
                                                             .particles = question.particles,
                                                             .seed = question.seed,
                                                             .prior = prior,
                                                             .keep_growth = true,
                                                             .judge_fit = !question.smooth,
                                                             .threads = question.threads,
                                                             .swarm = question.swarm,
                                                             .estimate = question.estimate,
                                                             .window_s = question.window_s});
  answer.result =
      slam_with_checkpoints(answer.input, SlamRun(sensor, filter), settings_of(robot, question, answer.input),
                            question.checkpoints, question.on_steps);
  if (!shares) prior.systematic_sigma = systematic.sigma(kUsualShareSigma);
  if (question.smooth && answer.result.map.empty())
    findings.push_back({.severity = Severity::warning,
                        .code = FindingCode::nothing_to_smooth,
                        .place = recording.name,
                        .count = 1});
  else if (question.smooth)
    answer.smoothed = smooth_from_many(answer.input, sensor, answer.result, filter, question.smoother_runs,
                                       {.prior = prior});
  name_unidentified(answer);
  report_no_rest({robot.robot, answer.input.rest_s, answer.input.steps.back().time_s - answer.input.start_s,
                  answer.last().covariance(2, 2)},
                 findings);
  std::ranges::move(
      consistency_checks(answer.input, answer.result, answer.smoothed ? &*answer.smoothed : nullptr),
      std::back_inserter(answer.inconsistencies));
  const Metre metre = metre_of(robot.robot, question.start);
  answer.metre_sigma = metre.sigma;
  add_metre(metre, answer);
  require_sound(answer.result.online, recording.name);
  if (answer.smoothed) require_sound(answer.smoothed->trajectory, recording.name);
  require_sound(answer.map(), recording.name);
  return answer;
}

}  // namespace trundle::pipeline
