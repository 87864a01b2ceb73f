#include "trundle/pipeline/info_answer.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Provenance provenance_of(const std::vector<RecordingInfo>& recordings, const InfoQuestion& question) {
  Provenance provenance;
  for (const RecordingInfo& info : recordings) add_inputs(info.recording.inputs, provenance);
  if (question.robot) provenance.inputs.push_back(question.robot->file);
  add_read_options(question.reading, provenance);
  if (question.gyro_noise) provenance.options.emplace_back("gyro-noise", "true");
  return provenance;
}

Json to_json(const StreamSummary& stream) {
  Json json = {{"stream", stream.stream},
               {"rows", stream.rows},
               {"start_s", stream.start_s},
               {"end_s", stream.end_s},
               {"duration_s", stream.end_s - stream.start_s}};
  if (stream.rate_hz > 0.0) {
    json["rate_hz"] = stream.rate_hz;
    json["gaps"] = stream.gaps;
    json["longest_step_s"] = stream.longest_step_s;
  }
  if (!stream.columns.empty()) json["columns"] = stream.columns;
  return json;
}

Json to_json(const SteeringSummary& steering) {
  Json json = {{"wheel", steering.wheel},
               {"unit", steering.in_ticks ? "ticks" : "degrees"},
               {"least", steering.least},
               {"greatest", steering.greatest},
               {"fastest_per_s", steering.fastest_per_s}};
  if (steering.rate_hz > 0.0) json["rate_hz"] = steering.rate_hz;
  if (steering.at_rest) json["at_rest"] = *steering.at_rest;
  return json;
}

Json to_json(const GyroNoise& noise) {
  Json json = {{"rest_s", noise.rest_s},
               {"bias_rad_s", noise.bias_rad_s},
               {"noise_rad_s_sqrt_hz", noise.noise_rad_s_sqrt_hz},
               {"noise_sigma", noise.noise_sigma}};
  if (noise.bias_walk_rad_s_sqrt_s) json["bias_walk_rad_s_sqrt_s"] = *noise.bias_walk_rad_s_sqrt_s;
  json["bias_walk_limit"] = noise.bias_walk_limit;
  json["allan"] = Json::array();
  for (const AllanPoint& point : noise.allan)
    json["allan"].push_back({{"tau_s", point.tau_s},
                             {"deviation_rad_s", point.deviation},
                             {"degrees_of_freedom", point.degrees_of_freedom}});
  return json;
}

Json to_json(const TimeOffset& offset) {
  return {
      {"time_offset_s", offset.offset_s}, {"sigma_s", offset.sigma_s}, {"correlation", offset.correlation}};
}

Json to_json(const TrackOnGround& track) {
  return {{"start_s", track.start_s},
          {"end_s", track.end_s},
          {"track_m", track.track_m},
          {"sigma_m", track.sigma_m}};
}

Json to_json(const RecordingInfo& info) {
  const Recording& recording = info.recording;
  const Findings& findings = info.findings;
  Json json = {{"name", recording.name}, {"session", recording.session}, {"streams", Json::array()}};
  for (const StreamSummary& stream : findings.streams) json["streams"].push_back(to_json(stream));
  for (const SteeringSummary& steering : findings.steerings) json["steerings"].push_back(to_json(steering));
  json["landmarks"] = recording.landmarks.size();
  json["references"] = Json::object();
  for (const auto& [name, text] : references_of(recording)) json["references"][name] = text;
  json["problems"] = pipeline::to_json(findings.problems);
  json["missing"] = findings.missing;
  if (findings.abilities)
    json["robot"] = {{"can_tell", findings.abilities->can}, {"cannot_tell", findings.abilities->cannot}};
  if (findings.compares_clocks)
    json["gyro_time_offset"] = findings.gyro_time_offset ? to_json(*findings.gyro_time_offset) : Json();
  if (findings.compares_steering_clock)
    json["steering_time_offset"] =
        findings.steering_time_offset ? to_json(*findings.steering_time_offset) : Json();
  if (findings.compares_reference_clock)
    json["reference_time_offset"] =
        findings.reference_time_offset ? to_json(*findings.reference_time_offset) : Json();
  if (findings.compares_sighting_clock)
    json["landmark_sensor_time_offset"] =
        findings.sighting_time_offset ? to_json(*findings.sighting_time_offset) : Json();
  for (const TrackOnGround& track : findings.tracks) json["effective_track"].push_back(to_json(track));
  if (info.noise) json["gyro_noise"] = to_json(*info.noise);
  return json;
}

}  // namespace

RecordingInfo inform(const Recording& recording, const Robot* robot, bool with_gyro_noise) {
  RecordingInfo info{.recording = recording, .findings = {}, .noise = {}};
  info.findings = find_in(info.recording, robot);
  if (!with_gyro_noise) return info;
  info.noise = gyro_noise(info.recording);
  if (!info.noise)
    throw CannotAnswer(
        info.recording.name +
        ": the gyro's noise is not observable: the robot never rests for 1.4 s while its gyro runs");
  return info;
}

InfoAnswer answer_info(const std::vector<Recording>& recordings, const InfoQuestion& question) {
  InfoAnswer answer;
  for (const Recording& recording : recordings)
    answer.recordings.push_back(
        inform(recording, question.robot ? &question.robot->robot : nullptr, question.gyro_noise));
  answer.provenance = provenance_of(answer.recordings, question);
  return answer;
}

nlohmann::ordered_json document_of(const InfoAnswer& answer) {
  Json document = to_json(answer.provenance);
  if (answer.recordings.size() == 1) {
    document.update(to_json(answer.recordings.front()));
  } else {
    for (const RecordingInfo& info : answer.recordings) document["recordings"].push_back(to_json(info));
  }
  return document;
}

std::vector<std::pair<std::string, std::string>> references_of(const Recording& recording) {
  std::vector<std::pair<std::string, std::string>> found;
  const PartialReference& partial = recording.partial;
  const auto add = [&](const char* name, const std::optional<Measured>& measured, const char* unit) {
    if (measured)
      found.emplace_back(name, fmt::format("{:.6g} ± {:.3g} {}", measured->value, measured->sigma, unit));
  };
  if (!recording.reference.time_s.empty())
    found.emplace_back("trajectory", fmt::format("{} rows", recording.reference.time_s.size()));
  if (!recording.relative_motions.empty())
    found.emplace_back("relative motions", fmt::format("{} intervals", recording.relative_motions.size()));
  if (partial.closed)
    found.emplace_back("closed", fmt::format("ends where it started ± {:.3g} m", partial.closed->sigma));
  if (partial.closed_heading)
    found.emplace_back("closed heading",
                       fmt::format("heads as it started ± {:.3g}°", degrees(partial.closed_heading->sigma)));
  add("distance", partial.distance_m, "m");
  add("turns", partial.turns, "turns");
  add("end x", partial.end_x_m, "m");
  add("end y", partial.end_y_m, "m");
  add("end heading", partial.end_heading_rad, "rad");
  return found;
}

}  // namespace trundle::pipeline
