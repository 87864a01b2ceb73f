#include "trundle/pipeline/merge_answer.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/report/json_rules.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/slam/map_file.hpp"

namespace trundle::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// By the summary of the command that made the map; a map without one is taken at its word.
double read_metre_sigma(const fs::path& folder, Provenance& provenance) {
  static constexpr std::array kRules = {JsonRule{"metre_sigma", kNumber | kMissing}};
  for (const std::string name : {"slam", "merge"}) {
    const fs::path file = folder / (name + ".json");
    if (!fs::exists(file)) continue;
    const double sigma = parse_result(read_file(file), name, kRules, file.string()).value("metre_sigma", 0.0);
    if (sigma < 0.0 || sigma >= 1.0)
      throw InputError(file.string(), fmt::format("\"metre_sigma\" is {:g}", sigma), "a share, 0 to 1");
    add_inputs({input_file(file)}, provenance);
    return sigma;
  }
  return 0.0;
}

JointMap read_joint_map(const std::string& given, Provenance& provenance) {
  const fs::path file = fs::is_directory(given) ? fs::path(given) / "landmarks.csv" : fs::path(given);
  const std::vector<MapLandmark> landmarks = read_landmark_map(file);
  const fs::path beside = covariance_file_of(file);
  if (!fs::exists(beside))
    throw CannotAnswer(
        fmt::format("{}: no covariance of all its landmarks together ({}): how they err in common is what "
                    "merging rests on; 'slam --smooth', '--filter ekf' and '--filter smoother' write it",
                    file.string(), beside.filename().string()));
  JointMap map{.from = given};
  map.covariance = read_landmark_covariance(beside, landmarks);
  for (const MapLandmark& landmark : landmarks) {
    map.names.push_back(landmark.name);
    map.positions.push_back(landmark.position);
  }
  add_inputs({input_file(file), input_file(beside)}, provenance);
  map.metre_sigma = read_metre_sigma(file.parent_path(), provenance);
  return map;
}

/// In how many maps each landmark is.
std::vector<std::size_t> counts_of(const MergedMap& merged) {
  std::vector<std::size_t> counts(merged.map.positions.size(), 0);
  for (const auto& numbers : merged.landmark_of)
    for (const std::size_t number : numbers) ++counts[number];
  return counts;
}

Json frame_json(const MergeAnswer& answer, std::size_t k) {
  const MergedMap& merged = answer.merged;
  const Pose2& frame = merged.first_from_map[k];
  const Matrix3& C = merged.frame_covariance[k];
  Json landmarks = Json::array();
  for (const std::size_t number : merged.landmark_of[k]) landmarks.push_back(merged.map.names[number]);
  return {{"map", answer.maps[k]},
          {"x_m", frame.x},
          {"y_m", frame.y},
          {"heading_rad", wrap_angle(frame.heading)},
          {"sigma",
           {{"x_m", std::sqrt(C(0, 0))}, {"y_m", std::sqrt(C(1, 1))}, {"heading_rad", std::sqrt(C(2, 2))}}},
          {"metre", {{"share", merged.metre[k]}, {"sigma", merged.metre_sigma[k]}}},
          {"landmarks", answer.landmarks[k]},
          {"shared", shared_landmarks(merged, k)},
          {"names", landmarks}};
}

}  // namespace

std::size_t shared_landmarks(const MergedMap& merged, std::size_t map) {
  const std::vector<std::size_t> counts = counts_of(merged);
  return static_cast<std::size_t>(
      std::ranges::count_if(merged.landmark_of[map], [&](std::size_t number) { return counts[number] > 1; }));
}

std::vector<MappedLandmark> landmarks_of(const MergedMap& merged) {
  std::vector<MappedLandmark> map;
  const std::vector<std::size_t> counts = counts_of(merged);
  for (std::size_t i = 0; i < merged.map.positions.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    map.push_back({static_cast<LandmarkId>(i), merged.map.positions[i],
                   merged.map.covariance.block<2, 2>(at, at), counts[i]});
  }
  return map;
}

MergeAnswer answer_merge(const MergeQuestion& question) {
  MergeAnswer answer{.provenance = {}, .maps = question.maps, .landmarks = {}, .merged = {}};
  if (question.unknown_ids) answer.provenance.options.emplace_back("unknown-ids", "true");
  std::vector<JointMap> maps;
  for (const std::string& given : question.maps) maps.push_back(read_joint_map(given, answer.provenance));
  for (const JointMap& map : maps) answer.landmarks.push_back(map.positions.size());
  answer.merged = merge_maps(maps, {.unknown_ids = question.unknown_ids});
  require_sound(landmarks_of(answer.merged), "the merged map");
  return answer;
}

Json document_of(const MergeAnswer& answer) {
  Json document = to_json(answer.provenance);
  document["landmarks"] = answer.merged.map.positions.size();
  document["cost"] = answer.merged.cost;
  document["degrees_of_freedom"] = answer.merged.degrees_of_freedom;
  if (answer.merged.map.metre_sigma > 0.0) document["metre_sigma"] = answer.merged.map.metre_sigma;
  document["frames"] = Json::array();
  for (std::size_t k = 0; k < answer.maps.size(); ++k) document["frames"].push_back(frame_json(answer, k));
  return document;
}

std::vector<OutputFile> files_of(const MergeAnswer& answer, const fs::path& folder) {
  const std::string head = head_of(answer.provenance);
  const JointMap& map = answer.merged.map;
  return {{folder / "landmarks.csv", head + to_csv(landmarks_of(answer.merged), map.names)},
          {covariance_file_of(folder / "landmarks.csv"),
           head + landmark_covariance_csv(map.names, map.covariance)},
          {folder / "merge.json", dumped(document_of(answer), 2) + "\n"}};
}

}  // namespace trundle::pipeline
