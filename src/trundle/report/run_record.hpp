#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/report/provenance.hpp"

namespace trundle::report {

/// The stages of `trundle run`, in their order.
enum class StageKind {
  health_check,
  calibration,
  odometry,
  slip,
  localization,
  slam,
  evaluation,
  viewer_file,  ///< where one was asked for
  report,
  recording,  ///< of a session: all the stages of one of its recordings
};
/// "health check"
std::string_view name_of(StageKind kind);

enum class StageStatus {
  done,
  skipped,  ///< does not apply to this recording or robot, or was not asked for
  failed,   ///< was tried; the data could not answer, or an input of the stage was wrong
};
std::string_view name_of(StageStatus status);

struct Stage {
  StageKind kind = StageKind::recording;
  StageStatus status = StageStatus::failed;
  std::string message = {};               ///< one sentence: what came out, or why nothing did
  std::vector<std::string> outputs = {};  ///< relative to the folder
  std::vector<std::string> remarks = {};  ///< "warning: ..." or "note: ...": what it found besides
  std::string recording = {};             ///< which one, where it is a recording of a session
};
/// Of its kind, or of the recording.
std::string name_of(const Stage& stage);

/// A trajectory that was written.
struct RunTrajectory {
  std::string name;
  std::string file;  ///< relative to the folder
  std::string what;
};

/// What run.json says: what was asked, what was done, what could not be, and why.
struct RunRecord {
  Provenance provenance = {};
  std::string recording_name = {};
  std::string session = {};
  std::string recording_path = {};
  std::string given_robot = {};
  std::string used_robot = {};        ///< relative to the folder where it was made there
  std::optional<bool> held_out = {};  ///< from the calibration; nothing: there was none here
  std::vector<Stage> stages = {};
  std::vector<RunTrajectory> trajectories = {};
  std::vector<std::string> recordings = {};  ///< of a session: their folders
};

nlohmann::ordered_json to_json(const Stage& stage);
nlohmann::ordered_json to_json(const RunRecord& record);
/// Throws InputError with file, what stands there and what was expected.
RunRecord run_record_from_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
