#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/pipeline/slip_answer.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/slam/localization/localizer.hpp"

namespace trundle::pipeline {

/// A map of landmarks, and the file that said so; with the covariance of all where that lies beside it.
struct MapFile {
  std::vector<MapLandmark> landmarks;
  InputFile file;
  Eigen::MatrixXd covariance = {};
  std::optional<InputFile> covariance_file = {};
};
/// Throws as read_landmark_map and read_landmark_covariance.
MapFile read_map_file(const std::filesystem::path& path);

/// What `trundle localize` is asked, besides recording, robot and map.
struct LocalizeQuestion {
  LocalizerFilter filter = LocalizerOptions{}.filter;
  std::size_t particles = ParticleNumber{}.most;  ///< at most
  std::uint64_t seed = LocalizerOptions{}.seed;
  std::optional<Pose2> start = {};  ///< pose at the first stamp; nothing: it is searched
  std::string start_text = "";      ///< the same as it was given
  double start_sigma_m = 0.5;
  double start_sigma_deg = 10.0;
  bool unknown_ids = false;               ///< forget the landmarks' names and find out which is which
  std::optional<SlipQuestion> slip = {};  ///< then the odometry is corrected for slip first, found so
  ReadOptions reading = {};               ///< how its recordings are read
};

struct LocalizeAnswer {
  Provenance provenance;
  SlamInput input;  ///< with the findings of reading the recording
  std::size_t landmarks = 0;
  bool has_map_covariance = false;  ///< of all landmarks together
  Localization result;
};

/// `slip_found`: the answer to question.slip, where it is there already.
/// Throws as slam_input and localize, and CannotAnswer where the pose never becomes known.
LocalizeAnswer answer_localize(const Recording& recording, const RobotFile& robot, const MapFile& map,
                               const LocalizeQuestion& question, const SlipAnswer* slip_found = nullptr);

/// What the filter did, a row for each step and for each sighting: --steps, --innovations.
std::string steps_csv_of(const LocalizeAnswer& answer);
std::string innovations_csv_of(const LocalizeAnswer& answer);

/// What `trundle localize --json` prints.
nlohmann::ordered_json document_of(const LocalizeAnswer& answer);

}  // namespace trundle::pipeline
