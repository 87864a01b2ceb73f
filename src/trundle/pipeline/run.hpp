#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/evaluation/evaluate.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/viewers/shown.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/report/run_record.hpp"

namespace trundle::pipeline {

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
  std::optional<ViewerFormat> viewer = {};  ///< then also run.mcap or run.wpilog
  ReadOptions reading = {};                 ///< how its recordings are read
  /// The robot before it was calibrated elsewhere, to compare with; empty: `robot`.
  std::string before = {};
  std::string calibrated_on = {};  ///< and on what it was, in words
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

/// Why there is no answer.
struct Failure {
  ExitCode kind = kBug;  ///< whether an input is wrong or the data cannot answer
  std::string message;
};

/// Of a trajectory, against the reference.
struct PositionError {
  std::string trajectory;
  Alignment alignment = Alignment::start;
  double rms_m = 0.0;
};

struct RunAnswer {
  RunRecord record;
  std::optional<Failure> no_odometry;  ///< of a session: of none of its recordings, and why not of the first
  /// Of one recording: aligned at the start, and by the best fit, which needs no headings in its reference.
  std::vector<PositionError> errors = {};
};

/// Health check, calibration, gyro and slip, corrected odometry, localization and mapping, evaluation,
/// report: docs/run.md. A stage that cannot run says why, and the rest goes on; all that can be determined is
/// written. Throws InputError where recording or robot cannot be read, or a result cannot be written.
RunAnswer run(const RunQuestion& question, const OnProgress& on_progress = {});

}  // namespace trundle::pipeline
