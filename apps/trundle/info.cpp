#include <memory>

#include <fmt/format.h>

#include "trundle/inspection/findings.hpp"

#include "command.hpp"
#include "shared_output.hpp"

namespace trundle::app {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string recording;
  std::string robot;
  int robot_number = 0;
  bool gyro_noise = false;
  std::string output;
  Common common;
};

/// One recording and all that is told of it.
struct Told {
  Recording recording;
  Findings findings;
  std::optional<GyroNoise> noise;
};

Told tell(const std::filesystem::path& path, const std::optional<Robot>& robot, const Options& options) {
  Told told;
  told.recording = read_recording(path, {.robot_number = options.robot_number});
  told.findings = find_in(told.recording, robot ? &*robot : nullptr);
  if (!options.gyro_noise) return told;
  told.noise = gyro_noise(told.recording);
  if (!told.noise)
    throw CannotAnswer(
        path.string() +
        ": the gyro's noise cannot be told: the robot never rests for 1.4 s while its gyro runs");
  return told;
}

/// The partial references in words.
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

Json to_json(const Told& told) {
  const Recording& recording = told.recording;
  const Findings& findings = told.findings;
  Json json = {{"name", recording.name}, {"session", recording.session}, {"streams", Json::array()}};
  for (const StreamSummary& stream : findings.streams) json["streams"].push_back(to_json(stream));
  json["landmarks"] = recording.landmarks.size();
  json["references"] = Json::object();
  for (const auto& [name, text] : references_of(recording)) json["references"][name] = text;
  json["problems"] = Json::array();
  for (const Problem& problem : findings.problems) json["problems"].push_back(trundle::to_json(problem));
  json["missing"] = findings.missing;
  if (findings.abilities)
    json["robot"] = {{"can_tell", findings.abilities->can}, {"cannot_tell", findings.abilities->cannot}};
  if (findings.compares_clocks)
    json["gyro_time_offset"] = findings.gyro_time_offset ? to_json(*findings.gyro_time_offset) : Json();
  for (const TrackOnGround& track : findings.tracks) json["effective_track"].push_back(to_json(track));
  if (told.noise) json["gyro_noise"] = to_json(*told.noise);
  return json;
}

std::string line_of(const StreamSummary& stream) {
  std::string line = fmt::format("  {:<16}{:>9} rows  {:>9.2f} s", stream.stream, stream.rows,
                                 stream.end_s - stream.start_s);
  if (stream.rate_hz > 0.0)
    line += fmt::format("  {:>7.2f} Hz  {} gaps, longest step {:.3g} s", stream.rate_hz, stream.gaps,
                        stream.longest_step_s);
  return line + fmt::format("{}{}\n", stream.columns.empty() ? "" : "  ", fmt::join(stream.columns, " "));
}

std::string list(const std::string& title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  " + line + "\n";
  return lines.empty() ? text : title + "\n" + text;
}

std::string walk_text_of(const GyroNoise& noise) {
  if (!noise.bias_walk_rad_s_sqrt_s)
    return fmt::format("the rests are too short to tell the walk of the bias: below {:.2g} rad/s/√s\n",
                       noise.bias_walk_limit);
  return fmt::format("bias walk {:.3g} rad/s/√s, {}\n", *noise.bias_walk_rad_s_sqrt_s,
                     noise.walk_between_rests ? "from one rest to the next" : "by the Allan deviation");
}

std::string text_of(const GyroNoise& noise) {
  std::string text =
      fmt::format("gyro at rest for {:.1f} s: bias {:.6g} rad/s, noise {:.3g} ± {:.1g} rad/s/√Hz\n",
                  noise.rest_s, noise.bias_rad_s, noise.noise_rad_s_sqrt_hz, noise.noise_sigma);
  text += walk_text_of(noise) + "  Allan deviation:\n";
  for (const AllanPoint& point : noise.allan)
    text += fmt::format("  {:>10.3g} s  {:.4g} rad/s\n", point.tau_s, point.deviation);
  return text;
}

