#include "trundle/pipeline/init_answer.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/log_answer.hpp"

namespace trundle::pipeline {
namespace {

using InitJson = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// From the folder of the drafts, so that both may move together; of a log that is far away where it is.
std::string path_from(const fs::path& folder, const fs::path& file) {
  constexpr std::ptrdiff_t kNear = 2;  // folders up
  const fs::path whole = fs::weakly_canonical(fs::absolute(file));
  const fs::path relative = whole.lexically_relative(fs::weakly_canonical(fs::absolute(folder)));
  const bool is_near = !relative.empty() && std::count(relative.begin(), relative.end(), "..") <= kNear;
  return (is_near ? relative : whole).generic_string();
}

void require_unedited(const OutputFile& file) {
  if (!fs::exists(file.path) || (fs::is_regular_file(file.path) && read_file(file.path) == file.content))
    return;
  throw InputError(file.path.string(), "is there already and says something else",
                   "another folder for the drafts");
}

DraftQuestion draft_question_of(const InitQuestion& question, Provenance& provenance) {
  DraftQuestion draft;
  if (logs::is_log(question.log)) {
    draft.file = path_from(question.folder, question.log);
    const std::unique_ptr<logs::Log> log = logs::open_log(question.log);
    draft.summary = logs::survey(*log, {.fields = true}, logs::Definitions(question.message_folders));
    const bool has_parameters = std::ranges::any_of(
        draft.summary.topics, [](const logs::TopicSummary& topic) { return topic.type == "PARM"; });
    draft.mounting_of = [log = question.log](const std::string& topic) {
      return recording::mounting_of(log, topic);
    };
    if (has_parameters) draft.parameters = read_parameters(question.log);
    add_inputs(inputs_of_log(question.log), provenance);
  } else if (fs::is_directory(question.log)) {
    draft.is_csv = true;
    const std::string folder = path_from(question.folder, question.log);
    draft.file = folder == "." ? "" : folder + "/";
    draft.summary = survey_tables(question.log);
    for (const logs::TopicSummary& table : draft.summary.topics)
      provenance.inputs.push_back(input_file(question.log / table.topic));
  } else {
    (void)logs::open_log(question.log);  // says what is wrong
  }
  const auto read = [&](const std::string& file, RobotGeometry (*reader)(const fs::path&)) {
    std::optional<RobotGeometry> geometry;
    if (file.empty()) return geometry;
    geometry = reader(file);
    provenance.inputs.push_back(input_file(file));
    return geometry;
  };
  draft.urdf = read(question.urdf, read_urdf);
  draft.controller = read(question.controller, read_controller);
  return draft;
}

InitJson json_of(const DraftStream& stream) {
  InitJson json = {{"stream", stream.table}, {"file", stream.file}};
  if (!stream.topic.empty()) json["topic"] = stream.topic;
  if (stream.rebuilt_separation_m) json["rebuilt_wheel_separation_m"] = *stream.rebuilt_separation_m;
  if (!stream.body_frame.empty()) json["body_frame"] = stream.body_frame;
  for (const DraftColumn& column : stream.columns) {
    InitJson source = {{"field", column.field}};
    if (!column.topic.empty()) source["topic"] = column.topic;
    if (!column.unit.empty()) source["unit"] = column.unit;
    if (column.scale != 1.0) source["scale"] = column.scale;
    json["columns"][column.column] = std::move(source);
  }
  json["reason"] = stream.reason;
  return json;
}

/// What is not known of the wheels, the robot's own odometry may tell: it was computed with it.
Draft completed(Draft draft, DraftQuestion question, const fs::path& log) {
  if (draft.to_fill_in.empty() || question.is_csv || question.controller) return draft;
  const auto odometry = std::ranges::find_if(draft.alternatives, [](const DraftStream& stream) {
    return stream.table == "velocity" && !stream.topic.empty();
  });
  if (odometry == draft.alternatives.end()) return draft;
  question.controller = geometry_from_odometry(log, draft, odometry->topic);
  if (!question.controller) return draft;
  const std::string topic = odometry->topic;
  double& separation_m =
      question.controller->wheel_separation_m.emplace(question.controller->wheel_separation_m.value_or(0.0));
  const bool is_mirrored = separation_m < 0.0;
  separation_m = std::abs(separation_m);
  if (separation_m == 0.0) question.controller->wheel_separation_m.reset();
  draft = draft_of(question);
  draft.sources.push_back(fmt::format(
      "diameter_m and y_m: those with which {} was computed from the angles of the wheels", topic));
  draft.notes.push_back(draft.sources.back());
  if (is_mirrored)
    draft.notes.push_back(
        fmt::format("{} turns the other way than its wheels say by their names: one of them is wrong, and "
                    "trundle info shows by "
                    "the gyro which",
                    topic));
  return draft;
}

}  // namespace

InitAnswer answer_init(const InitQuestion& question) {
  InitAnswer answer;
  DraftQuestion draft_question = draft_question_of(question, answer.provenance);
  Draft draft = draft_of(draft_question);
  answer.draft = completed(std::move(draft), std::move(draft_question), question.log);
  const std::string head = head_of(answer.provenance);
  const fs::path map = question.folder / "recording.toml";
  answer.draft.gyro = gyro_at_rest(answer.draft, map, question.message_folders);
  answer.files.push_back({question.folder / "robot.toml", head + robot_toml(answer.draft)});
  answer.files.push_back({map, head + recording_toml(answer.draft)});
  for (const OutputFile& file : answer.files) require_unedited(file);
  return answer;
}

InitJson document_of(const InitAnswer& answer) {
  InitJson document = to_json(answer.provenance);
  document["streams"] = InitJson::array();
  for (const DraftStream& stream : answer.draft.streams) document["streams"].push_back(json_of(stream));
  document["alternatives"] = InitJson::array();
  for (const DraftStream& stream : answer.draft.alternatives)
    document["alternatives"].push_back(json_of(stream));
  if (const auto& gyro = answer.draft.gyro)
    document["gyro"] = {{"bias_rad_s", gyro->bias_rad_s},
                        {"noise_rad_s_sqrt_hz", gyro->noise_rad_s_sqrt_hz},
                        {"noise_sigma", gyro->noise_sigma},
                        {"rest_s", gyro->rest_s}};
  document["to_fill_in"] = answer.draft.to_fill_in;
  document["notes"] = answer.draft.notes;
  document["files"] = InitJson::array();
  for (const OutputFile& file : answer.files) document["files"].push_back(file.path.string());
  return document;
}

}  // namespace trundle::pipeline
