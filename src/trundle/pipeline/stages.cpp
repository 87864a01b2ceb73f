#include "trundle/pipeline/stages.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/geometry/thinning.hpp"
#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/report_answer.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/page.hpp"
#include "trundle/slip/parity.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

/// A trajectory whose file is written while its poses come, and what is kept of it.
struct Streamed {
  WrittenTrajectory trajectory;
  OutputFile file;
};

/// `produce` hands the poses on, one after the other.
Streamed streamed(WrittenTrajectory trajectory, OutputFile file, const WriteNow& write_now,
                  const std::function<void(const TakePose&)>& produce) {
  ThinnedTrajectory kept(kMostPosesKept, true);
  file.rest = [&](const TakeText& take) {
    TrajectoryWriter writer(TrajectoryFormat::csv, true, take);
    produce([&](const StampedPose& pose, const Matrix3& covariance) {
      writer.add(pose, covariance);
      kept.add(pose, covariance);
    });
    writer.finish();
  };
  file = write_now(std::move(file));
  const std::size_t left_out = kept.left_out();
  trajectory.file = written_trajectory(kept.take(), file);
  trajectory.file.left_out = left_out;
  return {std::move(trajectory), std::move(file)};
}

/// Trajectory and document of one robot.
Found<Odometry> integrate_with(const RunInputs& inputs, const RobotFile& robot, TrackRole role,
                               const std::string& what, const WriteNow& write_now) {
  const OdometryQuestion question{.reading = inputs.question.reading};
  const std::string name(name_of(role));
  OdometryAnswer answer;
  Streamed csv = streamed(
      {.entry = {name, name + ".csv", what}, .role = role, .file = {}},
      {inputs.in_folder(name + ".csv"), head_of(provenance_of_odometry(inputs.recording(), robot, question))},
      write_now,
      [&](const TakePose& take) { answer = answer_odometry(inputs.recording(), robot, question, take); });
  Found<Odometry> found{.value = {.trajectories = {}, .result = odometry_result_of(answer)},
                        .message = sentence_of(answer.odometry),
                        .files = {}};
  found.value.trajectories.push_back(std::move(csv.trajectory));
  found.files.push_back(std::move(csv.file));
  found.files.push_back({inputs.in_folder(name + ".json"), printed(document_of(answer))});
  const auto& findings = answer.odometry.findings;
  if (const auto at = std::ranges::find(findings, FindingCode::no_rest, &Finding::code); at != findings.end())
    found.remarks.push_back("note: " + describe(*at));
  return found;
}

/// By the calibration.
bool has_corrected_gyro_clock(const Robot& given, const Robot& used) {
  const auto &before = given.chassis.gyro, &after = used.chassis.gyro;
  return before && after && before->time_offset_s != after->time_offset_s;
}

bool has_corrected_steering_clock(const Robot& given, const Robot& used) {
  return steering_time_offset_s(given.chassis) != steering_time_offset_s(used.chassis);
}

template <typename T>
void insert_first(std::vector<T> first, std::vector<T>& all) {
  std::ranges::move(all, std::back_inserter(first));
  all = std::move(first);
}

}  // namespace

WrittenTrajectory written(RunTrajectory entry, TrackRole role, const Trajectory& trajectory,
                          const OutputFile& file) {
  return {.entry = std::move(entry), .role = role, .file = written_trajectory(trajectory, file)};
}

OutputFile trajectory_csv(const std::filesystem::path& path, const Provenance& provenance,
                          const Trajectory& trajectory) {
  // No row is longer: ten numbers. A text that grows would be copied, and for a while be there twice.
  constexpr std::size_t kLongestRow = 10 * sizeof("-1.7976931348623157e+308");
  OutputFile file{path, head_of(provenance)};
  file.content.reserve(file.content.size() + kLongestRow * (trajectory.poses.size() + 1));
  write_csv(trajectory, [&](std::string_view text) { file.content += text; });
  return file;
}

SlipQuestion slip_question(const RunInputs& inputs) {
  return {.learn = inputs.question.learn,
          .spin_odds = inputs.question.spin_odds,
          .reading = inputs.question.reading};
}

Found<Odometry> integrate_odometry(const RunInputs& inputs, const RobotFile& robot, const HealthCheck* health,
                                   const WriteNow& write_now) {
  const std::string as_given = "odometry with the robot file as given";
  const bool is_as_given = robot.file.sha256 == inputs.given.file.sha256;
  Found<Odometry> nominal;
  if (!is_as_given) nominal = integrate_with(inputs, inputs.given, TrackRole::nominal, as_given, write_now);
  Found<Odometry> found =
      integrate_with(inputs, robot, TrackRole::odometry,
                     is_as_given ? as_given : "odometry with the calibrated robot", write_now);
  insert_first(std::move(nominal.value.trajectories), found.value.trajectories);
  insert_first(std::move(nominal.files), found.files);
  if (health != nullptr && !has_corrected_gyro_clock(inputs.given.robot, robot.robot))
    std::ranges::copy(health->gyro_clock, std::back_inserter(found.remarks));
  if (health != nullptr && !has_corrected_steering_clock(inputs.given.robot, robot.robot))
    std::ranges::copy(health->steering_clock, std::back_inserter(found.remarks));
  return found;
}

Found<Slip> find_slips(const RunInputs& inputs, const RobotFile& robot, const WriteNow& write_now) {
  const Recording& recording = inputs.recording();
  if (robot.robot.chassis.wheel_count == 0)
    throw NotApplicable{"the robot file has no wheels: none of them can slip"};
  if (!can_show_slip(robot.robot.chassis, !recording.gyro.time_s.empty()))
    throw NotApplicable{"slip is not observable: no redundant measurement"};
  SlipAnswer slip = answer_slip(recording, robot, slip_question(inputs));
  IntegratedOdometry odometry;
  Streamed corrected = streamed(
      {.entry = {"corrected", "trajectory.csv", "odometry with the slips corrected"},
       .role = TrackRole::corrected,
       .file = {}},
      {inputs.in_folder("trajectory.csv"), head_of(slip.provenance)}, write_now,
      [&](const TakePose& take) { odometry = corrected_odometry(recording, slip, robot.robot, take); });
  Found<Slip> found{.value = {.answer = {},
                              .result = slip_result_of(slip, robot.robot),
                              .corrected = std::move(corrected.trajectory)},
                    .message = sentence_of(slip, odometry),
                    .files = {{inputs.in_folder("slip.csv"), slip_csv_of(slip, robot.robot)},
                              {inputs.in_folder("slip.json"), printed(document_of(slip, robot.robot))}}};
  found.files.push_back(std::move(corrected.file));
  found.value.answer = std::move(slip);
  found.remarks.push_back("note: " + unobservable_slip(robot.robot));
  return found;
}

Found<std::filesystem::path> draw_page(const RunInputs& inputs, Results results) {
  std::vector<Results> one;
  one.push_back(std::move(results));
  const std::filesystem::path page = inputs.in_folder("report.html");
  return {.value = page,
          .message = "wrote " + page.string(),
          .files = {{page, report_page(report_of(std::move(one)).document)}}};
}

std::string printed(const Json& document) {
  return dumped(document, 2) + "\n";
}

}  // namespace trundle::pipeline
