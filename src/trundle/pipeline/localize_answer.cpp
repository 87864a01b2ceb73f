#include "trundle/pipeline/localize_answer.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/innovations.hpp"
#include "trundle/pipeline/sensor_clock.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/slam/consistency_checks.hpp"

namespace trundle::pipeline {
namespace {

Provenance provenance_of(const Recording& recording, const RobotFile& robot, const MapFile& map,
                         const LocalizeQuestion& question) {
  Provenance provenance{recording.inputs, {}, question.seed};
  provenance.inputs.push_back(robot.file);
  provenance.inputs.push_back(map.file);
  if (map.covariance_file) provenance.inputs.push_back(*map.covariance_file);
  provenance.options = {{"filter", std::string(name_of(question.filter))},
                        {"start", question.start ? question.start_text : "none"}};
  if (question.start) {
    provenance.options.emplace_back("start-sigma-m", fmt::format("{}", question.start_sigma_m));
    provenance.options.emplace_back("start-sigma-deg", fmt::format("{}", question.start_sigma_deg));
  }
  if (question.filter == LocalizerFilter::particles)
    provenance.options.emplace_back("particles", std::to_string(question.particles));
  if (question.unknown_ids) provenance.options.emplace_back("unknown-ids", "true");
  add_options_of(question.slip, provenance);
  add_read_options(question.reading, provenance);
  return provenance;
}

std::optional<PoseEstimate> start_of(const LocalizeQuestion& question) {
  if (!question.start) return std::nullopt;
  PoseEstimate start;
  start.pose = *question.start;
  const double sigma_rad = radians(question.start_sigma_deg);
  start.covariance.diagonal() << question.start_sigma_m * question.start_sigma_m,
      question.start_sigma_m * question.start_sigma_m, sigma_rad * sigma_rad;
  return start;
}

LocalizerOptions options_of(const LocalizeQuestion& question) {
  LocalizerOptions options;
  options.filter = question.filter;
  options.start = start_of(question);
  options.particles.most = question.particles;
  options.seed = question.seed;
  return options;
}

/// Two landmarks that are seen from one place or from two near each other are no further apart.
KnownMap known_map_of(const MapFile& map, const LandmarkSensor& sensor) {
  std::vector<KnownLandmark> landmarks;
  for (const MapLandmark& landmark : map.landmarks)
    landmarks.push_back({landmark.position, landmark.covariance});
  return {std::move(landmarks), 2.0 * sensor.max_range_m, map.covariance};
}

[[noreturn]] void refuse(const std::string& recording, const LocalizeAnswer& answer) {
  const std::size_t unmapped = answer.result.counts.unmapped;
  throw CannotAnswer(
      fmt::format("{}: {} sightings and the {} landmarks of the map never determined the robot's pose; {}",
                  recording, answer.input.observations(), answer.landmarks,
                  unmapped > 0 ? fmt::format("{} of them name landmarks that the map does not have", unmapped)
                               : std::string("a --start may help")));
}

nlohmann::ordered_json to_json(const KnownStretch& stretch) {
  nlohmann::ordered_json document = {{"start_s", stretch.start_s}, {"end_s", stretch.end_s}};
  if (stretch.noticed_s) document["loss_noticed_s"] = *stretch.noticed_s;
  return document;
}

}  // namespace

MapFile read_map_file(const std::filesystem::path& path) {
  MapFile map{read_landmark_map(path), input_file(path)};
  const std::filesystem::path beside = covariance_file_of(path);
  if (!std::filesystem::exists(beside)) return map;
  map.covariance = read_landmark_covariance(beside, map.landmarks);
  map.covariance_file = input_file(beside);
  return map;
}

LocalizeAnswer answer_localize(const Recording& recording, const RobotFile& robot, const MapFile& map,
                               const LocalizeQuestion& question, const SlipAnswer* slip_found) {
  LocalizeAnswer answer;
  answer.provenance = provenance_of(recording, robot, map, question);
  SlamInputOptions input_options{.hide_ids = question.unknown_ids, .lengths = LengthsIn::true_metre};
  for (const MapLandmark& landmark : map.landmarks) input_options.names.push_back(landmark.name);
  const AlignedReadings readings =
      corrected_readings(recording, robot, question.slip, slip_found, answer.provenance);
  answer.input = slam_input(recording, readings, robot.robot, input_options);
  auto& findings = answer.input.findings;
  findings.insert(findings.begin(), recording.findings.begin(), recording.findings.end());
  answer.landmarks = map.landmarks.size();
  answer.has_map_covariance = map.covariance_file.has_value();
  const LandmarkSensor& sensor = *robot.robot.landmark_sensor;
  answer.result = localize(answer.input, known_map_of(map, sensor), sensor, options_of(question));
  if (answer.result.trajectory.poses.empty()) refuse(recording.name, answer);
  const LocalizationCounts& counts = answer.result.counts;
  std::ranges::move(sensor_clock_checks(recording, readings, robot.robot), std::back_inserter(findings));
  std::ranges::move(innovation_checks(counts.median_nis, counts.matched), std::back_inserter(findings));
  require_sound(answer.result.trajectory, recording.name);
  return answer;
}

std::string steps_csv_of(const LocalizeAnswer& answer) {
  std::string text =
      head_of(answer.provenance) +
      "time_s,phase,sightings,matched,rejected,alarm,hypotheses,particles,effective_particles\n";
  for (std::size_t k = 0; k < answer.input.steps.size(); ++k) {
    const LocalizerReport& report = answer.result.reports[k];
    const auto count = [&](Decision decision) {
      return std::ranges::count(report.observations, decision, &ObservationReport::decision);
    };
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", answer.input.steps[k].time_s, name_of(report.phase),
                        report.observations.size(), count(Decision::matched), count(Decision::rejected),
                        report.alarm, report.hypotheses, report.particles, report.effective_particles);
  }
  return text;
}

std::string innovations_csv_of(const LocalizeAnswer& answer) {
  std::string text = head_of(answer.provenance) + kInnovationColumns;
  for (std::size_t k = 0; k < answer.input.steps.size(); ++k)
    append_innovations(text, answer.input.steps[k], answer.result.reports[k].observations,
                       answer.input.landmarks);
  return text;
}

nlohmann::ordered_json document_of(const LocalizeAnswer& answer) {
  const LocalizationCounts& counts = answer.result.counts;
  const StampedPose& end = answer.result.trajectory.poses.back();
  nlohmann::ordered_json document = to_json(answer.provenance);
  document["landmarks"] = answer.landmarks;
  document["map_covariance"] = answer.has_map_covariance;
  document["steps"] = answer.input.steps.size();
  document["poses"] = answer.result.trajectory.poses.size();
  document["localized_s"] = answer.result.stretches.front().start_s;
  document["known"] = nlohmann::ordered_json::array();
  for (const KnownStretch& stretch : answer.result.stretches) document["known"].push_back(to_json(stretch));
  if (!answer.result.refuted_s.empty()) document["refuted_s"] = answer.result.refuted_s;
  document["sightings"] = {{"matched", counts.matched},
                           {"rejected", counts.rejected},
                           {"while_searching", counts.searching},
                           {"not_in_the_map", counts.unmapped},
                           {"invalid", counts.invalid}};
  document["nis"] = {
      {"mean", or_null(counts.mean_nis)}, {"median", or_null(counts.median_nis)}, {"honest_mean", 2.0}};
  if (counts.most_particles > 0) document["most_particles"] = counts.most_particles;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["trajectory"] = "online estimate, where the pose is known";
  document["problems"] = to_json(answer.input.findings);
  return document;
}

}  // namespace trundle::pipeline
