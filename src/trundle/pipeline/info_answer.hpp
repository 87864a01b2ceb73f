#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/inspection/findings.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::pipeline {

/// One recording and all that is told of it.
struct RecordingInfo {
  const Recording& recording;  ///< must outlive it
  Findings findings;
  std::optional<GyroNoise> noise;  ///< where it was asked for
};
/// Throws CannotAnswer where the gyro's noise is asked for and cannot be determined.
RecordingInfo inform(const Recording& recording, const Robot* robot, bool with_gyro_noise);

struct InfoAnswer {
  Provenance provenance;
  std::vector<RecordingInfo> recordings;  ///< at least one
};

/// What `trundle info` is asked.
struct InfoQuestion {
  std::optional<RobotFile> robot = {};
  bool gyro_noise = false;
  ReadOptions reading = {};  ///< how its recordings are read
};
/// The recordings must outlive the answer.
InfoAnswer answer_info(const std::vector<Recording>& recordings, const InfoQuestion& question);

/// What `trundle info --json` prints.
nlohmann::ordered_json document_of(const InfoAnswer& answer);

/// What was measured of a run, in words: name and text.
std::vector<std::pair<std::string, std::string>> references_of(const Recording& recording);

}  // namespace trundle::pipeline
