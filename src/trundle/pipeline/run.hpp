#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/pipeline/slam_answer.hpp"

namespace trundle {

/// What `trundle run` is asked. Paths as they were given: the outputs name them so.
struct RunQuestion {
  std::string recording;  ///< a folder with one recording, or with those of a session
  std::string robot;
  std::filesystem::path output;                ///< folder for all results
  std::vector<std::string> calibrate_on = {};  ///< recordings to learn from; empty: the recording itself
  CalibrateOptions calibrate = {};
  std::vector<std::string> learn = {};         ///< recordings without slip, to measure the noise on
  double spin_odds = SlipOptions{}.spin_odds;  ///< as in SlipQuestion
  std::string map = {};                        ///< of landmarks; empty: landmarks.csv of the recording
  SlamQuestion slam = {};
  int robot_number = 0;  ///< of a folder with several robots; 0: not given
  /// The robot before it was calibrated elsewhere, to compare with; empty: `robot`.
  std::string before = {};
};

enum class StageStatus {
  done,
  skipped,  ///< does not apply to this recording or robot, or was not asked for
  failed,   ///< was tried; the data could not answer, or an input of the stage was wrong
};
std::string_view name_of(StageStatus status);

struct Stage {
  std::string name;
  StageStatus status = StageStatus::failed;
  std::string message;                    ///< one sentence: what came out, or why nothing did
  std::vector<std::string> outputs;       ///< relative to the folder
  std::vector<std::string> remarks = {};  ///< "warning: ..." or "note: ...": what it found besides
};

/// A trajectory that was written.
struct RunTrajectory {
  std::string name;
  std::string file;  ///< relative to the folder
  std::string what;
};

struct RunAnswer {
  Provenance provenance;
  std::string recording_name;
  std::string session;
  std::string recording_path;
  std::string given_robot;
  std::string used_robot;        ///< relative to the folder where it was made there
  std::optional<bool> held_out;  ///< from the calibration; nothing: there was none here
  std::vector<Stage> stages;
  std::vector<RunTrajectory> trajectories;
  std::vector<std::string> recordings;  ///< of a session: their folders
};

/// What is told while it runs: before a stage, within a long one (done of so many steps), and after it.
struct RunProgress {
  std::string_view recording;
  std::string_view stage;
  const Stage* finished = nullptr;
  std::size_t done = 0;
  std::size_t of = 0;  ///< 0: not known
};
using OnProgress = std::function<void(const RunProgress&)>;

/// Health check, calibration, gyro and slip, corrected odometry, localization and mapping, evaluation,
/// report: docs/run.md. A stage that cannot run says why, and the rest goes on. Throws InputError where
/// recording or robot cannot be read; and, after all that can be told was written, what odometry threw.
RunAnswer run(const RunQuestion& question, const OnProgress& on_progress = {});

/// What stands in run.json.
nlohmann::ordered_json document_of(const RunAnswer& answer);

}  // namespace trundle
