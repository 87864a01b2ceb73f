#include <memory>

#include <fmt/format.h>

#include "trundle/slip/find_slip.hpp"

#include "command.hpp"
#include "shared_output.hpp"

namespace trundle::app {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string recording;
  std::string robot;
  std::vector<std::string> learn;
  double probability = 0.01;
  double interval_s = 0.25;
  std::string method = "general";
  int robot_number = 0;
  std::string output;
  std::string corrected;
  Common common;
};

/// What the clean recordings taught.
struct Learned {
  std::vector<InputFile> inputs;
  std::vector<double> sample;
  NormalityTest normality;
  bool empirical = false;
  bool beyond_sample = false;
};

bool is_published(const Options& options) {
  return options.method == "published";
}

std::optional<Learned> learn(const Options& options, const Robot& robot, SlipOptions& slip) {
  if (options.learn.empty()) return std::nullopt;
  Learned learned;
  std::vector<JudgedInterval> clean;
  for (const std::string& folder : options.learn) {
    const Recording recording = read_recording(folder, {.robot_number = options.robot_number});
    const std::vector<JudgedInterval> more =
        clean_intervals(align(recording, robot), robot, options.interval_s);
    clean.insert(clean.end(), more.begin(), more.end());
    learned.inputs.insert(learned.inputs.end(), recording.inputs.begin(), recording.inputs.end());
  }
  if (is_published(options)) {
    LearnedBand band = learn_band(clean, robot, LearnOptions{options.probability});
    learned.sample = std::move(band.sample);
    learned.normality = band.band.normality;
    learned.empirical = band.band.empirical;
    learned.beyond_sample = band.band.beyond_sample;
    slip.band = band.band;
  } else {
    LearnedResiduals residuals = learn_residuals(clean, robot, {options.probability});
    learned.sample = std::move(residuals.sample);
    learned.normality = residuals.normality;
    learned.empirical = residuals.model.empirical;
    learned.beyond_sample = residuals.model.beyond_sample;
    slip.model = residuals.model;
  }
  return learned;
}

Provenance provenance_of(const Options& options, const Recording& recording,
                         const std::optional<Learned>& learned) {
  Provenance provenance{recording.inputs,
                        {{"method", options.method},
                         {"probability", fmt::format("{}", options.probability)},
                         {"interval-s", fmt::format("{}", options.interval_s)}},
                        std::nullopt};
  provenance.inputs.push_back(input_file(options.robot));
  if (learned)
    provenance.inputs.insert(provenance.inputs.end(), learned->inputs.begin(), learned->inputs.end());
  for (const std::string& folder : options.learn) provenance.options.emplace_back("learn", folder);
  if (options.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(options.robot_number));
  return provenance;
}

Json to_json(const NormalityTest& test) {
  return {{"n", test.moments.count},
          {"mean", test.moments.mean},
          {"variance", test.moments.variance},
          {"skewness", test.moments.skewness},
          {"kurtosis", test.moments.kurtosis},
          {"u1", test.u1},
          {"u2", test.u2},
          {"limit", test.limit},
          {"normal", !test.rejected}};
}

Json to_json(const Learned& learned, const SlipOptions& slip) {
  Json document = {{"normality", to_json(learned.normality)},
                   {"empirical_limit", learned.empirical},
                   {"beyond_sample", learned.beyond_sample}};
  if (slip.band)
    document["band"] = {{"unit", "rad"},
                        {"lower", slip.band->lower},
                        {"upper", slip.band->upper},
                        {"interval_s", slip.band->interval_s},
                        {"least_speed_m_s", slip.band->least_speed_m_s},
                        {"greatest_speed_m_s", slip.band->greatest_speed_m_s}};
  if (slip.model)
    document["residuals"] = {{"intervals", slip.model->samples},
                             {"interval_s", slip.model->interval_s},
                             {"timing_sigma_s", slip.model->timing_sigma_s},
                             {"chi2_limit", slip.model->limit},
                             {"persistent_limit", slip.model->persistent_limit}};
  document["histogram"] = Json::array();
  for (const Bin& bin : histogram_of(learned.sample, 20))
    document["histogram"].push_back({{"centre", bin.centre}, {"count", bin.count}});
  document["quantiles"] = Json::array();
  for (const QuantilePair& pair : quantile_pairs(learned.sample))
    document["quantiles"].push_back({pair.normal, pair.sample});
  return document;
}

Json to_json(const SlipEvent& event, const Robot& robot) {
  return {{"start_s", event.start_s},    {"end_s", event.end_s},       {"wheel", wheel_of(event, robot)},
          {"kind", name_of(event.kind)}, {"excess_m", event.excess_m}, {"confidence", event.confidence}};
}

Json to_json(const SlipCounts& counts) {
  return {{"intervals", counts.intervals},
          {"judged", counts.judged},
          {"parked", counts.parked},
          {"no_gyro", counts.no_gyro},
          {"not_applicable", counts.not_applicable},
          {"not_learned", counts.not_learned},
          {"alarms", counts.alarms},
          {"slipping", counts.slipping},
          {"flagged_share", counts.flagged_share()}};
}

