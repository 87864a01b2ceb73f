#include "trundle/pipeline/slip_answer.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/inspection/clocks.hpp"
#include "trundle/inspection/inspect.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/gyro_clock.hpp"
#include "trundle/recording/trajectory_file.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

/// Intervals of driving without slip, and where they are from.
struct CleanDriving {
  std::vector<InputFile> inputs;
  std::vector<JudgedInterval> intervals;
};

CleanDriving clean_driving(const Robot& robot, const SlipQuestion& question) {
  CleanDriving clean;
  const auto take = [&](const Recording& recording) {
    const std::vector<JudgedInterval> more =
        clean_intervals(align(recording, robot), robot, question.interval_s);
    clean.intervals.insert(clean.intervals.end(), more.begin(), more.end());
    clean.inputs.insert(clean.inputs.end(), recording.inputs.begin(), recording.inputs.end());
  };
  for (const Recording& recording : read_recordings(question.learn, question.reading)) take(recording);
  for (const Recording& recording : question.clean) take(recording);
  return clean;
}

/// Where one is, to say what is wrong with all of them.
std::string first_learned(const SlipQuestion& question) {
  return question.learn.empty() ? question.clean.front().name : question.learn.front();
}

LearnedSlip learn(const CleanDriving& clean, const Robot& robot, SlipOptions& options) {
  const LearnOptions how{options.probability};
  if (options.method == SlipMethod::published) {
    LearnedBand learned = learn_band(clean.intervals, robot, how);
    options.band = learned.band;
    return {std::move(learned.sample), learned.band.normality, learned.band.empirical,
            learned.band.beyond_sample};
  }
  LearnedResiduals learned = learn_residuals(clean.intervals, robot, how);
  options.model = learned.model;
  return {std::move(learned.sample), learned.normality, learned.model.empirical, learned.model.beyond_sample};
}

Provenance provenance_of(const Recording& recording, const RobotFile& robot, const CleanDriving& clean,
                         const SlipQuestion& question) {
  Provenance provenance{recording.inputs,
                        {{"method", name_of(question.method)},
                         {"probability", fmt::format("{}", question.probability)},
                         {"interval-s", fmt::format("{}", question.interval_s)},
                         {"spin-odds", fmt::format("{}", question.spin_odds)}},
                        std::nullopt};
  provenance.inputs.push_back(robot.file);
  add_inputs(clean.inputs, provenance);
  for (const std::string& folder : question.learn) provenance.options.emplace_back("learn", folder);
  add_read_options(question.reading, provenance);
  return provenance;
}

void warn_of_learning(const SlipQuestion& question, SlipAnswer& answer) {
  if (!answer.learned || !answer.learned->empirical) return;
  answer.report.findings.push_back({.severity = Severity::warning,
                                    .code = FindingCode::not_normal,
                                    .place = first_learned(question),
                                    .count = answer.learned->normality.moments.count,
                                    .payload = answer.learned->beyond_sample
                                                   ? Payload(payload::Amount{question.probability})
                                                   : Payload()});
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

Json to_json(const LearnedSlip& learned, const SlipOptions& options) {
  Json document = {{"normality", to_json(learned.normality)},
                   {"empirical_limit", learned.empirical},
                   {"beyond_sample", learned.beyond_sample}};
  if (options.band)
    document["band"] = {{"unit", "rad"},
                        {"lower", options.band->lower},
                        {"upper", options.band->upper},
                        {"interval_s", options.band->interval_s},
                        {"least_speed_m_s", options.band->least_speed_m_s},
                        {"greatest_speed_m_s", options.band->greatest_speed_m_s}};
  if (options.model)
    document["residuals"] = {{"intervals", options.model->samples},
                             {"interval_s", options.model->interval_s},
                             {"timing_sigma_s", options.model->timing_sigma_s},
                             {"chi2_limit", options.model->limit},
                             {"persistent_limit", options.model->persistent_limit}};
  document["histogram"] = Json::array();
  for (const Bin& bin : histogram_of(learned.sample, 20))
    document["histogram"].push_back({{"centre", bin.centre}, {"count", bin.count}});
  document["quantiles"] = Json::array();
  for (const QuantilePair& pair : quantile_pairs(learned.sample))
    document["quantiles"].push_back({pair.normal, pair.sample});
  return document;
}

SlipRow row_of(const SlipEvent& event, double by_chance, const Robot& robot) {
  return {.start_s = event.start_s,
          .end_s = event.end_s,
          .wheel = wheel_of(event, robot),
          .kind = name_of(event.kind),
          .excess_m = event.excess_m,
          .confidence = event.confidence,
          .excess_sigma_m = event.excess_sigma_m,
          .by_chance = by_chance};
}

Json to_json(const SlipCounts& counts) {
  return {{"intervals", counts.intervals},
          {"judged", counts.judged},
          {"parked", counts.parked},
          {"no_gyro", counts.no_gyro},
          {"not_applicable", counts.not_applicable},
          {"not_learned", counts.not_learned},
          {"alarms", counts.alarms},
          {"alarms_by_chance", counts.by_chance},
          {"slipping", counts.slipping},
          {"flagged_share", counts.flagged_share()}};
}

/// The statistic of every interval, and what it is judged by.
SlipTimeline timeline_of(const SlipReport& report) {
  SlipTimeline timeline{.statistic = report.band ? "delta_rad" : "chi2"};
  if (report.band) {
    timeline.lower = report.band->lower;
    timeline.upper = report.band->upper;
  } else {
    timeline.limit = report.chi2_limit;
  }
  for (const SlipInterval& interval : report.intervals) {
    timeline.end_s.push_back(interval.end_s);
    timeline.value.push_back(interval.status == SlipStatus::judged ? interval.statistic : std::nan(""));
    timeline.status.push_back(name_of(interval.status));
    timeline.slipping.push_back(interval.slipping);
  }
  return timeline;
}

}  // namespace