std::string text_of(const Told& told) {
  const Recording& recording = told.recording;
  const Findings& findings = told.findings;
  std::string text = fmt::format("{} (session {})\n", recording.name, recording.session);
  for (const StreamSummary& stream : findings.streams) text += line_of(stream);
  if (!recording.landmarks.empty())
    text += fmt::format("  {:<16}{:>9} known\n", "landmarks", recording.landmarks.size());
  std::vector<std::string> lines;
  for (const auto& [name, what] : references_of(recording)) lines.push_back(name + ": " + what);
  text += list("references:", lines);
  lines.clear();
  for (const Problem& problem : findings.problems)
    lines.push_back(fmt::format("{}: {}: {}: {}", word_of(problem.severity), problem.place, problem.kind,
                                problem.message));
  text += lines.empty() ? "problems: none found\n" : list("problems:", lines);
  text += list("missing:", findings.missing);
  if (findings.abilities) {
    text += list("this robot can tell:", findings.abilities->can);
    text += list("this robot cannot tell:", findings.abilities->cannot);
  }
  for (const TrackOnGround& track : findings.tracks)
    text += fmt::format("effective track by the gyro, {:.1f} to {:.1f} s: {:.4f} ± {:.4f} m\n", track.start_s,
                        track.end_s, track.track_m, track.sigma_m);
  if (findings.compares_clocks)
    text += findings.gyro_time_offset
                ? fmt::format("gyro against wheels: time_offset_s = {:.4f} ± {:.4f} s\n",
                              findings.gyro_time_offset->offset_s, findings.gyro_time_offset->sigma_s)
                : std::string(
                      "gyro against wheels: the time offset cannot be told; change the turn rate often\n");
  if (told.noise) text += text_of(*told.noise);
  return text;
}

Provenance provenance_of(const Options& options, const std::vector<Told>& all) {
  Provenance provenance;
  for (const Told& told : all)
    provenance.inputs.insert(provenance.inputs.end(), told.recording.inputs.begin(),
                             told.recording.inputs.end());
  if (!options.robot.empty()) provenance.inputs.push_back(input_file(options.robot));
  if (options.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(options.robot_number));
  if (options.gyro_noise) provenance.options.emplace_back("gyro-noise", "true");
  return provenance;
}

/// The robot file with the gyro's noise, and how it was obtained.
void write_gyro_noise(const Options& options, Robot robot, const Provenance& provenance,
                      const GyroNoise& noise) {
  Gyro gyro = robot.chassis.gyro.value_or(Gyro{});
  gyro.noise_rad_s_sqrt_hz = noise.noise_rad_s_sqrt_hz;
  gyro.bias_walk_rad_s_sqrt_s = noise.bias_walk_rad_s_sqrt_s.value_or(gyro.bias_walk_rad_s_sqrt_s);
  robot.chassis.gyro = gyro;
  std::string text = head_of(provenance);
  text += fmt::format("# noise_rad_s_sqrt_hz: Allan deviation of {:.1f} s of standing still, ± {:.1g}\n",
                      noise.rest_s, noise.noise_sigma);
  text += "# bias_walk_rad_s_sqrt_s: " +
          (noise.bias_walk_rad_s_sqrt_s ? "the same: " : std::string("as it was: ")) + walk_text_of(noise);
  write_file(options.output, text + to_toml(robot));
}

void require_output_makes_sense(const Options& options, std::size_t recordings) {
  if (options.output.empty()) return;
  if (!options.gyro_noise || options.robot.empty())
    throw CLI::ValidationError("--output",
                               "needs --gyro-noise and --robot: it writes the robot file with the noise");
  if (recordings != 1) throw CLI::ValidationError("--output", "needs one recording");
}

void run(const Options& options) {
  std::optional<Robot> robot;
  if (!options.robot.empty()) robot = read_robot(options.robot);
  const std::vector<std::filesystem::path> paths = recordings_below(options.recording);
  if (paths.empty())
    throw InputError(options.recording, "holds no recording",
                     "a folder with wheels.csv or another stream, or recording.toml");
  require_output_makes_sense(options, paths.size());
  std::vector<Told> all;
  for (const auto& path : paths) all.push_back(tell(path, robot, options));
  const Provenance provenance = provenance_of(options, all);
  if (!options.output.empty()) write_gyro_noise(options, *robot, provenance, *all.front().noise);
  Json document = trundle::to_json(provenance);
  std::string text;
  for (const Told& told : all) {
    text += (text.empty() ? "" : "\n") + text_of(told);
    if (all.size() == 1) {
      document.update(to_json(told));
    } else {
      document["recordings"].push_back(to_json(told));
    }
  }
  print(options.common, document, text);
}

}  // namespace

void add_info(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, "info", "What a recording holds, what is wrong with it, what this robot can tell",
                  "trundle info recording --robot robot.toml", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder, or a folder of recordings")
      ->required();
  command->add_option("--robot", options->robot,
                      "Robot file: also says what its sensors can and cannot tell");
  command->add_option("--robot-number", options->robot_number, "Robot of a UTIAS MRCLAM folder");
  command->add_flag("--gyro-noise", options->gyro_noise,
                    "Bias, noise and Allan deviation of the gyro, from where the robot rests");
  command->add_option("-o,--output", options->output,
                      "With --gyro-noise: the robot file with that noise in it");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