/// What the program found, in one place for text and JSON.
struct Findings {
  Robot robot;
  SlipOptions slip;
  std::optional<Learned> learned;
  SlipReport report;
};

Json document_of(const Provenance& provenance, const Findings& findings) {
  Json document = app::to_json(provenance);
  document["intervals"] = to_json(findings.report.counts);
  document["events"] = Json::array();
  for (const SlipEvent& event : findings.report.events)
    document["events"].push_back(to_json(event, findings.robot));
  document["learned"] = nullptr;
  if (findings.learned) document["learned"] = to_json(*findings.learned, findings.slip);
  document["problems"] = Json::array();
  for (const Problem& problem : findings.report.problems)
    document["problems"].push_back(app::to_json(problem));
  return document;
}

std::string text_of(const Findings& findings) {
  const SlipCounts& counts = findings.report.counts;
  std::string text =
      fmt::format("{} moving intervals judged, {} within a slip ({:.2f} %), {} slips\n", counts.judged,
                  counts.slipping, 100.0 * counts.flagged_share(), findings.report.events.size());
  if (!findings.report.events.empty())
    text += fmt::format("{:>10} {:>10}  {:<12} {:<8} {:>10} {:>11}\n", "start s", "end s", "wheel", "kind",
                        "excess m", "confidence");
  for (const SlipEvent& e : findings.report.events)
    text += fmt::format("{:10.3f} {:10.3f}  {:<12} {:<8} {:10.4f} {:11.3f}\n", e.start_s, e.end_s,
                        wheel_of(e, findings.robot), name_of(e.kind), e.excess_m, e.confidence);
  if (!findings.learned)
    text += "the noise is that of the robot file: --learn CLEAN measures it\n";
  else
    text += fmt::format("learned from {} intervals: {} (U1 {:.2f}, U2 {:.2f}, limit {:.2f})\n",
                        findings.learned->normality.moments.count,
                        findings.learned->normality.rejected ? "not normal" : "normal",
                        findings.learned->normality.u1, findings.learned->normality.u2,
                        findings.learned->normality.limit);
  for (const Problem& problem : findings.report.problems) text += line_of(problem);
  return text;
}

void warn_of_learning(const Options& options, Findings& findings) {
  if (!findings.learned || !findings.learned->empirical) return;
  const bool short_sample = findings.learned->beyond_sample;
  findings.report.problems.push_back(
      {.severity = Severity::warning,
       .kind = "not normal",
       .place = options.learn.front(),
       .count = findings.learned->normality.moments.count,
       .message =
           fmt::format("the residuals of clean driving are not normal: their own quantiles are the limit{}",
                       short_sample ? fmt::format("; there are too few of them for a probability of {}: "
                                                  "the largest one is used",
                                                  options.probability)
                                    : "")});
}

void run(const Options& options) {
  Findings findings{.robot = read_robot(options.robot), .slip = {}, .learned = {}, .report = {}};
  SlipOptions& slip = findings.slip;
  slip.method = is_published(options) ? SlipMethod::published : SlipMethod::general;
  slip.probability = options.probability;
  slip.interval_s = options.interval_s;
  const Recording recording = read_recording(options.recording, {.robot_number = options.robot_number});
  findings.learned = learn(options, findings.robot, slip);
  findings.report = find_slip(align(recording, findings.robot), recording.commands, findings.robot, slip);
  auto& problems = findings.report.problems;
  problems.insert(problems.begin(), recording.problems.begin(), recording.problems.end());
  warn_of_learning(options, findings);
  const Provenance provenance = provenance_of(options, recording, findings.learned);
  if (!options.output.empty())
    write_file(options.output, head_of(provenance) + to_csv(findings.report.events, findings.robot));
  if (!options.corrected.empty())
    write_trajectory(options.corrected, provenance,
                     integrate(findings.report.corrected, findings.robot).trajectory);
  print(options.common, document_of(provenance, findings), text_of(findings));
}

}  // namespace

void add_slip(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, "slip", "Find where wheels slip, and correct the odometry for it",
      "trundle slip recording --robot robot.toml --learn clean -o slip.csv --corrected trajectory.csv",
      options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file")->required();
  command->add_option("--learn", options->learn, "Recordings without slip, to measure the noise on");
  command->add_option("--probability", options->probability, "That an interval without slip is flagged")
      ->check(CLI::Range(1e-12, 0.5))
      ->capture_default_str();
  command->add_option("--method", options->method, "general: any chassis; published: two wheels and a gyro")
      ->check(CLI::IsMember({"general", "published"}))
      ->capture_default_str();
  command->add_option("--interval-s", options->interval_s, "Readings are judged over at least this long [s]")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--robot-number", options->robot_number, "Which robot of a UTIAS MRCLAM folder");
  command->add_option("-o,--output", options->output, "Slips: start_s,end_s,wheel,kind,excess_m,confidence");
  command->add_option("--corrected", options->corrected,
                      "Trajectory with the slips corrected: .csv, or .tum");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