std::string name_of(SlipMethod method) {
  return method == SlipMethod::published ? "published" : "general";
}

SlipAnswer answer_slip(const Recording& recording, const RobotFile& robot, const SlipQuestion& question) {
  SlipAnswer answer;
  answer.options.method = question.method;
  answer.options.probability = question.probability;
  answer.options.interval_s = question.interval_s;
  answer.options.spin_odds = question.spin_odds;
  const CleanDriving clean = clean_driving(robot.robot, question);
  if (!question.learn.empty() || !question.clean.empty())
    answer.learned = learn(clean, robot.robot, answer.options);
  Replay replay(recording, robot.robot);
  GyroClock gyro_clock(recording, robot.robot);
  SlipSearch search(robot.robot, recording.commands, answer.options);
  while (const std::optional<AlignedInterval> interval = replay.next()) {
    gyro_clock.add(interval->increment, interval->bridged);
    search.step(interval->increment, interval->bridged);
  }
  answer.report = search.finish(replay.start_s());
  const BoardClocks clocks = compare_clocks(recording, robot.robot, gyro_clock.take_offset(replay.start_s()));
  auto& findings = answer.report.findings;
  for (const auto& problem : {clocks.gyro.problem, clocks.steering.problem})
    if (problem) findings.push_back(*problem);
  findings.insert(findings.begin(), recording.findings.begin(), recording.findings.end());
  warn_of_learning(question, answer);
  answer.provenance = provenance_of(recording, robot, clean, question);
  answer.recording = recording.name;
  return answer;
}

IntegratedOdometry corrected_odometry(const Recording& recording, const SlipAnswer& answer,
                                      const Robot& robot, const TakePose& take) {
  IncrementCorrector corrector(answer.report.corrections, robot.chassis);
  IntegrateOptions options;
  options.corrected = [&](const Increment& increment) { return corrector.next(increment); };
  if (take)
    options.take = [&](const StampedPose& pose, const Matrix3& covariance) {
      require_sound(pose, covariance, answer.recording);
      take(pose, covariance);
    };
  IntegratedOdometry corrected = integrate(recording, robot, options);
  require_sound(corrected.trajectory, answer.recording);
  return corrected;
}

AlignedReadings corrected_readings(const Recording& recording, const RobotFile& robot,
                                   const std::optional<SlipQuestion>& slip, const SlipAnswer* found,
                                   Provenance& provenance) {
  AlignedReadings readings = align(recording, robot.robot);
  if (!slip) return readings;
  const std::optional<SlipAnswer> own =
      found ? std::nullopt : std::optional(answer_slip(recording, robot, *slip));
  const SlipAnswer& answer = found ? *found : *own;
  add_inputs(answer.provenance.inputs, provenance);
  return corrected(std::move(readings), answer.report, robot.robot);
}

void add_options_of(const std::optional<SlipQuestion>& slip, Provenance& provenance) {
  if (!slip) return;
  provenance.options.emplace_back("correct-slip", "true");
  provenance.options.emplace_back("spin-odds", fmt::format("{}", slip->spin_odds));
  for (const std::string& folder : slip->learn) provenance.options.emplace_back("learn", folder);
}

SlipResult slip_result_of(const SlipAnswer& answer, const Robot& robot) {
  SlipResult result{.counts = to_json(answer.report.counts),
                    .timeline = timeline_of(answer.report),
                    .cannot_see = abilities_of(robot, robot.chassis.gyro.has_value()).cannot};
  const std::vector<double> by_chance = shares_by_chance(answer.report);
  for (std::size_t i = 0; i < by_chance.size(); ++i)
    result.events.push_back(row_of(answer.report.events[i], by_chance[i], robot));
  if (answer.learned) result.learned = to_json(*answer.learned, answer.options);
  return result;
}

nlohmann::ordered_json document_of(const SlipAnswer& answer, const Robot& robot) {
  Json document = to_json(answer.provenance);
  document.update(to_json(slip_result_of(answer, robot)));
  document["problems"] = to_json(answer.report.findings);
  return document;
}

std::string slip_csv_of(const SlipAnswer& answer, const Robot& robot) {
  return head_of(answer.provenance) + to_csv(answer.report, robot);
}

}  // namespace trundle::pipeline
