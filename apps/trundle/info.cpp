#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "trundle/io/words.hpp"
#include "trundle/pipeline/info_answer.hpp"
#include "trundle/pipeline/log_answer.hpp"

#include "command.hpp"
#include "shared_output.hpp"

namespace trundle::app {
namespace {

constexpr std::size_t kMostLines = 20;    // a terminal has 24
constexpr std::size_t kWidestTopic = 60;  // what follows a longer one moves to the right

struct InfoArguments {
  std::string recording;
  std::string robot;
  ReadOptions reading;
  bool gyro_noise = false;
  bool verbose = false;
  bool topics = false;
  std::string output;
  Common common;
};

std::string line_of(const StreamSummary& stream) {
  std::string line = fmt::format("  {:<16}{:>9} rows  {:>9.2f} s", stream.stream, stream.rows,
                                 stream.end_s - stream.start_s);
  if (stream.rate_hz > 0.0)
    line += fmt::format("  {:>7.2f} Hz  {} gaps, longest step {:.3g} s", stream.rate_hz, stream.gaps,
                        stream.longest_step_s);
  return line + fmt::format("{}{}\n", stream.columns.empty() ? "" : "  ", fmt::join(stream.columns, " "));
}

std::string line_of(const SteeringSummary& steering) {
  const char* unit = steering.in_ticks ? " ticks" : "°";
  return fmt::format("  {:<16}{}  {:.4g} to {:.4g}{}, turns by at most {:.3g}{}/s{}\n",
                     "steering of '" + steering.wheel + "'",
                     steering.rate_hz > 0.0 ? fmt::format("  {:.2f} Hz", steering.rate_hz) : "",
                     steering.least, steering.greatest, unit, steering.fastest_per_s, unit,
                     steering.at_rest ? fmt::format(", at rest {:.4g}{}", *steering.at_rest, unit) : "");
}

std::string list(const std::string& title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  " + line + "\n";
  return lines.empty() ? text : title + "\n" + text;
}

std::string walk_text_of(const GyroNoise& noise) {
  if (!noise.bias_walk_rad_s_sqrt_s)
    return fmt::format("the rests are too short to show the walk of the bias: below {:.2g} rad/s/√s\n",
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

std::string line_of_clock(std::string_view sensor, const std::optional<TimeOffset>& offset,
                          std::string_view key = "time_offset_s") {
  return offset ? fmt::format("{} against wheels: {} = {} s\n", sensor, key,
                              with_sigma(offset->offset_s, offset->sigma_s))
                : fmt::format(
                      "{} against wheels: the time offset is not observable; change the turn rate often\n",
                      sensor);
}

std::string text_of(const RecordingInfo& info) {
  const Recording& recording = info.recording;
  const Findings& findings = info.findings;
  std::string text = fmt::format("{} (session {})\n", recording.name, recording.session);
  for (const StreamSummary& stream : findings.streams) text += line_of(stream);
  for (const SteeringSummary& steering : findings.steerings) text += line_of(steering);
  if (!recording.landmarks.empty())
    text += fmt::format("  {:<16}{:>9} known\n", "landmarks", recording.landmarks.size());
  std::vector<std::string> lines;
  for (const auto& [name, what] : references_of(recording)) lines.push_back(name + ": " + what);
  text += list("references:", lines);
  lines.clear();
  for (const Finding& problem : findings.problems)
    lines.push_back(fmt::format("{}: {}: {}: {}", word_of(problem.severity), problem.place,
                                name_of(problem.code), describe(problem)));
  text += lines.empty() ? "problems: none found\n" : list("problems:", lines);
  text += list("missing:", findings.missing);
  if (findings.abilities) {
    text += list("this robot can tell:", findings.abilities->can);
    text += list("this robot cannot tell:", findings.abilities->cannot);
  }
  for (const TrackOnGround& track : findings.tracks)
    text += fmt::format("effective track by the gyro, {:.1f} to {:.1f} s: {:.4f} ± {:.4f} m\n", track.start_s,
                        track.end_s, std::abs(track.track_m), track.sigma_m);
  if (findings.compares_clocks) text += line_of_clock("gyro", findings.gyro_time_offset);
  if (findings.compares_steering_clock)
    text += line_of_clock("steering", findings.steering_time_offset, "steering_time_offset_s");
  if (findings.compares_reference_clock) text += line_of_clock("reference", findings.reference_time_offset);
  if (findings.compares_sighting_clock)
    text += line_of_clock("landmark sensor", findings.sighting_time_offset);
  if (info.noise) text += text_of(*info.noise);
  return text;
}

/// One recording of a session, and what is wrong with it, in a line.
std::string line_of(const RecordingInfo& info, std::size_t width) {
  const std::vector<Finding>& problems = info.findings.problems;
  const auto warnings = std::ranges::count(problems, Severity::warning, &Finding::severity);
  double start_s = std::numeric_limits<double>::infinity(), end_s = -start_s;
  for (const StreamSummary& stream : info.findings.streams) {
    start_s = std::min(start_s, stream.start_s);
    end_s = std::max(end_s, stream.end_s);
  }
  const auto notes = static_cast<std::ptrdiff_t>(problems.size()) - warnings;
  std::string line =
      fmt::format("  {:<{}}  {:>8.1f} s  {}, {}", info.recording.name, width, std::max(end_s - start_s, 0.0),
                  counted(static_cast<std::size_t>(warnings), "warning"),
                  counted(static_cast<std::size_t>(notes), "note"));
  const auto first = std::ranges::find(problems, Severity::warning, &Finding::severity);
  if (first != problems.end()) line += fmt::format("; {}: {}", first->place, describe(*first));
  return line + "\n";
}

/// A session on one screen.
std::string overview_of(const std::vector<RecordingInfo>& recordings) {
  std::size_t width = 0;
  for (const RecordingInfo& info : recordings) width = std::max(width, info.recording.name.size());
  std::string text = fmt::format("{} (all of each: --verbose)\n", counted(recordings.size(), "recording"));
  std::size_t lines = 0;
  for (const RecordingInfo& info : recordings) {
    if (++lines > kMostLines) return text + fmt::format("  and {} more\n", recordings.size() - kMostLines);
    text += line_of(info, width);
  }
  return text;
}

/// The robot file with the gyro's noise, and how it was obtained.
void write_gyro_noise(const InfoArguments& options, Robot robot, const Provenance& provenance,
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

void require_output_makes_sense(const InfoArguments& options, std::size_t recordings) {
  if (options.output.empty()) return;
  if (!options.gyro_noise || options.robot.empty())
    throw CLI::ValidationError("--output",
                               "needs --gyro-noise and --robot: it writes the robot file with the noise");
  if (recordings != 1) throw CLI::ValidationError("--output", "needs one recording");
}

std::string stamps_of(const logs::TopicSummary::StampLag& lag) {
  constexpr double kDay_s = 86'400.0;  // no message travels so long
  if (std::abs(lag.mean_s) > kDay_s)
    return fmt::format("  stamped by another clock than the log's: {:.0f} s apart, to {:.3g} s", lag.mean_s,
                       lag.most_s - lag.least_s);
  return fmt::format("  stamped {:.3g} s before ({:.3g} to {:.3g})", lag.mean_s, lag.least_s, lag.most_s);
}

std::string line_of(const logs::TopicSummary& topic, std::size_t width, bool on_change) {
  constexpr std::uint64_t kEnoughForRate = 10;  // messages: the median of nine steps is one that repeats
  std::string line = fmt::format("  {:<{}}  {:<32} {:>7} {:<8}", topic.topic, width, topic.type,
                                 topic.messages, topic.messages == 1 ? "message" : "messages");
  if (topic.rate_hz > 0.0 && topic.messages >= kEnoughForRate) {
    line += fmt::format("  {:>8.2f} Hz", topic.rate_hz);
    if (!on_change)
      line += fmt::format("  {}, longest step {:.3g} s", counted(topic.gaps, "gap"), topic.longest_step_s);
  }
  if (topic.stamp_lag) line += stamps_of(*topic.stamp_lag);
  if (!topic.unreadable.empty() && topic.messages > 0)
    line += fmt::format("  cannot be read: {}", topic.unreadable);
  return line + "\n";
}

std::string fields_line_of(const logs::TopicSummary& topic) {
  return topic.paths.empty() ? std::string() : fmt::format("      {}\n", fmt::join(topic.paths, " "));
}

std::string text_of(const LogAnswer& answer, bool verbose) {
  const logs::LogSummary& summary = answer.summary;
  std::string text = fmt::format("{}: {}", answer.log.string(), summary.format);
  if (const auto span = span_of(summary))
    text += fmt::format(", {:.2f} s from {:.3f} s on its clock", span->end_s - span->start_s, span->start_s);
  text += summary.is_written_on_change ? ", values as they change\n" : "\n";
  std::size_t width = 0;
  for (const logs::TopicSummary& topic : summary.topics) width = std::max(width, topic.topic.size());
  width = std::min(width, kWidestTopic);
  for (const logs::TopicSummary& topic : summary.topics) {
    text += line_of(topic, width, summary.is_written_on_change);
    if (verbose) text += fields_line_of(topic);
  }
  const std::vector<std::string> faults = faults_of(summary);
  text += faults.empty() ? "problems: none found\n" : list("problems:", faults);
  return text + "trundle init drafts the files that map it to a recording\n";
}

/// A log whose mapping does not stand beside it has topics, and nothing more can be determined.
bool is_bare_log(const InfoArguments& options) {
  const std::filesystem::path path = options.recording;
  if (!logs::is_log(path)) return false;
  return options.topics || (options.reading.map.empty() && !map_beside_log(path));
}

void run(const InfoArguments& options) {
  if (is_bare_log(options)) {
    const std::vector<std::string>& folders = options.reading.msg_path;
    const LogAnswer answer = answer_log({options.recording, {folders.begin(), folders.end()}});
    return print(options.common, document_of(answer), text_of(answer, options.verbose));
  }
  InfoQuestion question{.robot = {}, .gyro_noise = options.gyro_noise, .reading = options.reading};
  if (!options.robot.empty()) question.robot = read_robot_file(options.robot);
  const std::vector<Recording> recordings = read_recordings({options.recording}, options.reading);
  require_output_makes_sense(options, recordings.size());
  require_apart(recordings, {options.output});
  const InfoAnswer answer = answer_info(recordings, question);
  if (!options.output.empty())
    write_gyro_noise(options, question.robot->robot, answer.provenance, *answer.recordings.front().noise);
  std::string text;
  if (answer.recordings.size() > 1 && !options.verbose)
    text = overview_of(answer.recordings);
  else
    for (const RecordingInfo& info : answer.recordings) text += (text.empty() ? "" : "\n") + text_of(info);
  print(options.common, document_of(answer), text);
}

}  // namespace

void add_info(CLI::App& app) {
  auto options = std::make_shared<InfoArguments>();
  CLI::App* command =
      add_command(app, "info", "What a recording holds, what is wrong with it, what this robot can tell",
                  "trundle info recording --robot robot.toml", options->common);
  command
      ->add_option("RECORDING", options->recording,
                   "Recording folder, a folder of recordings, or a log of any known format as it is")
      ->required();
  command->add_option("--robot", options->robot,
                      "Robot file: also says what its sensors can and cannot tell");
  add_read_options(*command, options->reading);
  command->add_flag("--gyro-noise", options->gyro_noise,
                    "Bias, noise and Allan deviation of the gyro, from where the robot rests");
  command->add_flag("--verbose", options->verbose,
                    "Of several recordings all that is told of each; of a log the fields of each topic");
  command->add_flag("--topics", options->topics, "Of a log its topics, also where a recording.toml maps it");
  command->add_option("-o,--output", options->output,
                      "With --gyro-noise: the robot file with that noise in it");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
