#include "trundle/report/run_record.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using Texts = std::vector<std::string>;

constexpr std::array<std::string_view, 10> kStageNames = {
    "health check", "calibration", "odometry", "slip",   "localization",
    "slam",         "evaluation",  "export",   "report", "recording"};
constexpr std::array<std::string_view, 3> kStatusNames = {"done", "skipped", "failed"};

constexpr std::array kRunRules = {
    JsonRule{"version", kString | kMissing},
    JsonRule{"inputs", kArray | kMissing},
    JsonRule{"inputs/*", kObject | kMissing},
    JsonRule{"inputs/*/path", kString | kMissing},
    JsonRule{"inputs/*/sha256", kString | kMissing},
    JsonRule{"options", kObject | kMissing},
    JsonRule{"stages", kArray},
    JsonRule{"stages/*", kObject},
    JsonRule{"stages/*/name", kString},
    JsonRule{"stages/*/status", kString},
    JsonRule{"stages/*/message", kString},
    JsonRule{"stages/*/remarks", kArray | kMissing},
    JsonRule{"stages/*/remarks/*", kString | kMissing},
    JsonRule{"stages/*/outputs", kArray | kMissing},
    JsonRule{"stages/*/outputs/*", kString | kMissing},
    JsonRule{"trajectories", kArray | kMissing},
    JsonRule{"trajectories/*", kObject | kMissing},
    JsonRule{"trajectories/*/name", kString | kMissing},
    JsonRule{"trajectories/*/file", kString | kMissing},
    JsonRule{"trajectories/*/what", kString | kMissing},
    JsonRule{"recording", kObject | kMissing},
    JsonRule{"recording/name", kString},
    JsonRule{"recording/session", kString | kMissing},
    JsonRule{"recording/path", kString | kMissing},
    JsonRule{"robot", kObject | kMissing},
    JsonRule{"robot/given", kString | kMissing},
    JsonRule{"robot/used", kString | kMissing},
    JsonRule{"held_out", kBool | kNull | kMissing},
    JsonRule{"recordings", kArray | kMissing},
    JsonRule{"recordings/*", kString | kMissing},
};

StageStatus status_named(const std::string& name, std::size_t stage, std::string_view file_name) {
  const auto found = std::ranges::find(kStatusNames, name);
  if (found == kStatusNames.end())
    throw InputError(file_name, fmt::format("\"stages[{}].status\" is \"{}\"", stage, name),
                     fmt::format("{}", fmt::join(kStatusNames, ", ")));
  return static_cast<StageStatus>(found - kStatusNames.begin());
}

/// What is no stage's name is that of a recording.
StageKind stage_kind_named(const std::string& name) {
  const auto found = std::ranges::find(kStageNames, name);
  return found == kStageNames.end() ? StageKind::recording
                                    : static_cast<StageKind>(found - kStageNames.begin());
}

Stage stage_from_json(const Json& json, std::size_t index, std::string_view file_name) {
  const std::string name = json.at("name");
  Stage stage{.kind = stage_kind_named(name),
              .status = status_named(json.at("status"), index, file_name),
              .message = json.at("message"),
              .outputs = json.value("outputs", Texts()),
              .remarks = json.value("remarks", Texts())};
  if (stage.kind == StageKind::recording) stage.recording = name;
  return stage;
}

}  // namespace

std::string_view name_of(StageKind kind) {
  return kStageNames[static_cast<std::size_t>(kind)];
}

std::string_view name_of(StageStatus status) {
  return kStatusNames[static_cast<std::size_t>(status)];
}

std::string name_of(const Stage& stage) {
  return stage.kind == StageKind::recording ? stage.recording : std::string(name_of(stage.kind));
}

Json to_json(const Stage& stage) {
  return {{"name", name_of(stage)},
          {"status", name_of(stage.status)},
          {"message", stage.message},
          {"remarks", stage.remarks},
          {"outputs", stage.outputs}};
}

Json to_json(const RunRecord& record) {
  Json document = {{"format", "trundle-run"}, {"format_version", 1}};
  document.update(to_json(record.provenance));
  document["recording"] = {
      {"name", record.recording_name}, {"session", record.session}, {"path", record.recording_path}};
  document["robot"] = {{"given", record.given_robot}, {"used", record.used_robot}};
  document["held_out"] = record.held_out ? Json(*record.held_out) : Json();
  document["stages"] = Json::array();
  for (const Stage& stage : record.stages) document["stages"].push_back(to_json(stage));
  document["trajectories"] = Json::array();
  for (const RunTrajectory& trajectory : record.trajectories)
    document["trajectories"].push_back(
        {{"name", trajectory.name}, {"file", trajectory.file}, {"what", trajectory.what}});
  if (!record.recordings.empty()) document["recordings"] = record.recordings;
  return document;
}

RunRecord run_record_from_json(std::string_view text, std::string_view file_name) {
  const Json document = parse_result(text, "run", kRunRules, file_name);
  const Json recording = document.value("recording", Json::object());
  const Json robot = document.value("robot", Json::object());
  RunRecord record{.provenance = provenance_from_json(document),
                   .recording_name = recording.value("name", ""),
                   .session = recording.value("session", ""),
                   .recording_path = recording.value("path", ""),
                   .given_robot = robot.value("given", ""),
                   .used_robot = robot.value("used", ""),
                   .recordings = document.value("recordings", Texts())};
  if (const Json held_out = document.value("held_out", Json()); held_out.is_boolean())
    record.held_out = held_out.get<bool>();
  for (const Json& stage : document.at("stages"))
    record.stages.push_back(stage_from_json(stage, record.stages.size(), file_name));
  for (const Json& one : document.value("trajectories", Json::array()))
    record.trajectories.push_back({one.value("name", ""), one.value("file", ""), one.value("what", "")});
  return record;
}

}  // namespace trundle::report
