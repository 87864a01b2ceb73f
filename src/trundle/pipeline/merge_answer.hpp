#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/slam/merging/merge.hpp"
#include "trundle/slam/slam.hpp"

namespace trundle::pipeline {

/// What `trundle merge` is asked.
struct MergeQuestion {
  std::vector<std::string> maps = {};  ///< folders of results with landmarks.csv, or such files
  bool unknown_ids = false;
};

struct MergeAnswer {
  Provenance provenance;
  std::vector<std::string> maps;       ///< as they were given
  std::vector<std::size_t> landmarks;  ///< of each
  MergedMap merged;
};

/// Throws InputError where a map cannot be read, CannotAnswer where one has no covariance of all its
/// landmarks together, and as merge_maps.
MergeAnswer answer_merge(const MergeQuestion& question);

/// How many of its landmarks other maps have too.
[[nodiscard]] std::size_t shared_landmarks(const MergedMap& merged, std::size_t map);

/// The merged landmarks as landmarks.csv has them: their sightings are the maps that have them.
[[nodiscard]] std::vector<MappedLandmark> landmarks_of(const MergedMap& merged);

/// merge.json.
nlohmann::ordered_json document_of(const MergeAnswer& answer);
/// landmarks.csv, landmarks_covariance.csv, merge.json.
std::vector<OutputFile> files_of(const MergeAnswer& answer, const std::filesystem::path& folder);

}  // namespace trundle::pipeline
